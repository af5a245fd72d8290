#pragma once

#include <cstdint>
#include <vector>

#include "physics/model/identified_network.h"
#include "physics/model/identify/voxel_solid.h"

namespace medulla {

// What is known of the surface's nodes for loads and layer.
struct NodeSurface {
  std::vector<double> areas;             // m2, a third of the triangles around
  std::vector<Eigen::Vector3d> normals;  // unit, outward
  std::vector<bool> held;
};
NodeSurface measureNodes(const TriangleMesh& mesh, const std::vector<FixedPatch>& patches);

enum class LoadKind {
  bulk,  // one direction in space, on a patch of a quarter to half of the body's size
  poke,  // into the surface, on a patch of a third to once the length scale; a triangle at least
};

// Even tractions of 1 Pa on random patches of the surface, clear of what is held where that can be: 3 triangles x
// count.
RowMatrix randomTractions(const TriangleMesh& mesh, const NodeSurface& surface, LoadKind kind, double lengthScale,
                          int count, std::uint64_t seed);

// The forces on the mesh's nodes that do the same work on them: 3 nodes x loads, N.
RowMatrix nodalForces(const TriangleMesh& mesh, const RowMatrix& tractions);

// Of columns of nodal displacements (3 nodes x loads): the worst load's largest error, and the mean square over all,
// both relative to the load's largest expected displacement.
IdentifiedError errorOf(const Eigen::MatrixXd& found, const Eigen::MatrixXd& expected);

}  // namespace medulla
