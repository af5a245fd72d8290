#pragma once

#include <cmath>
#include <cstdlib>

#include "haptics/tool_input.h"

namespace medulla {

// Ends the program where a trajectory that was read cannot be sampled.
inline void sampleThroughout(const Trajectory& t) {
  const double first = t.samples.front().time, last = t.samples.back().time;
  for (int k = 0; k <= 8; ++k) {
    const double time = (1 - k / 8.0) * first + k / 8.0 * last;
    const ToolSample sample = sampleTrajectory(t, time);
    if (!(sample.grip >= 0 && sample.grip <= 1)) std::abort();
    if (!(sample.position.lpNorm<Eigen::Infinity>() <= kToolReach * (1 + 1e-9))) std::abort();
    if (!(std::abs(sample.worldFromTool.norm() - 1) < 1e-9)) std::abort();
    measuredForceAt(t, time);
  }
}

}  // namespace medulla
