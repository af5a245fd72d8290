#include "physics/model/greedy_cover.h"

#include <bit>
#include <queue>

#include "physics/model/ball_reach.h"

namespace medulla {

using Eigen::Index;

namespace {

// Which surface points each candidate covers under a tolerance, one bit each.
struct CoverBits {
  std::size_t words = 0;
  Bits bits;  // words x candidates

  CoverBits(const GapTable& gaps, const Gaps& tolerance)
      : words((gaps.rows() + 63) / 64), bits(words * gaps.cols(), 0) {
    for (Index c = 0; c < gaps.cols(); ++c)
      for (Index s = 0; s < gaps.rows(); ++s)
        bits[c * words + s / 64] |= static_cast<std::uint64_t>(gaps(s, c) <= tolerance[s]) << (s % 64);
  }
  int uncovered(int candidate, const Bits& open) const {
    int count = 0;
    for (std::size_t w = 0; w < words; ++w) count += std::popcount(bits[candidate * words + w] & open[w]);
    return count;
  }
};

// Lazy greedy set cover: a candidate's stale gain is an upper bound, so only the top of the heap is renewed.
// Returns at most `limit` candidates; `covered` says whether they suffice.
std::vector<int> greedyCover(const CoverBits& cover, int samples, int candidates, int limit, bool& covered) {
  Bits open(cover.words, ~std::uint64_t{0});
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

// The candidate that lowers the cost most, the first among equals.
int bestAddition(const GapTable& gaps, const Gaps& least, const std::vector<char>& taken) {
  int best = -1;
  float bestCost = 0;
  for (int c = 0; c < gaps.cols(); ++c) {
    if (taken[c]) continue;
    const float cost = gapCost(least.min(gaps.col(c)), gaps.rows());
    if (best < 0 || cost < bestCost) {
      best = c;
      bestCost = cost;
    }
  }
  return best;
}

void fillUp(const GapTable& gaps, int count, std::vector<int>& chosen) {
  Gaps least = gaps.col(chosen[0]);
  std::vector<char> taken(gaps.cols(), 0);
  for (const int c : chosen) {
    taken[c] = 1;
    least = least.min(gaps.col(c));
  }
  while (static_cast<int>(chosen.size()) < count) {
    const int best = bestAddition(gaps, least, taken);
    taken[best] = 1;
    chosen.push_back(best);
    least = least.min(gaps.col(best));
  }
}

}  // namespace

std::vector<int> chooseGreedily(const GapTable& gaps, int count) {
  std::vector<int> chosen = coverByBisection(gaps, count);
  fillUp(gaps, count, chosen);
  return chosen;
}

GreedyCount::GreedyCount(const std::vector<Ball>& candidates, const CoverTargets& points)
    : gaps_(gapTable(scaled(points), candidates)), reachable_(gaps_.rowwise().minCoeff()) {}

int GreedyCount::operator()(double gap) const {
  const int samples = static_cast<int>(gaps_.rows()), all = static_cast<int>(gaps_.cols());
  bool covered = false;
  const CoverBits bits(gaps_, reachable_.max(static_cast<float>(gap)));
  return static_cast<int>(greedyCover(bits, samples, all, all, covered).size());
}

}  // namespace medulla
