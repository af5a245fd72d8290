#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "physics/model/soft_body_model.h"

namespace medulla {

// A part of space in the model frame, m: inside a box, inside a ball, or on one side of a plane.
struct Region {
  enum class Shape { box, ball, halfSpace } shape = Shape::box;
  Eigen::AlignedBox3d box;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 0;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitX();  // of any length but 0: points x with normal . x <= distance
  double distance = 0;
};

bool contains(const Region& region, const Eigen::Vector3d& x);

// Surface nodes that lie in the region at rest, ascending.
std::vector<int> nodesInRegion(const SoftBodyModel& model, const Region& region);

}  // namespace medulla
