#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>

// A smooth way through keys: structs with a strictly increasing `time`. Without a step of velocity, without overshoot
// on any axis, at rest at both ends.
namespace medulla {

// Tangent at a key between the secants to its two neighbours: the parabola through the three keys (the non-uniform
// Catmull-Rom tangent), limited as Fritsch and Carlson 1980 show to be enough for a monotone cubic: zero where the
// secants differ in sign or one vanishes, at most three times the flatter one. What rests between two equal keys
// therefore rests exactly.
inline double limitedTangent(double before, double durationBefore, double after, double durationAfter) {
  if (before * after <= 0) return 0;
  const double parabola = (before * durationAfter + after * durationBefore) / (durationBefore + durationAfter);
  const double limit = 3 * std::min(std::abs(before), std::abs(after));
  return std::clamp(parabola, -limit, limit);
}

// difference(a, b): what leads from one key to the next.
template <class Keys, class Difference>
Eigen::Vector3d tangentAt(const Keys& keys, std::size_t k, const Difference& difference) {
  if (k == 0 || k + 1 == keys.size()) return Eigen::Vector3d::Zero();
  const double before = keys[k].time - keys[k - 1].time, after = keys[k + 1].time - keys[k].time;
  const Eigen::Vector3d secantBefore = difference(keys[k - 1], keys[k]) / before;
  const Eigen::Vector3d secantAfter = difference(keys[k], keys[k + 1]) / after;
  Eigen::Vector3d tangent;
  for (int axis = 0; axis < 3; ++axis)
    tangent[axis] = limitedTangent(secantBefore[axis], before, secantAfter[axis], after);
  return tangent;
}

// value(key) at share s of the time from key k to the next.
template <class Keys, class Value>
Eigen::Vector3d cubicThrough(const Keys& keys, std::size_t k, double s, const Value& value) {
  const double duration = keys[k + 1].time - keys[k].time, s2 = s * s, s3 = s2 * s;
  const auto difference = [&value](const auto& a, const auto& b) -> Eigen::Vector3d { return value(b) - value(a); };
  const Eigen::Vector3d p0 = value(keys[k]), p1 = value(keys[k + 1]);
  const Eigen::Vector3d m0 = tangentAt(keys, k, difference), m1 = tangentAt(keys, k + 1, difference);
  // p0 + h (p1 - p0) rather than two weights that sum to one only up to rounding: equal keys give exactly that key.
  return p0 + (3 * s2 - 2 * s3) * (p1 - p0) + duration * ((s3 - 2 * s2 + s) * m0 + (s3 - s2) * m1);
}

}  // namespace medulla
