#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/model/ball_cover.h"

namespace medulla {

// `count` candidates whose largest gap is small, where to start from: set cover under the smallest tolerance for which
// they suffice, then filling up. `gaps`: surface points x candidates, % of the diagonal.
std::vector<int> chooseGreedily(const Eigen::ArrayXXf& gaps, int count);

// How many candidates greedy set cover takes until every surface point lies within `gap` (% of the diagonal) of one, or
// as near as the candidates come.
int greedyCount(const std::vector<Ball>& candidates, const CoverTargets& targets, double gap);

// Balls added one after the other, each the candidate that lowers the cost of the gaps most.
class GreedyFilling {
 public:
  GreedyFilling(const std::vector<Ball>& candidates, const CoverTargets& targets);
  void add();
  double largestGap() const;  // m; more than the diagonal before the first ball

 private:
  double diagonal_;
  Eigen::ArrayXXf gaps_;  // surface points x candidates, % of the diagonal
  Eigen::ArrayXf least_;
};

}  // namespace medulla
