#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/model/soft_body_model.h"
#include "physics/model/surface_queries.h"
#include "physics/model/surface_samples.h"

namespace medulla {

struct Ball {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // m
  double radius = 0;                                 // m
};

std::vector<Ball> ballsOf(const SoftBodyModel& model);

// m, from the surface of the nearest of them; below 0 inside.
double distanceToBalls(const Eigen::Vector3d& p, const std::vector<Ball>& balls);

// The medial ball that touches the surface at p: a ball through p with its centre along `inward` (unit) shrinks until
// nothing of the surface is inside it (Ma, Bae and Choi 2012), with the exact closest point in place of their point
// cloud. Inscribed wherever its centre is inside.
Ball shrinkBall(const SurfaceTree& tree, const Eigen::Vector3d& p, const Eigen::Vector3d& inward, double startRadius);

// One inscribed medial ball per sample, without those smaller than 0.4 % of the diagonal (m): they sit in the convex
// edges between triangles and say nothing of the shape.
std::vector<Ball> medialBalls(const SurfaceTree& tree, const std::vector<SurfaceSample>& samples, double diagonal);

}  // namespace medulla
