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

// What the measures of a link take from large flexion phi, with b = phi^2 / (1 + bound phi^2): of elongation
// lengthening b, of flexion softening b phi. For a round bar of the section's radius of gyration r over the link's
// length l, free of axial force, of uniform curvature k = phi / l:
// - its section flattens, so that it stores (0.395 - 0.433 nu) (2 k r)^2 less than EI k^2 / 2, and its middle line
//   lengthens by (1 + nu) / 4 (2 k r)^2: solutions of the neo-Hookean section at nu = 0.3, 0.45 and 0.499;
// - a frame is the mean of its cell, which lies off the middle line by k s^2 / 2 with s^2 the cell's second moment
//   along the line over its volume. Along the mean direction that brings two frames nearer by
//   (s0^2 + s1^2) phi^2 / 4 l, of an arc that is as long as before. What is held is a point: s = 0.
// A flat section's r is that of its thin side. `bound` keeps to where these series hold: beyond (2 k r)^2 of a half
// they level off.
struct LinkBending {
  double softening = 0, lengthening = 0, bound = 0;  // 1/rad2, m/rad2, 1/rad2
};
LinkBending linkBending(const IdentifiedNetwork& network, const IdentifiedLink& link);
// Per link, whether it is of a bar, which knows large bending: all where cells lie in a row; else those without which
// the network would fall in two, if what hangs together of them is longer than twice its thickness. Where cells lie
// side by side no link is a bar of its own: with these terms in all of them a liver of 20 bent 2.0 / 0.5 % off instead
// of 1.2 / 0.3.
std::vector<bool> barsAmong(const IdentifiedNetwork& network);

// Nodes of patches hang on the patch alone: they do not move at all.
std::vector<std::vector<SkinFrame>> heldSkin(const SoftBodyModel& model);

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

// From a sphere's frame to that of its cell, m; 0 of what is held.
Eigen::Vector3d armOf(const SoftBodyModel& model, int frame);

// The six measures' rates of link k at rest, one per row: 1 and m on frame 1's velocity less frame 0's and on the
// angular velocities of the two spheres' frames. Row order as identifiedStiffness.
struct RestMeasures {
  Eigen::Matrix<double, 6, 3> line, turn0, turn1;
};
RestMeasures restMeasures(const SoftBodyModel& model, const IdentifiedLink& link);

}  // namespace medulla
