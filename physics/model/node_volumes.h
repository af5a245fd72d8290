#pragma once

#include <vector>

#include "physics/model/mass_properties.h"
#include "physics/model/soft_body_model.h"

namespace medulla {

// Shares out the mass of every power cell between its sphere and the surface nodes (paper 2.3): sets
// Attachment::volume of every node and restFrame, volume and secondMoment of every sphere.
//
// A node takes its mass from the sphere it hangs on, or from both ends of its link with 1 - along and along. What is
// left for the dynamics to give to sphere i is
//   volume_i        - sum_n share_ni v_n
//   secondMoment_i  - sum_n share_ni v_n r_ni r_ni^T      r_ni from restFrame_i to node n
// and restFrame_i is the centroid of exactly that remainder. Spheres and nodes together then have the mass, centre and
// inertia of the cells. With the frame at the whole cell's centroid they would not: the nodes' share moves outward and
// the inertia grows by some per cent. Where anchors lie on links depends on the frames: call in turn with attachNodes
// until both stand still.
//
// Every cell gives `fraction` (0..0.4) of its volume to its nodes, by area: a share of the whole body's mass by area
// would ask more of a thin duct than it has. A sphere gives at most 70 % of its volume, and of its second moment in any
// direction: what remains stays positive definite; the sum falls short of `fraction` there.
void shareOutMass(const std::vector<Eigen::Vector3d>& nodes, const std::vector<MassProperties>& cells, double fraction,
                  const std::vector<ElasticLink>& links, std::vector<Attachment>& attachments,
                  std::vector<FillingSphere>& spheres);

// What remains of every sphere for the dynamics, by the two formulas above.
std::vector<MassProperties> remainingSpheres(const std::vector<Eigen::Vector3d>& nodes,
                                             const std::vector<FillingSphere>& spheres,
                                             const std::vector<ElasticLink>& links,
                                             const std::vector<Attachment>& attachments);

// Remaining spheres and nodes as one rigid body.
MassProperties totalOf(const std::vector<MassProperties>& spheres, const std::vector<Eigen::Vector3d>& nodes,
                       const std::vector<Attachment>& attachments);

}  // namespace medulla
