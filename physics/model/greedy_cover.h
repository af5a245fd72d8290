#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/model/ball_cover.h"

namespace medulla {

// `count` candidates whose largest gap is small, where to start from: set cover under the smallest tolerance for which
// they suffice, then filling up. `gaps`: surface points x candidates, % of the diagonal.
std::vector<int> chooseGreedily(const Eigen::ArrayXXf& gaps, int count);

// How many candidates greedy set cover takes until every surface point lies within a gap of one, or as near as the
// candidates come.
class GreedyCount {
 public:
  GreedyCount(const std::vector<Ball>& candidates, const CoverTargets& targets);
  int operator()(double gap) const;  // % of the diagonal, >= 0

 private:
  Eigen::ArrayXXf gaps_;  // surface points x candidates, % of the diagonal
  Eigen::ArrayXf reachable_;
};

}  // namespace medulla
