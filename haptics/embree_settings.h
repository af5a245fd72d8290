#pragma once

#include <string>

namespace medulla {

// How Embree runs. Neither changes a result.
struct EmbreeSettings {
  std::string isa;  // highest instruction set that it uses: sse2, sse4.2, avx, avx2 or avx512; empty: the processor's
  int threads = 1;  // of its builders; more than one takes cores from the servo and gains nothing at a bucket's size
};

// Whether it is the name of an instruction set that this processor has.
bool isEmbreeIsa(const std::string& isa);

}  // namespace medulla
