#pragma once

#include <vector>

#include "physics/model/identify/cell_frames.h"

namespace medulla {

// Hangs the mesh's nodes on frames so that they answer loads on all frames as near to finite elements as rigid motion
// of all together allows, which is reproduced exactly. `compliance` is that of the frames (6 frames square),
// `nodesUnderLoads` the displacements of the mesh's nodes under unit loads on the frames (3 nodes x 6 frames). Nodes of
// a patch hang on it alone.
std::vector<std::vector<SkinFrame>> fitSkin(const TriangleMesh& mesh, const CellFrames& cells,
                                            const std::vector<FixedPatch>& patches, const Eigen::MatrixXd& compliance,
                                            const Eigen::MatrixXd& nodesUnderLoads);

// The linear skin: 3 nodes x 6 frames; patches keep still.
RowSparse skinMatrix(const std::vector<std::vector<SkinFrame>>& skin, int frames);

// The patch's node nearest to a point.
int nearestNode(const TriangleMesh& mesh, const FixedPatch& patch, const Eigen::Vector3d& point);

}  // namespace medulla
