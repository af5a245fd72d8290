#include "physics/model/medial_balls.h"

#include <algorithm>
#include <limits>

namespace medulla {

std::vector<Ball> ballsOf(const SoftBodyModel& model) {
  std::vector<Ball> balls;
  for (const FillingSphere& s : model.spheres) balls.push_back({s.restBallCentre, s.radius});
  return balls;
}

double distanceToBalls(const Eigen::Vector3d& p, const std::vector<Ball>& balls) {
  double least = std::numeric_limits<double>::infinity();
  for (const Ball& ball : balls) least = std::min(least, (p - ball.centre).norm() - ball.radius);
  return least;
}

Ball shrinkBall(const SurfaceTree& tree, const Eigen::Vector3d& p, const Eigen::Vector3d& inward, double startRadius) {
  constexpr int iterations = 40;  // a handful suffices; a cusp converges slowly and may stop early
  double radius = startRadius;
  for (int k = 0; k < iterations; ++k) {
    const SurfacePoint nearest = closestPoint(tree, p + radius * inward);
    if (nearest.distance >= radius * (1 - 1e-6)) break;
    // The ball through p and the nearest point q, tangent at p: |p + r n - q| = r gives r = |w|^2 / (-2 w.n), w = p -
    // q.
    const Eigen::Vector3d w = p - nearest.point;
    const double denominator = -2 * w.dot(inward);
    if (denominator <= 0) break;
    const double smaller = w.squaredNorm() / denominator;
    if (smaller >= radius * (1 - 1e-7)) break;
    radius = smaller;
  }
  const Eigen::Vector3d centre = p + radius * inward;
  return {centre, std::min(radius, closestPoint(tree, centre).distance)};
}

std::vector<Ball> medialBalls(const SurfaceTree& tree, const std::vector<SurfaceSample>& samples, double diagonal) {
  std::vector<Ball> balls;
  for (const SurfaceSample& s : samples) {
    const Ball ball = shrinkBall(tree, s.point, -s.normal, 0.6 * diagonal);
    if (ball.radius > 0.004 * diagonal && isInside(tree, ball.centre)) balls.push_back(ball);
  }
  return balls;
}

}  // namespace medulla
