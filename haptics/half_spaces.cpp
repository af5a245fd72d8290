#include "haptics/half_spaces.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace medulla {

using Eigen::Vector3d;

// m, of rounding, in what lies `depth` away from the goal: three planes a hundredth of a radian apart lose ten digits.
static double roundingOf(const Vector3d& goal, double depth) {
  return 1e-6 * depth + 1e-14 * goal.lpNorm<Eigen::Infinity>();
}

// Point of the intersection of the chosen planes that is nearest to the goal: goal + N^T p with N N^T p = b - N goal.
static bool nearestOnPlanes(const Vector3d& goal, std::span<const HalfSpace> halfSpaces, std::span<const int> chosen,
                            Vector3d& result, std::array<double, 3>& pressure) {
  const int count = static_cast<int>(chosen.size());
  Eigen::Matrix3d gram = Eigen::Matrix3d::Identity();
  Vector3d depth = Vector3d::Zero();
  for (int i = 0; i < count; ++i) {
    const HalfSpace& h = halfSpaces[chosen[i]];
    depth[i] = h.offset - h.normal.dot(goal);
    for (int j = 0; j < i; ++j) gram(i, j) = gram(j, i) = h.normal.dot(halfSpaces[chosen[j]].normal);
  }
  const double determinant = gram.determinant();
  if (std::abs(determinant) < 1e-12) return false;  // parallel planes: fewer of them do
  const Vector3d p = gram.inverse() * depth;
  result = goal;
  pressure = {};
  for (int i = 0; i < count; ++i) {
    if (p[i] < -roundingOf(goal, depth.norm())) return false;
    pressure[chosen[i]] = std::max(0.0, p[i]);
    result += p[i] * halfSpaces[chosen[i]].normal;
  }
  return true;
}

bool nearestInHalfSpaces(const Vector3d& goal, std::span<const HalfSpace> halfSpaces, Vector3d& result,
                         std::array<double, 3>& pressure) {
  static constexpr int subsets[8][4] = {{0}, {1, 0}, {1, 1}, {1, 2}, {2, 0, 1}, {2, 0, 2}, {2, 1, 2}, {3, 0, 1, 2}};
  const int count = static_cast<int>(halfSpaces.size());
  double best = std::numeric_limits<double>::infinity();
  for (const auto& subset : subsets) {
    const std::span<const int> chosen(subset + 1, subset[0]);
    if (std::any_of(chosen.begin(), chosen.end(), [&](int k) { return k >= count; })) continue;
    Vector3d x;
    std::array<double, 3> p;
    if (!nearestOnPlanes(goal, halfSpaces, chosen, x, p)) continue;
    const double rounding = roundingOf(goal, (x - goal).norm());
    const bool allowed = std::all_of(halfSpaces.begin(), halfSpaces.end(),
                                     [&](const HalfSpace& h) { return h.normal.dot(x) >= h.offset - rounding; });
    if (!allowed || (x - goal).squaredNorm() >= best) continue;
    best = (x - goal).squaredNorm();
    result = x;
    pressure = p;
  }
  return best < std::numeric_limits<double>::infinity();
}

}  // namespace medulla
