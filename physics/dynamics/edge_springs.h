#pragma once

#include "physics/dynamics/world_data.h"

namespace medulla {

// N: what the edges' springs pull at the four nodes of group g with, where `displaced` (m), a quad per node, is where
// nodes are against their anchors, `own` the same of these four and `edges` their NodeGroup::edges. The sum over a
// node's springs of k (other - own) is that of k other, less its own displacement times all k: a subtraction less for
// each.
MEDULLA_INLINE Lanes3 pullOfEdges(const Springs& springs, const Quad* displaced, const Lanes3& own, Lanes edges,
                                  int g) {
  const char* bytes = reinterpret_cast<const char*>(displaced);
  const auto at = [bytes](std::uint32_t offset) { return load(*reinterpret_cast<const Quad*>(bytes + offset)); };
  Lanes a = splat(0), b = a, c = a, d = a;
  for (int e = springs.first[g]; e < springs.first[g + 1]; ++e) {
    const SpringGroup& s = springs.groups[e];
    const Lanes stiffness = _mm256_cvtps_pd(_mm_load_ps(s.stiffness));
    a = fma(splatLane<0>(stiffness), at(s.other[0]), a);
    b = fma(splatLane<1>(stiffness), at(s.other[1]), b);
    c = fma(splatLane<2>(stiffness), at(s.other[2]), c);
    d = fma(splatLane<3>(stiffness), at(s.other[3]), d);
  }
  transpose(a, b, c, d);
  return fnma(edges, own, {a, b, c});
}

}  // namespace medulla
