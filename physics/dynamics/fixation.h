#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "physics/model/soft_body_model.h"

namespace medulla {

// A part of space in the model frame, m: inside a box or a ball.
struct FixRegion {
  enum class Shape { box, ball } shape = Shape::box;
  Eigen::AlignedBox3d box;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 0;
};

// Surface nodes that lie in the region at rest, ascending.
std::vector<int> nodesInRegion(const SoftBodyModel& model, const FixRegion& region);

// Spheres that fixed nodes hold: those on which at least half of the surface that hangs on them is fixed. Others follow
// through the attachments of their nodes.
std::vector<int> spheresHeldBy(const SoftBodyModel& model, const std::vector<int>& fixedNodes);

}  // namespace medulla
