#include "physics/dynamics/broad_phase.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

namespace medulla {

namespace {

using Cell = BroadPhase::Cell;
using CellRange = BroadPhase::CellRange;
// Comparing arrays calls memcmp.
bool same(const Cell& a, const Cell& b) {
  return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

constexpr double kFarthest = 1e4;  // m
// A box much larger than the mean would fill very many cells: the largest fills at most about this many per axis.
constexpr double kMostCells = 16;

// Edge of a cell: the mean of the boxes' longest edges. Smaller cells hold each box more often, larger ones more pairs.
// 0 where there is nothing to sort, or a box out of bounds.
double cellSize(const std::vector<AxisBox>& boxes) {
  double sum = 0, largest = 0;
  for (const AxisBox& b : boxes) {
    double longest = 0;
    for (int a = 0; a < 3; ++a) {
      if (!(b.low[a] > -kFarthest && b.high[a] < kFarthest)) return 0;
      longest = std::max(longest, b.high[a] - b.low[a]);
    }
    sum += longest;
    largest = std::max(largest, longest);
  }
  return boxes.empty() ? 0 : std::max({sum / static_cast<double>(boxes.size()), largest / kMostCells, 1e-5});
}

struct Grid {
  double inverse;
  std::uint32_t mask = 0;  // of hashes; 0: a bucket for every cell from `first` on, `size` many per axis
  Cell first{}, size{};

  Cell cellOf(const std::array<double, 3>& p) const {
    Cell c;
    for (int a = 0; a < 3; ++a) c[a] = static_cast<std::int32_t>(std::floor(p[a] * inverse));
    return c;
  }
  std::uint32_t bucketOf(const Cell& c) const {
    if (mask == 0)  // boxes that lie together are counted together: no walk through all of memory
      return static_cast<std::uint32_t>(c[0] - first[0] + size[0] * (c[1] - first[1] + size[1] * (c[2] - first[2])));
    // Teschner et al. (2003); the upper bits are folded in, because strides of a power of two repeat the lower ones.
    const std::uint32_t h = (static_cast<std::uint32_t>(c[0]) * 73856093u) ^
                            (static_cast<std::uint32_t>(c[1]) * 19349663u) ^
                            (static_cast<std::uint32_t>(c[2]) * 83492791u);
    return (h ^ (h >> 15)) & mask;
  }
};

template <class Visit>
void forEachCell(const CellRange& r, const Visit& visit) {
  Cell c;
  for (c[0] = r.low[0]; c[0] <= r.high[0]; ++c[0])
    for (c[1] = r.low[1]; c[1] <= r.high[1]; ++c[1])
      for (c[2] = r.low[2]; c[2] <= r.high[2]; ++c[2]) visit(c);
}

// Counting sort of (cell, box) by bucket; within a bucket boxes ascend.
Grid fillGrid(const std::vector<AxisBox>& boxes, double size, BroadPhase& phase) {
  Grid grid{1 / size};
  std::size_t count = 0;
  grid.first = grid.cellOf(boxes[0].low);
  Cell last = grid.first;
  phase.ranges.clear();
  for (const AxisBox& b : boxes) {
    const auto& [low, high] = phase.ranges.emplace_back(CellRange{grid.cellOf(b.low), grid.cellOf(b.high)});
    std::size_t cells = 1;
    for (int a = 0; a < 3; ++a) {
      cells *= high[a] - low[a] + 1;
      grid.first[a] = std::min(grid.first[a], low[a]);
      last[a] = std::max(last[a], high[a]);
    }
    count += cells;
  }
  double cells = 1;
  for (int a = 0; a < 3; ++a) {
    grid.size[a] = last[a] - grid.first[a] + 1;
    cells *= grid.size[a];
  }
  const bool dense = cells <= 4.0 * static_cast<double>(count);
  const std::size_t buckets = dense ? static_cast<std::size_t>(cells) : std::bit_ceil(2 * count);
  if (!dense) grid.mask = static_cast<std::uint32_t>(buckets - 1);
  phase.begin.assign(buckets + 1, 0);
  phase.entries.resize(count);
  for (const CellRange& r : phase.ranges) forEachCell(r, [&](const Cell& c) { ++phase.begin[grid.bucketOf(c)]; });
  std::uint32_t end = 0;
  for (std::uint32_t& b : phase.begin) b = end += b;
  for (std::size_t i = boxes.size(); i-- > 0;) {
    forEachCell(phase.ranges[i], [&](const Cell& c) {
      phase.entries[--phase.begin[grid.bucketOf(c)]] = {static_cast<std::uint32_t>(i), c};
    });
  }
  return grid;
}

// One outcome for all axes: which of them parts two boxes is anybody's guess.
bool overlap(const AxisBox& a, const AxisBox& b) {
  int apart = 0;
  for (int k = 0; k < 3; ++k) apart |= static_cast<int>(a.low[k] > b.high[k]) | static_cast<int>(b.low[k] > a.high[k]);
  return apart == 0;
}

// Whether `c`, a cell of both boxes, is where the lower corner of what they share lies: a pair that meets in several
// cells is taken there. Rounding down keeps order, so that this corner's cell is the later one of the two boxes' own.
bool holdsSharedCorner(const Cell& c, const Cell& low0, const Cell& low1) {
  int holds = 1;
  for (int k = 0; k < 3; ++k) holds &= static_cast<int>(std::max(low0[k], low1[k]) == c[k]);
  return holds == 1;
}

}  // namespace

void findOverlaps(const std::vector<AxisBox>& boxes, BroadPhase& phase) {
  phase.pairs.clear();
  const double size = cellSize(boxes);
  if (size == 0) return;
  const Grid grid = fillGrid(boxes, size, phase);
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    const std::size_t first = phase.pairs.size();
    forEachCell(phase.ranges[i], [&](const Cell& c) {
      const std::uint32_t bucket = grid.bucketOf(c);
      for (std::uint32_t k = phase.begin[bucket + 1]; k-- > phase.begin[bucket];) {
        const BroadPhase::Entry& e = phase.entries[k];
        if (e.box <= i) break;  // ascending: the rest is below i too
        if (same(e.cell, c) && holdsSharedCorner(c, phase.ranges[i].low, phase.ranges[e.box].low) &&
            overlap(boxes[i], boxes[e.box]))
          phase.pairs.push_back({i, e.box});
      }
    });
    std::sort(phase.pairs.begin() + static_cast<std::ptrdiff_t>(first), phase.pairs.end(),
              [](const BoxPair& a, const BoxPair& b) { return a.second < b.second; });
  }
}

}  // namespace medulla
