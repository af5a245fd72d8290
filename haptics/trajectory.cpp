#include <algorithm>
#include <cassert>
#include <cmath>

#include "haptics/monotone_cubic.h"
#include "haptics/tool_input.h"

namespace medulla {

using Eigen::Quaterniond, Eigen::Vector3d;

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
    out.position = cubicThrough(keys, k, s, [](const ToolSample& key) { return key.position; });
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
