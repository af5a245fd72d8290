#include "physics/model/ball_cover.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstdint>
#include <queue>

namespace medulla {

namespace {

using Gaps = Eigen::ArrayXf;       // per sample, in % of the diagonal, 0 inside the ball
using GapTable = Eigen::ArrayXXf;  // samples x candidates

struct Samples {
  Eigen::Matrix3Xf points;  // % of the diagonal
  double diagonal = 0;
};

Gaps gapsTo(const Samples& samples, const Ball& ball) {
  const double scale = 100 / samples.diagonal;
  const Eigen::Vector3f centre = (scale * ball.centre).cast<float>();
  const auto distance = (samples.points.colwise() - centre).colwise().norm().transpose().array();
  return (distance - static_cast<float>(scale * ball.radius)).max(0.f);
}

// Of few balls the largest gap is what shows, of many the volume that all small gaps together leave uncovered.
enum class Exponent { four, six };

template <typename Array>
float cost(const Array& gaps, Exponent exponent) {
  return exponent == Exponent::six ? gaps.cube().square().sum() : gaps.square().square().sum();
}

// Which samples each candidate covers under a tolerance, one bit each.
struct CoverBits {
  std::size_t words = 0;
  std::vector<std::uint64_t> bits;  // words x candidates

  CoverBits(const GapTable& gaps, const Gaps& tolerance)
      : words((gaps.rows() + 63) / 64), bits(words * gaps.cols(), 0) {
    for (Eigen::Index c = 0; c < gaps.cols(); ++c) {
      for (Eigen::Index s = 0; s < gaps.rows(); ++s) {
        if (gaps(s, c) <= tolerance[s]) bits[c * words + s / 64] |= std::uint64_t{1} << (s % 64);
      }
    }
  }
  int uncovered(int candidate, const std::vector<std::uint64_t>& open) const {
    int count = 0;
    for (std::size_t w = 0; w < words; ++w) count += std::popcount(bits[candidate * words + w] & open[w]);
    return count;
  }
};

// Lazy greedy set cover: a candidate's stale gain is an upper bound, so only the top of the heap is renewed.
// Returns at most `limit` candidates; `covered` says whether they suffice.
std::vector<int> greedyCover(const CoverBits& cover, int samples, int candidates, int limit, bool& covered) {
  std::vector<std::uint64_t> open(cover.words, ~std::uint64_t{0});
  if (samples % 64 != 0) open.back() = (std::uint64_t{1} << (samples % 64)) - 1;
  std::priority_queue<std::pair<int, int>> gains;  // gain, minus candidate: the lower candidate wins a tie
  for (int c = 0; c < candidates; ++c) gains.emplace(cover.uncovered(c, open), -c);
  std::vector<int> chosen;
  int left = samples;
  while (left > 0 && static_cast<int>(chosen.size()) < limit && !gains.empty()) {
    const int c = -gains.top().second;
    gains.pop();
    const int gain = cover.uncovered(c, open);
    if (gain == 0) continue;
    if (!gains.empty() && gain < gains.top().first) {
      gains.emplace(gain, -c);
      continue;
    }
    chosen.push_back(c);
    left -= gain;
    for (std::size_t w = 0; w < cover.words; ++w) open[w] &= ~cover.bits[c * cover.words + w];
  }
  covered = left == 0;
  return chosen;
}

// The smallest tolerance, above what all candidates together reach, under which `count` of them cover every sample.
std::vector<int> coverByBisection(const GapTable& gaps, int count) {
  const int samples = static_cast<int>(gaps.rows()), candidates = static_cast<int>(gaps.cols());
  const Gaps reachable = gaps.rowwise().minCoeff();
  float low = 0, high = 50;  // % of the diagonal
  std::vector<int> best;
  for (int step = 0; step < 14; ++step) {
    const float tolerance = (low + high) / 2;
    bool covered = false;
    std::vector<int> chosen = greedyCover(CoverBits(gaps, reachable + tolerance), samples, candidates, count, covered);
    (covered ? high : low) = tolerance;
    if (covered || best.empty()) best = std::move(chosen);
  }
  return best;
}

Gaps nearest(const GapTable& gaps, const std::vector<int>& chosen) {
  Gaps least = gaps.col(chosen[0]);
  for (const int c : chosen) least = least.min(gaps.col(c));
  return least;
}

void fillUp(const GapTable& gaps, int count, Exponent exponent, std::vector<int>& chosen) {
  Gaps least = nearest(gaps, chosen);
  std::vector<char> taken(gaps.cols(), 0);
  for (const int c : chosen) taken[c] = 1;
  while (static_cast<int>(chosen.size()) < count) {
    int best = -1;
    float bestCost = 0;
    for (int c = 0; c < gaps.cols(); ++c) {
      if (taken[c]) continue;
      const float candidateCost = cost(least.min(gaps.col(c)), exponent);
      if (best < 0 || candidateCost < bestCost) {
        best = c;
        bestCost = candidateCost;
      }
    }
    taken[best] = 1;
    chosen.push_back(best);
    least = least.min(gaps.col(best));
  }
}

// Least gaps of all balls but one.
Gaps leastWithout(const GapTable& ballGaps, Eigen::Index without) {
  Gaps least = Gaps::Constant(ballGaps.rows(), 1e30f);
  for (Eigen::Index k = 0; k < ballGaps.cols(); ++k) {
    if (k != without) least = least.min(ballGaps.col(k));
  }
  return least;
}

// One pass: every chosen candidate gives way to the one that lowers the cost most. Returns whether any did.
bool swapPass(const GapTable& gaps, Exponent exponent, std::vector<int>& chosen, GapTable& ballGaps) {
  bool changed = false;
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const Gaps others = leastWithout(ballGaps, static_cast<Eigen::Index>(k));
    const int before = chosen[k];
    float best = cost(others.min(gaps.col(before)), exponent);
    for (int c = 0; c < gaps.cols(); ++c) {
      const float candidateCost = cost(others.min(gaps.col(c)), exponent);
      if (candidateCost < best * 0.999f) {
        best = candidateCost;
        chosen[k] = c;
      }
    }
    ballGaps.col(static_cast<Eigen::Index>(k)) = gaps.col(chosen[k]);
    changed = changed || chosen[k] != before;
  }
  return changed;
}

// A ball near `ball`: the largest about a displaced centre, or in turn the medial ball that touches where it does.
bool displacedBall(const SurfaceTree& tree, const Ball& ball, const Eigen::Vector3d& by, bool medial, double diagonal,
                   Ball& out) {
  const Eigen::Vector3d centre = ball.centre + by;
  if (!isInside(tree, centre)) return false;
  const SurfacePoint nearestPoint = closestPoint(tree, centre);
  out = {centre, nearestPoint.distance};
  if (!medial || nearestPoint.distance <= 0) return true;
  out = shrinkBall(tree, nearestPoint.point, (centre - nearestPoint.point) / nearestPoint.distance, 0.6 * diagonal);
  return isInside(tree, out.centre);
}

// One pass of trial moves around every ball; the steps shrink from pass to pass and while nothing improves.
void movePass(const SurfaceTree& tree, const Samples& samples, int pass, int trials, Exponent exponent,
              RandomSequence& random, std::vector<Ball>& balls, GapTable& ballGaps) {
  for (std::size_t k = 0; k < balls.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    const Gaps others = leastWithout(ballGaps, column);
    float best = cost(others.min(ballGaps.col(column)), exponent);
    double step = 0.4 * balls[k].radius / (pass + 1);
    for (int trial = 0; trial < trials; ++trial) {
      Ball moved;
      if (!displacedBall(tree, balls[k], step * random.normal(), trial % 2 == 1, samples.diagonal, moved)) continue;
      const Gaps movedGaps = gapsTo(samples, moved);
      const float movedCost = cost(others.min(movedGaps), exponent);
      if (movedCost < best) {
        best = movedCost;
        balls[k] = moved;
        ballGaps.col(column) = movedGaps;
      } else if (trial % 8 == 7) {
        step *= 0.8;
      }
    }
  }
}

}  // namespace

