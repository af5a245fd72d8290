#pragma once

#include <string>

namespace medulla {

// How Embree runs. Neither changes a result.
struct EmbreeSettings {
  std::string isa;  // highest instruction set that it uses: sse2, sse4.2, avx, avx2 or avx512; empty: the processor's
  int threads = 1;  // of its builders; more than one takes cores from the servo and gains nothing at a bucket's size
};

}  // namespace medulla
