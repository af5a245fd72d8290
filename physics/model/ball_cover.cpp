#include "physics/model/ball_cover.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstdint>
#include <limits>

#include "physics/model/ball_reach.h"
#include "physics/model/greedy_cover.h"

namespace medulla {

using Eigen::Index;

namespace {

// cost = open share of the volume * volumeWeight + mean (gap / scale)^6
struct Weights {
  float scale = 1;  // % of the diagonal
  float volumeWeight = 0;
};

// Least gap of every block: blocks x balls.
GapTable leastOfBlocks(const GapTable& gaps) {
  GapTable least((gaps.rows() + kBlockSize - 1) / kBlockSize, gaps.cols());
  for (Index b = 0; b < gaps.cols(); ++b) {
    for (Index k = 0; k < least.rows(); ++k) {
      const Index first = k * kBlockSize;
      least(k, b) = gaps.col(b).segment(first, std::min(kBlockSize, gaps.rows() - first)).minCoeff();
    }
  }
  return least;
}

// What all balls except the current one cover, in a pass that moves each ball in turn. Least gaps of later balls are
// suffix minima from the start of the pass, those of earlier balls accumulate as it goes on; each volume point counts
// the balls that contain it.
struct OtherBalls {
  GapTable behind;
  Gaps before;
  std::vector<int> ballsAround;

  OtherBalls(const Reach& chosen, Index volumePoints)
      : behind(chosen.gaps.rows(), chosen.gaps.cols()),
        before(Gaps::Constant(chosen.gaps.rows(), std::numeric_limits<float>::max())),
        ballsAround(volumePoints, 0) {
    const Index last = chosen.gaps.cols() - 1;
    behind.col(last).setConstant(std::numeric_limits<float>::max());
    for (Index k = last; k > 0; --k) behind.col(k - 1) = behind.col(k).min(chosen.gaps.col(k));
    for (const Bits& inside : chosen.inside) count(inside, 1);
  }
  void count(const Bits& inside, int by) {
    for (std::size_t w = 0; w < inside.size(); ++w)
      for (std::uint64_t rest = inside[w]; rest != 0; rest &= rest - 1)
        ballsAround[64 * w + std::countr_zero(rest)] += by;
  }
  Gaps gapsWithout(Index k) const { return before.min(behind.col(k)); }
  // Call before ball k changes, and `placed` after it: in between `open` holds.
  void lifted(const Bits& inside) { count(inside, -1); }
  Bits open() const {
    Bits bits((ballsAround.size() + 63) / 64, 0);
    for (std::size_t p = 0; p < ballsAround.size(); ++p)
      bits[p / 64] |= static_cast<std::uint64_t>(ballsAround[p] == 0) << (p % 64);
    return bits;
  }
  void placed(const Gaps& gaps, const Bits& inside) {
    before = before.min(gaps);
    count(inside, 1);
  }
};

// Share of the volume that is `open` and stays so.
float openShare(const Bits& open, const Bits& inside, std::size_t points) {
  int count = 0;
  for (std::size_t w = 0; w < open.size(); ++w) count += std::popcount(open[w] & ~inside[w]);
  return static_cast<float>(count) / static_cast<float>(points);
}

// Cost of the gaps that a further ball leaves where others leave `gaps`. A block of points that it comes no nearer to
// than the others do keeps its cost, which is most of them: the others are gone through from the costliest on until the
// sum is too high.
struct GapCostByBlocks {
  struct Block {
    float cost, widest;  // widest gap
    Index number;
  };
  const Gaps& gaps;
  float scale;
  std::vector<Block> blocks;  // costliest first
  float total = 0;

