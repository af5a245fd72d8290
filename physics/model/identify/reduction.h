#pragma once

#include <functional>
#include <vector>

#include "physics/model/identify/cell_frames.h"

namespace medulla {

// Solutions under unit loads on the frames, as their frames and the mesh's nodes see them.
struct Responses {
  Eigen::MatrixXd frames, nodes;  // 6 frames and 3 nodes x 6 frames
  Eigen::MatrixXd grounding;      // of a free body: what has been added to its stiffness, 6 frames square
  // Under random tractions, alike all over the surface: second moments of the frames' motions, in sum over the diagonal
  // as large as `frames`, and of the nodes' with them.
  Eigen::MatrixXd framesUnderTractions, nodesUnderTractions;
};

// Throws std::runtime_error where the matrix is not positive definite.
Eigen::MatrixXd solvePositive(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right);

// `areas`: of the mesh's nodes, 0 where held.
Responses solveFrames(
    const VoxelSolid& solid, const CellFrames& cells, const Eigen::VectorXd& areas,
    const std::function<void(double)>& progress = [](double) {});

// Of a free body from that of the pins it stands on, which its balanced loads do not feel. Its own stiffness is the
// least energy over all rigid motions; on these a stiffness like the others' mean is added, so that there is a
// compliance.
Responses balancedResponses(const TriangleMesh& mesh, const CellFrames& cells, const Responses& pinned);

// Rigid motions of points, translation and turn about `centre` over lengthScale: `rows` per point x 6. Three rows are
// displacements; six have lengthScale times the rotation below them.
Eigen::MatrixXd rigidMotions(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& centre, int rows,
                             double lengthScale);

}  // namespace medulla
