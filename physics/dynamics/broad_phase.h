#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "physics/dynamics/simd.h"

// Which boxes overlap, in time proportional to their number: a uniform grid, hashed where it would be mostly
// empty.
namespace medulla {

struct AxisBox {
  Quad low, high;  // m; the fourth numbers are 0
};

struct BoxPair {
  std::uint32_t first, second;  // first < second
};

// Buffers, kept so that nothing is allocated once warm.
struct BroadPhase {
  using Cell = std::array<std::int32_t, 3>;
  struct CellRange {  // of a box
    Cell low, high;
  };
  struct Entry {
    std::uint32_t box, firstOf;  // firstOf: bit a where the cell is the lowest of the box's along axis a
    Cell cell;
  };
  std::vector<CellRange> ranges;     // per box
  std::vector<Entry> entries;        // by bucket
  std::vector<std::uint32_t> begin;  // of each bucket in `entries`, and the end of the last
  std::vector<BoxPair> pairs;        // result: sorted by first, then second
};

// Leaves every pair of overlapping boxes in `phase.pairs`; none at all where a box reaches beyond 1e4 m or is not a
// number: such a state is reported at the end of its frame.
void findOverlaps(const std::vector<AxisBox>& boxes, BroadPhase& phase);

}  // namespace medulla