  GapCostByBlocks(const Gaps& otherGaps, float gapScale) : gaps(otherGaps), scale(gapScale) {
    for (Index first = 0; first < gaps.size(); first += kBlockSize) {
      const auto block = gaps.segment(first, std::min(kBlockSize, gaps.size() - first));
      blocks.push_back({sum(block), block.maxCoeff(), first / kBlockSize});
      total += blocks.back().cost;
    }
    std::stable_sort(blocks.begin(), blocks.end(), [](const Block& a, const Block& b) { return a.cost > b.cost; });
  }
  template <typename Array>
  float sum(const Array& values) const {
    return gapCost(values * (1 / scale), gaps.size());
  }
  // No ball of these least gaps can bring the cost below this.
  template <typename Column>
  float atLeast(const Column& leastGaps) const {
    float cost = total;
    for (const Block& block : blocks) cost -= leastGaps[block.number] < block.widest ? block.cost : 0;
    return cost;
  }
  // From `enough` on the result may be less than the whole cost.
  template <typename Column, typename LeastColumn>
  float with(const Column& ballGaps, const LeastColumn& leastGaps, float enough) const {
    float cost = atLeast(leastGaps);
    for (const Block& block : blocks) {
      if (cost >= enough) break;
      if (leastGaps[block.number] >= block.widest) continue;
      const Index first = block.number * kBlockSize, size = std::min(kBlockSize, gaps.size() - first);
      cost += sum(gaps.segment(first, size).min(ballGaps.segment(first, size)));
    }
    return cost;
  }
};

// One pass: every chosen ball gives way to the candidate that lowers the cost most. Returns whether any did.
bool swapPass(const Reach& candidates, const GapTable& leastGaps, const Weights& weights, Reach& chosen,
              Index volumePoints) {
  bool changed = false;
  OtherBalls others(chosen, volumePoints);
  for (std::size_t k = 0; k < chosen.balls.size(); ++k) {
    const auto column = static_cast<Index>(k);
    const Gaps gaps = others.gapsWithout(column);
    const GapCostByBlocks gapCosts(gaps, weights.scale);
    others.lifted(chosen.inside[k]);
    const Bits open = others.open();
    const auto volumeCost = [&](const Bits& inside) {
      return weights.volumeWeight > 0 ? weights.volumeWeight * openShare(open, inside, others.ballsAround.size()) : 0;
    };
    // A gain below a thousandth is no reason to start another pass.
    float enough = 0.999f * (volumeCost(chosen.inside[k]) + gapCosts.sum(gaps.min(chosen.gaps.col(column))));
    int winner = -1;
    for (Index c = 0; c < candidates.gaps.cols(); ++c) {
      if (gapCosts.atLeast(leastGaps.col(c)) >= enough) continue;
      const float volumePart = volumeCost(candidates.inside[c]);
      const float cost = volumePart + gapCosts.with(candidates.gaps.col(c), leastGaps.col(c), enough - volumePart);
      if (cost >= enough) continue;
      enough = cost;
      winner = static_cast<int>(c);
    }
    if (winner >= 0) {
      chosen.balls[k] = candidates.balls[winner];
      chosen.gaps.col(column) = candidates.gaps.col(winner);
      chosen.inside[k] = candidates.inside[winner];
      changed = true;
    }
    others.placed(chosen.gaps.col(column), chosen.inside[k]);
  }
  return changed;
}

// A ball near `ball`: the largest about a displaced centre, or in turn the medial ball that touches where it does.
bool displacedBall(const SurfaceTree& tree, const Ball& ball, const Eigen::Vector3d& by, bool medial,
                   const ScaledTargets& targets, Ball& out) {
  const Eigen::Vector3d centre = ball.centre + by;
  if (!isInside(tree, centre)) return false;
  const SurfacePoint nearestPoint = closestPoint(tree, centre);
  out = {centre, nearestPoint.distance + targets.overshoot};
  if (!medial || nearestPoint.distance <= 0) return true;
  out = shrinkBall(tree, nearestPoint.point, (centre - nearestPoint.point) / nearestPoint.distance,
                   0.6 * targets.diagonal);
  out.radius += targets.overshoot;
  return isInside(tree, out.centre);
}

// The points that the other balls leave to one ball, and its cost as it moves among them.
struct OpenPoints {
  Eigen::Matrix3Xf surface, volume;
  Gaps gaps;  // of the other balls, > 0

