#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "physics/dynamics/body_mechanics.h"

// What a body's parts measure at rest per motion of its freedoms: 6 per sphere (velocity, angular velocity), 3 per
// node.
namespace medulla {

using RestRates = Eigen::SparseMatrix<double, Eigen::RowMajor>;

// R, (N/m)^1/2 and (N/m)^1/2 m on turns: the links' stiffness over the spheres' freedoms is R^T R. A row for each
// measure of a link, identified ones along the eigenvectors of their stiffness, and for each identified cell's strain.
RestRates linkRates(const SoftBodyModel& model, const BodyMechanics& mechanics);

// How its spheres carry a node's anchor: velocity = sum linear v + angular omega.
struct HostRate {
  int sphere = 0;
  Eigen::Matrix3d linear, angular;  // 1, m
};
std::vector<HostRate> anchorRates(const BodyDescription& body, const BodyMechanics& mechanics, int node);

// 3 nodes x 6 spheres: of all nodes.
RestRates anchorRates(const BodyDescription& body, const BodyMechanics& mechanics);

// kg and kg m2, square: of the spheres' freedoms; kg, of the nodes', 0 of fixed ones.
RestRates sphereMasses(const BodyMechanics& mechanics);
RestRates nodeMasses(const BodyMechanics& mechanics);

// R likewise, of held nodes: their attachments hold what carries them, and so do the nodes beside them through the
// edges. Such a node gives way, but what lies beyond it does not: taken out of the springs that meet in it (the
// transform of a star into a mesh) it leaves springs from held nodes, k rest / all, and between them, k k' / all.
RestRates heldNodeRates(const BodyDescription& body, const BodyMechanics& mechanics);

// 3 nodes square, N/m: of the nodes' springs to their anchors and of their edges, over displacements from the anchors.
RestRates layerStiffness(const SoftBodyModel& model, const BodyMechanics& mechanics);

// Q, 3 nodes x (links + spheres): the stiffness of the hosts' pressures over the same displacements is Q Q^T.
RestRates pressureRates(const SoftBodyModel& model, const BodyMechanics& mechanics);

}  // namespace medulla
