#pragma once

#include <vector>

#include "physics/model/mass_properties.h"
#include "physics/model/power_cells.h"
#include "physics/model/soft_body_model.h"
#include "physics/model/triangle_mesh.h"

namespace medulla {

// Shares out the mass of every power cell between its sphere and the surface nodes (paper 2.3): sets
// Attachment::volume and massSphere of every node, and restFrame, volume and secondMoment of every sphere.
//
// A node takes its mass from the cell that it lies in, whatever it hangs on. What is left for the dynamics to give to
// sphere i is
//   volume_i        - sum_n v_n
//   secondMoment_i  - sum_n v_n r_n r_n^T      r_n from restFrame_i to node n, over the nodes of that cell
// and restFrame_i is the centroid of exactly that remainder: spheres and nodes together have the mass, centre and
// inertia of the cells. (Rejected: taking the mass from the two spheres of the node's link. Thin cells beside long
// links have too small a second moment to give their nodes any mass.) Where anchors lie on links depends on the frames:
// call in turn with attachNodes until both stand still.
//
// The nodes carry `fraction` (0..0.4) of the body in all, each by the stiffness of its attachment (area over depth), so
// that all swing alike and none alone bounds the step of the dynamics. A cell gives at most half of its volume and 70 %
// of its second moment in any direction: what remains stays positive definite; the sum may fall short of `fraction`.
void shareOutMass(const TriangleMesh& mesh, const PowerCells& cells, double fraction,
                  std::vector<Attachment>& attachments, std::vector<FillingSphere>& spheres);

// The same anew once a network's layer is known, whose nodes are held by its own springs and by their edges as much: on
// thin parts by other ratios than area over depth, and it is the stiffest node over its mass that bounds the step.
// Cells give up to 85 % of their second moment: frames that move for it take no link along, since those of a network
// end at the cells' own frames and restLinkEnd, where beams end, stays.
void shareOutMassByLayer(const IdentifiedLayer& layer, double fraction, SoftBodyModel& model);

// The same body with nothing of its mass at the nodes, for a surface whose nodes have none: each sphere's frame at the
// centroid of its whole cell. Else a cell's mass would be where it is without what lies at the surface: moments of
// inertia of a liver of 24 spheres are 5.5 % less then, its centre .7 mm off.
SoftBodyModel withoutNodeVolumes(const SoftBodyModel& model);

// What remains of every sphere for the dynamics, by the two formulas above.
std::vector<MassProperties> remainingSpheres(const std::vector<Eigen::Vector3d>& nodes,
                                             const std::vector<FillingSphere>& spheres,
                                             const std::vector<Attachment>& attachments);

// Remaining spheres and nodes as one rigid body.
MassProperties totalOf(const std::vector<MassProperties>& spheres, const std::vector<Eigen::Vector3d>& nodes,
                       const std::vector<Attachment>& attachments);

}  // namespace medulla
