#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "physics/model/medial_balls.h"

namespace medulla {

// What a choice of balls is measured by, m.
struct CoverTargets {
  std::vector<Eigen::Vector3d> surface;  // points of the surface, spread over its area
  std::vector<Eigen::Vector3d> volume;   // points inside, spread over the volume
  double diagonal = 0;                   // of the bounding box
  double overshoot = 0;                  // that balls stick out of the surface; the candidates do so already
};

// Gap: the largest gap from the surface to the nearest ball alone. Gap and volume: as much volume inside the balls as
// can be had for little of that gap. By the gap alone balls crowd at tips and leave the middle of a bulky body open; by
// the volume alone fins and ducts stay bare.
enum class CoverGoal { gap, gapAndVolume };

// Chooses `count` of the candidate balls, then lets them leave the candidates: greedy set cover under a bisected
// tolerance, filling up to `count`, swaps with any better candidate, small random moves. The balls stay inscribed but
// for the overshoot.
// Cost: mean over the surface of (gap / scale)^6 and, for both goals, the open share of the volume; the scale is the
// largest gap that the gap alone has led to. A hundredth of the surface at 1.3 times that gap then weighs as much as 5
// % of the volume. Less weight for the volume leaves bulky bodies bare, more gives up fins and ducts. What the gap
// alone has led to is kept where the largest gap grew, in shares of it, by more than twice the share of the volume that
// was won. 1 <= count <= candidates. `progress` is called with 0..1. The same input gives the same bytes.
std::vector<Ball> coverWithBalls(
    const SurfaceTree& tree, const std::vector<Ball>& candidates, const CoverTargets& targets, int count,
    CoverGoal goal, const std::function<void(double)>& progress = [](double) {});

}  // namespace medulla
