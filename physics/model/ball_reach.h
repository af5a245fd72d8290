#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "physics/model/ball_cover.h"

// What balls reach of the points that a choice is measured by: shared by the stages of that choice.
namespace medulla {

using Gaps = Eigen::ArrayXf;              // per surface point, in % of the diagonal, 0 inside the ball
using GapTable = Eigen::ArrayXXf;         // surface points x balls
using Bits = std::vector<std::uint64_t>;  // one per point

constexpr Eigen::Index kBlockSize = 64;  // surface points that lie together and are judged together

// The points in single precision, in % of the diagonal; those of the surface in blocks that lie together.
struct ScaledTargets {
  Eigen::Matrix3Xf surface, volume;
  double diagonal = 0, overshoot = 0;  // m
};
ScaledTargets scaled(const CoverTargets& targets);

inline Eigen::Vector3f scaledCentre(const Ball& ball, double diagonal) {
  return (100 / diagonal * ball.centre).cast<float>();
}
inline float scaledRadius(const Ball& ball, double diagonal) {
  return static_cast<float>(100 / diagonal * ball.radius);
}

Gaps gapsTo(const ScaledTargets& targets, const Ball& ball);
GapTable gapTable(const ScaledTargets& targets, const std::vector<Ball>& balls);
Bits insideOf(const ScaledTargets& targets, const Ball& ball);  // volume points inside the ball

// Balls of a choice, or all candidates, with what each reaches.
struct Reach {
  std::vector<Ball> balls;
  GapTable gaps;
  std::vector<Bits> inside;
};
Reach reachOf(const ScaledTargets& targets, const std::vector<Ball>& balls);

// Sum of gap^6 over so many points: the largest gap to within a few per cent, which still tells which way is down where
// many points share it.
template <typename Array>
float gapCost(const Array& gaps, Eigen::Index points) {
  return gaps.cube().square().sum() / static_cast<float>(points);
}

}  // namespace medulla
