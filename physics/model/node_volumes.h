#pragma once

#include <vector>

#include "physics/model/mass_properties.h"
#include "physics/model/soft_body_model.h"

namespace medulla {

// Sets Attachment::volume: the share of the body's volume whose mass every surface node carries (paper 2.3).
//
// A node takes its mass from the sphere it hangs on, or from both ends of its link with 1 - along and along, and moves
// it from the sphere's frame to the surface. The dynamics then has
//   volume_i        - sum_n share_ni v_n
//   secondMoment_i  - sum_n share_ni v_n r_ni r_ni^T      r_ni from restFrame_i to node n
// for sphere i. The total mass cannot change by this; the centre and second moment of the whole change by
//   sum_n v_n d_n      and      sum_n v_n sum_i share_ni (f_i r_ni^T + r_ni f_i^T)
// with d_n the rest offset and f_i the frame, both from the body's centroid. Volumes proportional to area are
// therefore corrected by the least relative change that makes both vanish (nine linear conditions).
// Before, hosts that would lose more than 70 % of their volume or second moment in any direction have their nodes'
// volumes lowered, the rest raised: the sum falls below `fraction` of the body's only where every host is at its limit.
// Volumes stay positive. `fraction` in 0..0.4.
void setNodeVolumes(const std::vector<Eigen::Vector3d>& nodes, const MassProperties& body, double fraction,
                    const std::vector<FillingSphere>& spheres, const std::vector<ElasticLink>& links,
                    std::vector<Attachment>& attachments);

// What remains of every sphere for the dynamics: volume and second moment less the shares above.
std::vector<MassProperties> reducedSpheres(const std::vector<Eigen::Vector3d>& nodes,
                                           const std::vector<FillingSphere>& spheres,
                                           const std::vector<ElasticLink>& links,
                                           const std::vector<Attachment>& attachments);

// Reduced spheres and nodes as one rigid body.
MassProperties totalOf(const std::vector<MassProperties>& reduced, const std::vector<Eigen::Vector3d>& nodes,
                       const std::vector<Attachment>& attachments);

}  // namespace medulla
