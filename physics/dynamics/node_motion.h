#pragma once

#include <Eigen/Core>

#include "physics/dynamics/world_data.h"

// The few nodes that carry loads, one by one; whole surfaces go by surface.cpp and surface_map.cpp.
namespace medulla {

inline bool isSkin(const WorldData& d, int node) {
  return node >= d.nodes.dynamicEnd;
}

// m, world: of a node with mass its own place, of another where its host carries it. `node` is an index in Nodes.
Eigen::Vector3d nodePosition(const WorldData& d, int node);

// At the state of the last evaluateLinks().
HostPoint hostPoint(const WorldData& d, int node);

}  // namespace medulla
