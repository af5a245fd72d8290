#pragma once

#include "physics/dynamics/world_data.h"

namespace medulla {

// `sum`: what the edges' springs pull at the four nodes of group g with (N), one vector (x, y, z, 0) each, where
// `displaced` (m), a quad per node, is where nodes are against their anchors.
MEDULLA_INLINE void pullOfEdges(const Springs& springs, const Quad* displaced, int g, Lanes* sum) {
  const char* bytes = reinterpret_cast<const char*>(displaced);
  const Quad* own = displaced + 4 * static_cast<std::ptrdiff_t>(g);
  const auto at = [bytes](std::uint32_t offset) { return load(*reinterpret_cast<const Quad*>(bytes + offset)); };
  for (int k = 0; k < 4; ++k) sum[k] = splat(0);
  for (int e = springs.first[g]; e < springs.first[g + 1]; ++e) {
    const SpringGroup& s = springs.groups[e];
    const Lanes stiffness = _mm256_cvtps_pd(_mm_load_ps(s.stiffness));
    sum[0] = fnma(splatLane<0>(stiffness), load(own[0]) - at(s.other[0]), sum[0]);
    sum[1] = fnma(splatLane<1>(stiffness), load(own[1]) - at(s.other[1]), sum[1]);
    sum[2] = fnma(splatLane<2>(stiffness), load(own[2]) - at(s.other[2]), sum[2]);
    sum[3] = fnma(splatLane<3>(stiffness), load(own[3]) - at(s.other[3]), sum[3]);
  }
}

}  // namespace medulla
