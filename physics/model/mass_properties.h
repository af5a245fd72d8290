#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/model/triangle_mesh.h"

namespace medulla {

// Of a body of unit density.
struct MassProperties {
  double volume = 0;                                       // m3
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();      // m
  Eigen::Matrix3d secondMoment = Eigen::Matrix3d::Zero();  // m5, integral of r r^T about the centroid
};

// Exact for the solid inside a closed mesh: the divergence theorem sums signed tetrahedra from its first vertex
// (Mirtich 1996).
MassProperties massProperties(const TriangleMesh& mesh);

// Parts taken together as one rigid body.
MassProperties combined(const std::vector<MassProperties>& parts);

// Inertia tensor of a second moment, per unit density.
inline Eigen::Matrix3d inertia(const Eigen::Matrix3d& secondMoment) {
  return secondMoment.trace() * Eigen::Matrix3d::Identity() - secondMoment;
}

}  // namespace medulla
