#include "haptics/inside.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

namespace medulla {

using Eigen::Vector3d;

// How often the triangle turns about the point as both are seen along z: -1, 0 or 1. Of the corners' y only "above" or
// "not" counts, and an edge's side is worked out from its lower end, by whichever triangle: two triangles with an edge
// in common leave no gap and do not overlap.
static int turnsAbout(const Triangle& t, const Vector3d& p) {
  int twice = 0;
  const Vector3d* corners[] = {&t.a, &t.b, &t.c, &t.a};
  for (int k = 0; k < 3; ++k) {
    const bool rises = corners[k]->y() <= p.y();
    if (rises == (corners[k + 1]->y() <= p.y())) continue;
    const Vector3d &low = *corners[rises ? k : k + 1], &high = *corners[rises ? k + 1 : k];
    const double side = (high.x() - low.x()) * (p.y() - low.y()) - (p.x() - low.x()) * (high.y() - low.y());
    if (side > 0) twice += rises ? 1 : -1;
  }
  return twice;
}

int windingNumber(const Buckets& buckets, double alpha, const Vector3d& p) {
  int winding = 0;
  for (const int t : buckets.above(p)) {
    const Triangle triangle = buckets.surface().triangle(t, alpha);
    const int turns = turnsAbout(triangle, p);
    if (turns != 0 && turns * doubleArea(triangle).dot(p - triangle.a) < 0) winding += turns;
  }
  return winding;
}

// Of a triangle around its point of these weights, one of which is 0 on an edge and two at a corner.
static double angleAround(const Triangle& triangle, const Vector3d& weights) {
  const int zeros = int(std::count(weights.data(), weights.data() + 3, 0.0));
  if (zeros < 2) return (zeros == 0 ? 2 : 1) * std::numbers::pi;
  const Vector3d corner = pointAt(triangle, weights);
  Vector3d sides[2];
  int count = 0;
  for (const Vector3d* other : {&triangle.a, &triangle.b, &triangle.c})
    if (*other != corner && count < 2) sides[count++] = (*other - corner).normalized();
  return count < 2 ? 0 : std::acos(std::clamp(sides[0].dot(sides[1]), -1.0, 1.0));
}

// Of the triangles that are nearest to it, by their normals weighted by the angles around the nearest point (Baerentzen
// and Aanaes 2005): of a surface that nowhere passes through itself, exact.
bool liesBehind(const Buckets& buckets, double alpha, const Vector3d& p) {
  constexpr double kSame = 1e-9;
  double distance = std::numeric_limits<double>::infinity();
  Vector3d nearest = p, normal = Vector3d::Zero();
  for (const int t : buckets.near(p, 0)) {
    const Triangle triangle = buckets.surface().triangle(t, alpha);
    const TrianglePoint q = closestPoint(triangle, p);
    const double d = (p - q.point).norm();
    if (d > (1 + kSame) * distance) continue;
    if (d < (1 - kSame) * distance) normal.setZero();
    distance = d;
    nearest = q.point;
    const Vector3d area = doubleArea(triangle);
    normal += angleAround(triangle, q.weights) * area.normalized();
  }
  return normal.dot(p - nearest) < 0;
}

double distanceToSurface(const BlendedSurface& surface, double alpha, const Vector3d& p) {
  double distance = std::numeric_limits<double>::infinity();
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    distance = std::min(distance, (closestPoint(surface.triangle(static_cast<int>(t), alpha), p).point - p).norm());
  return distance;
}

Vector3d justOutside(const Triangle& t, const Vector3d& weights, double standOff) {
  return pointAt(t, 0.99 * weights + Vector3d::Constant(0.01 / 3)) + standOff * doubleArea(t).normalized();
}

// Just outside of the nearest of the triangles that the point is behind, or, where that lies in another body, from
// which the way might lead back, of one farther off that leads out of all. Each look takes the whole surface: so the
// nearest are looked at, and ever fewer behind them.
static Vector3d exitOf(const Buckets& buckets, double alpha, double standOff, const Vector3d& p) {
  const BlendedSurface& surface = buckets.surface();
  std::vector<std::pair<double, int>> behind;  // distance, triangle
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    const Triangle triangle = surface.triangle(t, alpha);
    const Vector3d nearest = closestPoint(triangle, p).point;
    if (doubleArea(triangle).dot(p - nearest) <= 0) behind.emplace_back((nearest - p).norm(), t);
  }
  std::sort(behind.begin(), behind.end());
  const auto exitBy = [&](int t) {
    const Triangle triangle = surface.triangle(t, alpha);
    return justOutside(triangle, closestPoint(triangle, p).weights, standOff);
  };
  for (std::size_t k = 0; k < behind.size(); k += 1 + k / 4)
    if (Vector3d exit = exitBy(behind[k].second); windingNumber(buckets, alpha, exit) <= 0) return exit;
  return behind.empty() ? p : exitBy(behind.front().second);
}

Vector3d outOfBodies(const Buckets& buckets, double alpha, double standOff, Vector3d p) {
  const std::size_t passes = buckets.surface().firstNode.size() + 4;
  for (std::size_t pass = 0; pass < passes && windingNumber(buckets, alpha, p) > 0; ++pass)
    p = exitOf(buckets, alpha, standOff, p);
  return p;
}

}  // namespace medulla
