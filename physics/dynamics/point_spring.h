#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "physics/dynamics/world_data.h"

namespace medulla {

// The common form of what tools do: ToolSpring and HeldNode.
struct PointSpring {
  int count, tool;
  std::array<int, 3> nodes;  // indices in Nodes
  std::array<double, 3> weights;
  Eigen::Vector3d anchor, anchorVelocity;  // m, m/s, at the substep's end
  const Eigen::Vector3d* outward;          // null: pulls and pushes
  double stiffness, damping;
};

// The k-th of `loads`, tool springs first; `remaining` is the time (s) from the substep's end to the frame's.
PointSpring pointSpring(const WorldData& d, const Loads& loads, std::size_t k, double remaining);

}  // namespace medulla
