#pragma once

#include "physics/dynamics/world_data.h"

namespace medulla {

// `sum`: what the edges' springs pull at the four nodes of group g with (N), one vector (x, y, z, 0) each, where
// `displaced` (m), a quad per node, is where nodes are against their anchors.
MEDULLA_INLINE void pullOfEdges(const Springs& springs, const Quad* displaced, int g, Lanes* sum) {
  const char* bytes = reinterpret_cast<const char*>(displaced);
  const Quad* own = displaced + 4 * static_cast<std::ptrdiff_t>(g);
  for (int k = 0; k < 4; ++k) sum[k] = splat(0);
  for (int e = springs.first[g]; e < springs.first[g + 1]; ++e) {
    const SpringGroup& s = springs.groups[e];
    for (int k = 0; k < 4; ++k) {
      const Lanes other = load(*reinterpret_cast<const Quad*>(bytes + s.other[k]));
      sum[k] = fma(splat(s.stiffness[k]), other - load(own[k]), sum[k]);
    }
  }
}

}  // namespace medulla
