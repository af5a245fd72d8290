#include <algorithm>
#include <cassert>
#include <cmath>

#include "haptics/tool_input.h"

namespace medulla {

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

// Zero at both ends, because the device stands still outside of its recording.
static Eigen::Vector3d tangentAt(const std::vector<ToolSample>& keys, std::size_t k) {
  if (k == 0 || k + 1 == keys.size()) return Eigen::Vector3d::Zero();
  const double before = keys[k].time - keys[k - 1].time, after = keys[k + 1].time - keys[k].time;
  const Eigen::Vector3d secantBefore = (keys[k].position - keys[k - 1].position) / before;
  const Eigen::Vector3d secantAfter = (keys[k + 1].position - keys[k].position) / after;
  Eigen::Vector3d tangent;
  for (int axis = 0; axis < 3; ++axis)
    tangent[axis] = limitedTangent(secantBefore[axis], before, secantAfter[axis], after);
  return tangent;
}

static Eigen::Vector3d hermite(const Eigen::Vector3d& p0, const Eigen::Vector3d& m0, const Eigen::Vector3d& p1,
                               const Eigen::Vector3d& m1, double duration, double s) {
  const double s2 = s * s, s3 = s2 * s;
  // p0 + h (p1 - p0) rather than two weights that sum to one only up to rounding: equal keys give exactly that key.
  return p0 + (3 * s2 - 2 * s3) * (p1 - p0) + duration * ((s3 - 2 * s2 + s) * m0 + (s3 - s2) * m1);
}

ToolSample sampleTrajectory(const Trajectory& trajectory, double time) {
  const std::vector<ToolSample>& keys = trajectory.samples;
  assert(!keys.empty() && std::isfinite(time));
  const auto next = std::upper_bound(keys.begin(), keys.end(), time,
                                     [](double t, const ToolSample& sample) { return t < sample.time; });
  ToolSample out;
  if (next == keys.begin()) {
    out = keys.front();
  } else if (next == keys.end()) {
    out = keys.back();
  } else {
    const ToolSample &from = *(next - 1), &to = *next;
    const std::size_t k = std::size_t(next - keys.begin()) - 1;
    const double duration = to.time - from.time, s = (time - from.time) / duration;
    out.position = hermite(from.position, tangentAt(keys, k), to.position, tangentAt(keys, k + 1), duration, s);
    out.worldFromTool = from.worldFromTool.slerp(s, to.worldFromTool).normalized();
    out.grip = from.grip + s * (to.grip - from.grip);
  }
  out.time = time;
  return out;
}

}  // namespace medulla
