#include "physics/model/ball_reach.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace medulla {

// In the order of a tree of median splits, so that the points of a block lie together.
static void orderByPlace(std::vector<Eigen::Vector3d>& points, std::size_t begin, std::size_t end) {
  if (end - begin <= static_cast<std::size_t>(kBlockSize)) return;
  Eigen::AlignedBox3d box;
  for (std::size_t p = begin; p < end; ++p) box.extend(points[p]);
  int axis = 0;
  box.sizes().maxCoeff(&axis);
  // Whole blocks on the left: only the last one of all stays short.
  const std::size_t blocks = (end - begin + kBlockSize - 1) / kBlockSize, middle = begin + blocks / 2 * kBlockSize;
  std::sort(points.begin() + static_cast<std::ptrdiff_t>(begin), points.begin() + static_cast<std::ptrdiff_t>(end),
            [axis](const auto& a, const auto& b) {
              for (int k = 0; k < 3; ++k) {
                const int at = (axis + k) % 3;
                if (a[at] != b[at]) return a[at] < b[at];
              }
              return false;
            });
  orderByPlace(points, begin, middle);
  orderByPlace(points, middle, end);
}

static Eigen::Matrix3Xf scaled(const std::vector<Eigen::Vector3d>& points, double diagonal) {
  Eigen::Matrix3Xf result(3, points.size());
  for (std::size_t p = 0; p < points.size(); ++p)
    result.col(static_cast<Eigen::Index>(p)) = (100 / diagonal * points[p]).cast<float>();
  return result;
}

ScaledTargets scaled(const CoverTargets& points) {
  std::vector<Eigen::Vector3d> surface = points.surface;
  orderByPlace(surface, 0, surface.size());
  return {scaled(surface, points.diagonal), scaled(points.volume, points.diagonal), points.diagonal, points.overshoot};
}

Gaps gapsTo(const ScaledTargets& targets, const Ball& ball) {
  const Eigen::Vector3f centre = scaledCentre(ball, targets.diagonal);
  const auto distance = (targets.surface.colwise() - centre).colwise().norm().transpose().array();
  return (distance - scaledRadius(ball, targets.diagonal)).max(0.f);
}

Bits insideOf(const ScaledTargets& targets, const Ball& ball) {
  const Eigen::Vector3f centre = scaledCentre(ball, targets.diagonal);
  const float radius = scaledRadius(ball, targets.diagonal), squared = radius * radius;
  const Eigen::Index count = targets.volume.cols();
  Bits bits((count + 63) / 64, 0);
  for (Eigen::Index p = 0; p < count; ++p) {
    const bool inside = (targets.volume.col(p) - centre).squaredNorm() <= squared;
    bits[p / 64] |= static_cast<std::uint64_t>(inside) << (p % 64);
  }
  return bits;
}

GapTable gapTable(const ScaledTargets& targets, const std::vector<Ball>& balls) {
  GapTable gaps(targets.surface.cols(), balls.size());
  for (std::size_t b = 0; b < balls.size(); ++b) gaps.col(static_cast<Eigen::Index>(b)) = gapsTo(targets, balls[b]);
  return gaps;
}

Reach reachOf(const ScaledTargets& targets, const std::vector<Ball>& balls) {
  Reach reach{balls, gapTable(targets, balls), {}};
  for (const Ball& ball : balls) reach.inside.push_back(insideOf(targets, ball));
  return reach;
}

}  // namespace medulla
