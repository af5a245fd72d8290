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
Eigen::VectorXd freeAreas(const NodeSurface& surface);  // m2, 0 where held

enum class LoadKind {
  bulk,  // one direction in space, on a patch of a quarter to half of the body's size
  poke,  // into the surface, on a patch of a third to once the length scale
};

// Random tractions of 1 Pa on patches of the surface, as forces (N) on its nodes: 3 nodes x count. Nodes that are held
// get no load. Patches have three nodes at least: where the last place that is tried has fewer, the three free nodes
// nearest to it. Throws std::runtime_error where fewer are free.
RowMatrix randomLoads(const TriangleMesh& mesh, const NodeSurface& surface, LoadKind kind, double lengthScale,
                      int count, std::uint64_t seed);

// Forces at the nodes that have the force, moment and work of tractions (Pa, 3 nodes x loads) linear between the nodes.
RowMatrix consistentForces(const TriangleMesh& mesh, const RowMatrix& tractions);

// Of columns of nodal displacements (3 nodes x loads): the worst load's largest error, and the mean square over all,
// both relative to the load's largest expected displacement; loads that should move nothing do not count. Throws
// std::runtime_error on displacements that are not finite.
IdentifiedError errorOf(const Eigen::MatrixXd& found, const Eigen::MatrixXd& expected);

}  // namespace medulla