std::vector<Ball> coverWithBalls(const SurfaceTree& tree, const std::vector<Ball>& candidates,
                                 const std::vector<Eigen::Vector3d>& points, double diagonal, int count,
                                 const std::function<void(double)>& progress) {
  assert(count >= 1 && count <= static_cast<int>(candidates.size()));
  const auto report = [&](double done) {
    if (progress) progress(done);
  };
  Samples samples{Eigen::Matrix3Xf(3, points.size()), diagonal};
  for (std::size_t s = 0; s < points.size(); ++s) {
    samples.points.col(static_cast<Eigen::Index>(s)) = (100 / diagonal * points[s]).cast<float>();
  }
  GapTable gaps(points.size(), candidates.size());
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    gaps.col(static_cast<Eigen::Index>(c)) = gapsTo(samples, candidates[c]);
  }
  report(0.1);

  std::vector<int> chosen = coverByBisection(gaps, count);
  const Exponent exponent = count <= 12 ? Exponent::six : Exponent::four;
  fillUp(gaps, count, exponent, chosen);
  report(0.2);

  // Large models are dense already: a pass costs count^2 there and gains little.
  const bool large = count > 100;
  GapTable ballGaps(points.size(), count);
  for (int k = 0; k < count; ++k) ballGaps.col(k) = gaps.col(chosen[k]);
  const int swapPasses = large ? 1 : 4;
  for (int pass = 0; pass < swapPasses; ++pass) {
    if (!swapPass(gaps, exponent, chosen, ballGaps)) break;
    report(0.2 + 0.4 * (pass + 1) / swapPasses);
  }

  std::vector<Ball> balls;
  balls.reserve(chosen.size());
  for (const int c : chosen) balls.push_back(candidates[c]);
  RandomSequence random{7};
  const int movePasses = large ? 2 : 4, trials = large ? 30 : 60;
  for (int pass = 0; pass < movePasses; ++pass) {
    movePass(tree, samples, pass, trials, exponent, random, balls, ballGaps);
    report(0.6 + 0.4 * (pass + 1) / movePasses);
  }
  return balls;
}

}  // namespace medulla
