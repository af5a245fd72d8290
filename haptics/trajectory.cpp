#include <algorithm>
#include <cassert>
#include <cmath>

#include "haptics/tool_input.h"

namespace medulla {

using Eigen::Quaterniond, Eigen::Vector3d;

// Tangent at a key between the secants to its two neighbours: the parabola through the three keys (the non-uniform
// Catmull-Rom tangent), limited as Fritsch and Carlson 1980 show to be enough for a monotone cubic: zero where the
// secants differ in sign or one vanishes, at most three times the flatter one. A device that rests between two equal
// keys therefore rests exactly.
static double limitedTangent(double before, double durationBefore, double after, double durationAfter) {
  if (before * after <= 0) return 0;
  const double parabola = (before * durationAfter + after * durationBefore) / (durationBefore + durationAfter);
  const double limit = 3 * std::min(std::abs(before), std::abs(after));
  return std::clamp(parabola, -limit, limit);
}

// Zero at both ends, because the device stands still outside of its recording. difference(a, b): what leads from one
// key to the next.
template <class Difference>
static Vector3d tangentAt(const std::vector<ToolSample>& keys, std::size_t k, const Difference& difference) {
  if (k == 0 || k + 1 == keys.size()) return Vector3d::Zero();
  const double before = keys[k].time - keys[k - 1].time, after = keys[k + 1].time - keys[k].time;
  const Vector3d secantBefore = difference(keys[k - 1], keys[k]) / before;
  const Vector3d secantAfter = difference(keys[k], keys[k + 1]) / after;
  Vector3d tangent;
  for (int axis = 0; axis < 3; ++axis)
    tangent[axis] = limitedTangent(secantBefore[axis], before, secantAfter[axis], after);
  return tangent;
}

static Vector3d shift(const ToolSample& a, const ToolSample& b) {
  return b.position - a.position;
}

static Vector3d positionBetween(const std::vector<ToolSample>& keys, std::size_t k, double s) {
  const double duration = keys[k + 1].time - keys[k].time, s2 = s * s, s3 = s2 * s;
  const Vector3d &p0 = keys[k].position, &p1 = keys[k + 1].position;
  const Vector3d m0 = tangentAt(keys, k, shift), m1 = tangentAt(keys, k + 1, shift);
  // p0 + h (p1 - p0) rather than two weights that sum to one only up to rounding: equal keys give exactly that key.
  return p0 + (3 * s2 - 2 * s3) * (p1 - p0) + duration * ((s3 - 2 * s2 + s) * m0 + (s3 - s2) * m1);
}

// The short way, rad along its axis: the same in the frames of both keys.
static Vector3d rotationVector(const Quaterniond& q) {
  const double sine = q.vec().norm(), sign = q.w() < 0 ? -1 : 1;
  if (sine < 1e-12) return 2 * sign * q.vec();
  return sign * 2 * std::atan2(sine, std::abs(q.w())) / sine * q.vec();
}

static Quaterniond rotationBy(const Vector3d& vector) {
  const double half = 0.5 * vector.norm();
  const double ratio = half < 1e-12 ? 0.5 : 0.5 * std::sin(half) / half;
  Quaterniond q;
  q.w() = std::cos(half);
  q.vec() = ratio * vector;
  return q;
}

static Vector3d turn(const ToolSample& a, const ToolSample& b) {
  return rotationVector(a.worldFromTool.conjugate() * b.worldFromTool);
}

// The cubic of the positions, on unit quaternions: the Bezier curve in cumulative form (Kim, Kim and Shin 1995, "A
// general construction scheme for unit quaternion curves with simple high order derivatives"). Its ends have the
// angular velocities of the keys, as tangents in the tool's own frame; about one axis it is the very cubic. Slerp would
// turn with a step of angular velocity at every key, which a held tissue feels.
static Quaterniond orientationBetween(const std::vector<ToolSample>& keys, std::size_t k, double s) {
  const Quaterniond &q0 = keys[k].worldFromTool, &q1 = keys[k + 1].worldFromTool;
  if (q0.coeffs() == q1.coeffs()) return q0;
  const double third = (keys[k + 1].time - keys[k].time) / 3, r = 1 - s;
  const Vector3d first = third * tangentAt(keys, k, turn), last = third * tangentAt(keys, k + 1, turn);
  const Vector3d middle =
      rotationVector(rotationBy(first).conjugate() * (q0.conjugate() * q1) * rotationBy(last).conjugate());
  return (q0 * rotationBy((1 - r * r * r) * first) * rotationBy(s * s * (3 - 2 * s) * middle) *
          rotationBy(s * s * s * last))
      .normalized();
}

// The last key at or before a time; asserts that there is one.
static std::size_t keyBefore(const std::vector<ToolSample>& keys, double time) {
  assert(!keys.empty() && keys.front().time <= time);
  const auto next = std::upper_bound(keys.begin(), keys.end(), time,
                                     [](double t, const ToolSample& sample) { return t < sample.time; });
  return static_cast<std::size_t>(next - keys.begin()) - 1;
}

ToolSample sampleTrajectory(const Trajectory& trajectory, double time) {
  const std::vector<ToolSample>& keys = trajectory.samples;
  assert(!keys.empty() && std::isfinite(time));
  const std::size_t k = time <= keys.front().time ? 0 : keyBefore(keys, time);
  ToolSample out = keys[k];
  // At a key the key itself: what was recorded tick by tick is replayed to the bit.
  if (k + 1 < keys.size() && time > out.time) {
    const double s = (time - out.time) / (keys[k + 1].time - out.time);
    out.position = positionBetween(keys, k, s);
    out.worldFromTool = orientationBetween(keys, k, s);
    out.grip += s * (keys[k + 1].grip - out.grip);
  }
  out.time = time;
  return out;
}

std::optional<Vector3d> measuredForceAt(const Trajectory& trajectory, double time) {
  const std::vector<ToolSample>& keys = trajectory.samples;
  if (trajectory.measuredForces.empty() || time < keys.front().time || time > keys.back().time) return std::nullopt;
  const std::size_t k = keyBefore(keys, time);
  const Vector3d& before = trajectory.measuredForces[k];
  if (time == keys[k].time) return before;
  const double s = (time - keys[k].time) / (keys[k + 1].time - keys[k].time);
  return before + s * (trajectory.measuredForces[k + 1] - before);
}

double motionEnd(const Trajectory& trajectory) {
  const std::vector<ToolSample>& keys = trajectory.samples;
  const ToolSample& last = keys.back();
  std::size_t k = keys.size() - 1;
  while (k > 0 && keys[k - 1].position == last.position && keys[k - 1].grip == last.grip &&
         keys[k - 1].worldFromTool.coeffs() == last.worldFromTool.coeffs())
    --k;
  return keys[k].time;
}

}  // namespace medulla