  OpenPoints(const ScaledTargets& targets, const Gaps& otherGaps, const Bits& open, bool useVolume) {
    std::vector<Index> points, inner;
    for (Index s = 0; s < otherGaps.size(); ++s)
      if (otherGaps[s] > 0) points.push_back(s);
    for (Index p = 0; useVolume && p < targets.volume.cols(); ++p)
      if (open[p / 64] >> (p % 64) & 1) inner.push_back(p);
    surface = targets.surface(Eigen::all, points);
    volume = targets.volume(Eigen::all, inner);
    gaps = otherGaps(points);
  }
  float cost(const ScaledTargets& targets, const Ball& ball, const Weights& weights) const {
    const Eigen::Vector3f centre = scaledCentre(ball, targets.diagonal);
    const float radius = scaledRadius(ball, targets.diagonal);
    const auto distance = (surface.colwise() - centre).colwise().norm().transpose().array();
    const float gapPart = gapCost((distance - radius).max(0.f).min(gaps) * (1 / weights.scale), targets.surface.cols());
    if (weights.volumeWeight == 0) return gapPart;
    const auto open = ((volume.colwise() - centre).colwise().squaredNorm().array() > radius * radius).count();
    return gapPart + weights.volumeWeight * static_cast<float>(open) / static_cast<float>(targets.volume.cols());
  }
};

// One pass of trial moves around every ball; the steps shrink from pass to pass and while nothing improves.
void movePass(const SurfaceTree& tree, const ScaledTargets& targets, int pass, int trials, const Weights& weights,
              RandomSequence& random, Reach& chosen) {
  OtherBalls others(chosen, targets.volume.cols());
  for (std::size_t k = 0; k < chosen.balls.size(); ++k) {
    const auto column = static_cast<Index>(k);
    Ball& ball = chosen.balls[k];
    others.lifted(chosen.inside[k]);
    const OpenPoints open(targets, others.gapsWithout(column), others.open(), weights.volumeWeight > 0);
    float best = open.cost(targets, ball, weights);
    double step = 0.4 * ball.radius / (pass + 1);
    for (int trial = 0; trial < trials; ++trial) {
      Ball moved;
      if (!displacedBall(tree, ball, step * random.normal(), trial % 2 == 1, targets, moved)) continue;
      const float cost = open.cost(targets, moved, weights);
      if (cost < best) {
        best = cost;
        ball = moved;
      } else if (trial % 8 == 7) {
        step *= 0.8;
      }
    }
    chosen.gaps.col(column) = gapsTo(targets, ball);
    chosen.inside[k] = insideOf(targets, ball);
    others.placed(chosen.gaps.col(column), chosen.inside[k]);
  }
}

// Few balls are cheap to place and each counts. Large models are dense already: a pass costs much and gains little.
struct Effort {
  int swapPasses, movePasses, trials;
};

Effort effortFor(int count) {
  if (count <= 25) return {8, 6, 120};
  return count <= 100 ? Effort{4, 4, 60} : Effort{1, 2, 30};
}

float gapLeft(const Reach& r) {
  return r.gaps.rowwise().minCoeff().maxCoeff();
}

float openShare(const Reach& r, Index volumePoints) {
  Bits covered(r.inside[0].size(), 0);
  for (const Bits& inside : r.inside)
    for (std::size_t w = 0; w < covered.size(); ++w) covered[w] |= inside[w];
  Index count = 0;
  for (const std::uint64_t word : covered) count += std::popcount(word);
  return 1 - static_cast<float>(count) / static_cast<float>(volumePoints);
}

Reach chosenOf(const Reach& candidates, const std::vector<int>& numbers) {
  Reach chosen{{}, candidates.gaps(Eigen::all, numbers), {}};
  for (const int c : numbers) {
    chosen.balls.push_back(candidates.balls[c]);
    chosen.inside.push_back(candidates.inside[c]);
  }
  return chosen;
}

}  // namespace

std::vector<Ball> coverWithBalls(const SurfaceTree& tree, const std::vector<Ball>& balls, const CoverTargets& points,
                                 int count, CoverGoal goal, const std::function<void(double)>& progress) {
  assert(count >= 1 && count <= static_cast<int>(balls.size()));
  const ScaledTargets targets = scaled(points);
  const Reach candidates = reachOf(targets, balls);
  const GapTable leastGaps = leastOfBlocks(candidates.gaps);
  progress(0.1);

  Reach chosen = chosenOf(candidates, chooseGreedily(candidates.gaps, count));
  progress(0.2);

  const Effort effort = effortFor(count);
  RandomSequence random{7};
  const auto improve = [&](const Weights& weights, double from, double to) {
    const double step = (to - from) / (effort.swapPasses + effort.movePasses);
    for (int pass = 0; pass < effort.swapPasses; ++pass) {
      if (!swapPass(candidates, leastGaps, weights, chosen, targets.volume.cols())) break;
      progress(from + step * (pass + 1));
    }
    for (int pass = 0; pass < effort.movePasses; ++pass) {
      movePass(tree, targets, pass, effort.trials, weights, random, chosen);
      progress(from + step * (effort.swapPasses + pass + 1));
    }
  };
  improve({1, 0}, 0.2, goal == CoverGoal::gap ? 1 : 0.6);
  if (goal == CoverGoal::gap) return chosen.balls;
  const Reach byGap = chosen;
  const float scale = std::max(1e-3f, gapLeft(chosen));
  improve({scale, 1}, 0.6, 1);
  // Kept where the volume gained is worth the gap that it cost: on finned bodies a third more for a tenth, on tubes
  // next to nothing.
  const auto price = [&](const Reach& r) { return gapLeft(r) / scale + 2 * openShare(r, targets.volume.cols()); };
  if (price(byGap) < price(chosen)) return byGap.balls;
  return chosen.balls;
}

}  // namespace medulla
