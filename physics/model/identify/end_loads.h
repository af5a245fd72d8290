#pragma once

#include "physics/model/identify/link_fit.h"
#include "physics/model/identify/reduction.h"

namespace medulla {

// Twists of the ends of rows of cells: of cells with one link. A couple that is spread over the cell leaves the body's
// end nearly untwisted, while one on what lies beyond the frame twists it all the way; links and skin that know the
// former alone share twist out wrongly over the last cells. Here tractions turn about the link's axis and grow with the
// distance beyond the frame.
struct EndTwists {
  std::vector<int> cells;
  std::vector<Eigen::Matrix3d> axes;  // rows: of the cell's only link
  Eigen::MatrixXd forces;             // on the nodes, with the tractions' force and moment: 3 nodes x ends
  Eigen::MatrixXd frames;             // of finite elements under the tractions: 6 frames x ends
  // Sums over the ends, at unit energy: second moments of the frames' motions, and of the nodes' with them.
  Eigen::MatrixXd framesUnderTwists, nodesUnderTwists;
};

// None where cells do not lie in a row, and none of a free body, whose loads would have to be balanced. `areas`: of the
// mesh's nodes, 0 where held.
EndTwists solveEnds(const TriangleMesh& mesh, const VoxelSolid& solid, const CellFrames& cells,
                    const std::vector<IdentifiedLink>& links, const Eigen::VectorXd& areas);

// As loads on the frames through the skin (3 nodes x 6 frames): unit forces on an end's cell, its twist instead of the
// unit couple about the link's axis, and unit couples across. `compliance` is that of the frames.
LoadsOnCells loadsOnEnds(const EndTwists& ends, const Eigen::MatrixXd& compliance, const RowSparse& skin);

}  // namespace medulla
