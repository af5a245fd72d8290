#pragma once

#include "physics/dynamics/body_mechanics.h"

// What BodyMechanics takes from a model's identified network; all in the model frame.
namespace medulla {

inline bool isIdentified(const BodyDescription& body) {
  return body.links == LinkModel::identified;
}

// Throws std::runtime_error, without the body's name, where the model has no network, or one that does not fit it, the
// tissue or the fixed nodes.
void checkIdentified(const BodyDescription& body);

// N/m, of the measures (t, lengthScale w), both seen along the model's axes; symmetric. Link factors steer elongation
// (t along), torsion (w along) and flexion (all others).
std::vector<Matrix6d> identifiedStiffness(const BodyDescription& body);
// (N/m)^1/2, of the same measures, steered alike; empty where no cell has a strain.
std::vector<LinkStrains> identifiedStrains(const BodyDescription& body);

// Nodes of patches hang on the patch alone: they do not move at all.
std::vector<std::vector<SkinFrame>> heldSkin(const SoftBodyModel& model);

// On the sphere that it has most of; where it has none, on that whose mass it takes.
std::vector<Attachment> attachmentsToFrames(const SoftBodyModel& model,
                                            const std::vector<std::vector<SkinFrame>>& skin);

// Of the model's own cells, or of those identified: m3, and m5 about the sphere's frame.
struct SphereCell {
  double volume = 0;
  Eigen::Matrix3d secondMoment = Eigen::Matrix3d::Zero();
};
SphereCell sphereCell(const BodyDescription& body, int sphere);

// At rest a node follows the ways and turns (small rotations) of the frames it hangs on, each seen from anywhere: sum
// of onWay way + onTurn turn.
struct SkinRow {
  Eigen::Matrix3d onWay, onTurn;  // 1, m
};
std::vector<SkinRow> skinRows(const SoftBodyModel& model, const std::vector<SkinFrame>& frames, int node);
// m: what the frames' mean turn s adds to second order is s x (s x lever) / 2. Its maps are taken for isotropic there.
Eigen::Vector3d skinLever(const SoftBodyModel& model, const std::vector<SkinFrame>& frames, int node);

// The same of its spheres alone: velocity = sum linear v + angular omega.
struct HostRate {
  int sphere = 0;
  Eigen::Matrix3d linear, angular;  // 1, m
};
std::vector<HostRate> hostRates(const SoftBodyModel& model, const std::vector<SkinFrame>& frames, int node);

// The six measures' rates of link k at rest, one per row: 1 and m on frame 1's velocity less frame 0's and on the
// angular velocities of the two spheres' frames. Row order as identifiedStiffness.
struct RestMeasures {
  Eigen::Matrix<double, 6, 3> line, turn0, turn1;
};
RestMeasures restMeasures(const SoftBodyModel& model, const IdentifiedLink& link);

}  // namespace medulla
