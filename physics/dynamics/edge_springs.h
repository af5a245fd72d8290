#pragma once

#include "physics/dynamics/world_data.h"

namespace medulla {

// N: what the edges' springs pull at the four nodes of group g with, where `displaced` (m), a quad per node, is where
// nodes are against their anchors, and `own` the same of these four. The sum over a node's springs of k (other - own)
// is that of k other, less its own displacement times all k: a subtraction less for each.
MEDULLA_INLINE Lanes3 pullOfEdges(const Springs& springs, const NodeGroup* groups, const Quad* displaced,
                                  const Lanes3& own, int g) {
  const char* bytes = reinterpret_cast<const char*>(displaced);
  const auto at = [bytes](std::uint32_t offset) { return load(*reinterpret_cast<const Quad*>(bytes + offset)); };
  Lanes a = splat(0), b = a, c = a, d = a;
  // Of 16 instructions per group of springs three are the loop's own.
#pragma GCC unroll 2
  for (int e = springs.first[g]; e < springs.first[g + 1]; ++e) {
    const SpringGroup& s = springs.groups[e];
    const Lanes stiffness = _mm256_cvtps_pd(_mm_load_ps(s.stiffness));
    a = fma(splatLane<0>(stiffness), at(s.other[0]), a);
    b = fma(splatLane<1>(stiffness), at(s.other[1]), b);
    c = fma(splatLane<2>(stiffness), at(s.other[2]), c);
    d = fma(splatLane<3>(stiffness), at(s.other[3]), d);
  }
  transpose(a, b, c, d);
  return fnma(groups[g].edges, own, {a, b, c});
}

// Pull of edges within a substep, at the nodes of one range: by the springs of the first like body.
class EdgePull {
 public:
  EdgePull(const WorldData& d, const HostRange& range)
      : springs_(d.springs), groups_(d.nodes.groups.data()), toConstants_(range.toConstants) {
    // The springs number the nodes of that body. As an integer: it may lie before the memory's beginning.
    displaced_ = reinterpret_cast<std::uintptr_t>(d.nodes.displaced.data()) - 4 * sizeof(Quad) * toConstants_;
  }
  MEDULLA_INLINE Lanes3 at(int g, const Lanes3& own) const {
    const auto* displaced = reinterpret_cast<const Quad*>(displaced_);  // NOLINT(performance-no-int-to-ptr)
    return pullOfEdges(springs_, groups_, displaced, own, g + toConstants_);
  }

 private:
  const Springs& springs_;
  const NodeGroup* groups_;
  std::ptrdiff_t toConstants_;
  std::uintptr_t displaced_;
};

}  // namespace medulla
