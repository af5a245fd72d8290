#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>

#include "app/files/trajectory_file.h"

// Whatever the bytes: either a trajectory that can be sampled, or one std::runtime_error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const medulla::Trajectory trajectory =
        medulla::parseTrajectory({reinterpret_cast<const char*>(data), size}, "fuzz.csv");
    const double first = trajectory.samples.front().time, last = trajectory.samples.back().time;
    for (int k = 0; k <= 8; ++k) {
      const double time = (1 - k / 8.0) * first + k / 8.0 * last;
      const medulla::ToolSample sample = medulla::sampleTrajectory(trajectory, time);
      if (!(sample.grip >= 0 && sample.grip <= 1)) std::abort();
      if (!(sample.position.lpNorm<Eigen::Infinity>() <= medulla::kToolReach * (1 + 1e-9))) std::abort();
      if (!(std::abs(sample.worldFromTool.norm() - 1) < 1e-9)) std::abort();
    }
  } catch (const std::runtime_error&) {
  }
  return 0;
}
