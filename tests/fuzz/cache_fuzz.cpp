#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>

#include "app/files/state_cache.h"
#include "tests/fuzz/memory_file.h"

// Whatever the bytes: either a cache whose pictures have the sizes that it says, or one std::runtime_error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const medulla::MemoryFile file(data, size);
  try {
    medulla::CacheReader cache(file.path());
    medulla::PictureState state;
    for (int n = 0; n < std::min(cache.pictures(), 4); ++n) {
      cache.read(n, state);
      if (state.frame.bodies.size() != cache.layout().bodies.size()) std::abort();
      if (state.tools.size() != cache.layout().tools.size()) std::abort();
    }
  } catch (const std::runtime_error&) {
  }
  return 0;
}
