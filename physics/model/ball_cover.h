#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "physics/model/medial_balls.h"

namespace medulla {

// Chooses `count` of the candidate balls so that the largest gap from the sampled surface to the nearest ball is small,
// then lets them leave the candidates: greedy set cover under a bisected tolerance, filling up to `count`, swaps with
// any better candidate, small random moves. Swaps and moves lower sum(gap^4), for up to 12 balls sum(gap^6), which
// narrows the largest gap by some 5 % for half a per cent of the volume. The balls stay inscribed. `diagonal` of the
// bounding box scales the gaps, m.
// 1 <= count <= candidates. `progress`, if given, is called with 0..1. The same input gives the same bytes.
std::vector<Ball> coverWithBalls(const SurfaceTree& tree, const std::vector<Ball>& candidates,
                                 const std::vector<Eigen::Vector3d>& samples, double diagonal, int count,
                                 const std::function<void(double)>& progress = {});

}  // namespace medulla
