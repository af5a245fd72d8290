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
      if (!(b.low.v[a] > -kFarthest && b.high.v[a] < kFarthest)) return 0;
      longest = std::max(longest, b.high.v[a] - b.low.v[a]);
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

  Cell cellOf(const Quad& p) const {
    Cell c;
    for (int a = 0; a < 3; ++a) c[a] = static_cast<std::int32_t>(std::floor(p.v[a] * inverse));
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

std::uint32_t firstOf(const CellRange& r, const Cell& c) {
  std::uint32_t bits = 0;
  for (int a = 0; a < 3; ++a) bits |= static_cast<std::uint32_t>(c[a] == r.low[a]) << a;
  return bits;
}

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
  phase.begin.resize(buckets + 1);  // grows ahead of need, which assign() does not
  std::fill(phase.begin.begin(), phase.begin.end(), 0);
  phase.entries.resize(count);
  for (const CellRange& r : phase.ranges) forEachCell(r, [&](const Cell& c) { ++phase.begin[grid.bucketOf(c)]; });
  std::uint32_t end = 0;
  for (std::uint32_t& b : phase.begin) b = end += b;
  for (std::size_t i = boxes.size(); i-- > 0;) {
    forEachCell(phase.ranges[i], [&](const Cell& c) {
      phase.entries[--phase.begin[grid.bucketOf(c)]] = {static_cast<std::uint32_t>(i), firstOf(phase.ranges[i], c), c};
    });
  }
  return grid;
}

bool overlap(const AxisBox& a, const AxisBox& b) {
  return !any(_mm256_or_pd(isLess(load(a.high), load(b.low)), isLess(load(b.high), load(a.low))));
}

// Adds box i with those after it in a cell of its own. A pair that meets in several cells is taken where the lower
// corner of what both share lies: along each axis in the lowest cell of one of them, as rounding down keeps order.
// Which of this, the axes or a hash parts two boxes is anybody's guess: every pair is written, and stays if it counts.
// (With a branch for each the abdomen spent half as long again here.)
void addPairsOfCell(const std::vector<AxisBox>& boxes, const Grid& grid, std::uint32_t i, const Cell& c,
                    BroadPhase& phase, std::size_t& count) {
  constexpr std::uint32_t kAllAxes = 7;
  const std::uint32_t bucket = grid.bucketOf(c), first = firstOf(phase.ranges[i], c), begin = phase.begin[bucket];
  const bool dense = grid.mask == 0;
  std::uint32_t k = phase.begin[bucket + 1];
  if (phase.pairs.size() < count + (k - begin)) phase.pairs.resize(2 * (count + (k - begin)));
  for (; k-- > begin && phase.entries[k].box > i;) {  // ascending: the rest is below i too
    const BroadPhase::Entry& e = phase.entries[k];
    const auto lowest = static_cast<std::size_t>((first | e.firstOf) == kAllAxes),
               inCell = static_cast<std::size_t>(dense || same(e.cell, c)),
               together = static_cast<std::size_t>(overlap(boxes[i], boxes[e.box]));
    phase.pairs[count] = {i, e.box};
    count += lowest & inCell & together;
  }
}

}  // namespace

void findOverlaps(const std::vector<AxisBox>& boxes, BroadPhase& phase) {
  std::size_t count = 0;
  const double size = cellSize(boxes);
  if (size > 0) {
    const Grid grid = fillGrid(boxes, size, phase);
    phase.pairs.resize(phase.pairs.capacity());
    for (std::uint32_t i = 0; i < boxes.size(); ++i) {
      const std::size_t first = count;
      forEachCell(phase.ranges[i], [&](const Cell& c) { addPairsOfCell(boxes, grid, i, c, phase, count); });
      std::sort(phase.pairs.begin() + static_cast<std::ptrdiff_t>(first),
                phase.pairs.begin() + static_cast<std::ptrdiff_t>(count),
                [](const BoxPair& a, const BoxPair& b) { return a.second < b.second; });
    }
  }
  phase.pairs.resize(count);
}

}  // namespace medulla
