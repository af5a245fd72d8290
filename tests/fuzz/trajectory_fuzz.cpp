#include <cstdint>
#include <stdexcept>

#include "app/files/trajectory_file.h"
#include "tests/fuzz/sampled.h"

// Whatever the bytes: either a trajectory that can be sampled, or one std::runtime_error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    medulla::sampleThroughout(medulla::parseTrajectory({reinterpret_cast<const char*>(data), size}, "fuzz.csv"));
  } catch (const std::runtime_error&) {
  }
  return 0;
}
