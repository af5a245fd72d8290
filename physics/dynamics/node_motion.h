#pragma once

#include <Eigen/Core>
#include <array>

#include "physics/dynamics/world_data.h"

// One massless node: its velocity as a linear map of its host's, and the transpose. For the few nodes that carry loads;
// whole surfaces go by surface_map.h.
namespace medulla {

struct SphereMotion {
  Eigen::Vector3d linear, angular;  // m/s, rad/s; of loads N, N m
};

struct LinkPoint {
  int sphere0, sphere1;
  Eigen::Matrix<double, 12, 3> loads;  // what 1 N along x, y or z does: force and torque on sphere 0, then on 1
};

inline bool isSkin(const WorldData& d, int node) {
  return node >= d.nodes.dynamicEnd;
}

// m, world: of a node with mass its own place, of another where its host carries it. `node` is an index in Nodes.
Eigen::Vector3d nodePosition(const WorldData& d, int node);

// At the state of the last evaluateLinks().
LinkPoint linkPoint(const WorldData& d, int link, int node);
Eigen::Vector3d sphereOffset(const WorldData& d, int sphere, int node);  // m, from the sphere's frame to the anchor

Eigen::Vector3d velocityOf(const LinkPoint& p, const SphereMotion& of0, const SphereMotion& of1);
// What a force on the point does to its two spheres.
std::array<SphereMotion, 2> loadsOf(const LinkPoint& p, const Eigen::Vector3d& force);

}  // namespace medulla
