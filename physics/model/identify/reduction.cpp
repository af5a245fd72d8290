#include "physics/model/identify/reduction.h"

#include <Eigen/Cholesky>
#include <stdexcept>

namespace medulla {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

MatrixXd solvePositive(const MatrixXd& matrix, const MatrixXd& right) {
  const Eigen::LLT<MatrixXd> factors(matrix);
  if (factors.info() != Eigen::Success)
    throw std::runtime_error("the body's stiffness is not positive definite: nothing to identify");
  return factors.solve(right);
}

namespace {

// The covariance of random forces on the mesh's nodes, times displacements: by area, and of a free body balanced.
class RandomTractions {
 public:
  RandomTractions(const VoxelSolid& solid, const CellFrames& cells, const VectorXd& areas) {
    variance_ = areas.transpose().replicate<3, 1>().reshaped();
    if (!solid.isFree) return;
    rigid_ =
        solid.loading.transpose() * rigidMotions(solid.grid.nodes, cells.frames[0].restPosition, 3, cells.lengthScale);
    weighted_ = variance_.asDiagonal() * rigid_;
  }
  RowMatrix operator()(const RowMatrix& displacements) const {
    RowMatrix out = variance_.asDiagonal() * displacements;
    if (rigid_.size() > 0)
      out -= weighted_ * solvePositive(rigid_.transpose() * weighted_, weighted_.transpose() * displacements);
    return out;
  }

 private:
  VectorXd variance_;
  MatrixXd rigid_, weighted_;  // of a free body: what its nodes' forces work on, and that times their variance
};

}  // namespace

Responses solveFrames(const VoxelSolid& solid, const CellFrames& cells, const VectorXd& areas,
                      const std::function<void(double)>& progress) {
  constexpr Index block = 96;  // more take more memory, 24 bytes per node of the grid and column
  const Index n = cells.motion.rows(), nodes = solid.surface.rows();
  Responses out{MatrixXd(n, n), MatrixXd(nodes, n), {}, MatrixXd(n, n), MatrixXd(nodes, n)};
  const RandomTractions tractions(solid, cells, areas);
  for (Index first = 0; first < n; first += block) {
    const Index count = std::min(block, n - first);
    RowMatrix x = RowMatrix(cells.motion.middleRows(first, count)).transpose();
    solveSolid(solid, x);
    out.frames.middleCols(first, count) = cells.motion * x;
    out.nodes.middleCols(first, count) = solid.surface * x;
    // With the frames' motion A K^-1 L f under forces f: E[f f^T] L^T K^-1 A^T as forces.
    x = displacementsUnder(solid, tractions(solid.loading.transpose() * x));
    out.framesUnderTractions.middleCols(first, count) = cells.motion * x;
    out.nodesUnderTractions.middleCols(first, count) = solid.surface * x;
    progress(static_cast<double>(first + count) / static_cast<double>(n));
  }
  for (std::size_t i = 0; i < cells.heldGive.size(); ++i)
    out.frames.block<6, 6>(6 * static_cast<Index>(i), 6 * static_cast<Index>(i)) += cells.heldGive[i];
  out.frames = (out.frames + out.frames.transpose()).eval() / 2;
  const double scale = out.frames.trace() / out.framesUnderTractions.trace();
  out.framesUnderTractions = scale / 2 * (out.framesUnderTractions + out.framesUnderTractions.transpose()).eval();
  out.nodesUnderTractions *= scale;
  return out;
}

MatrixXd rigidMotions(const std::vector<Vector3d>& points, const Vector3d& centre, int rows, double lengthScale) {
  MatrixXd out = MatrixXd::Zero(rows * static_cast<Index>(points.size()), 6);
  for (std::size_t p = 0; p < points.size(); ++p) {
    const Index row = rows * static_cast<Index>(p);
    out.block<3, 3>(row, 0).setIdentity();
    for (int k = 0; k < 3; ++k) out.block<3, 1>(row, 3 + k) = Vector3d::Unit(k).cross(points[p] - centre) / lengthScale;
    if (rows == 6) out.block<3, 3>(row + 3, 3).setIdentity();
  }
  return out;
}

Responses balancedResponses(const TriangleMesh& mesh, const CellFrames& cells, const Responses& pinned) {
  std::vector<Vector3d> places;
  for (const IdentifiedFrame& f : cells.frames) places.push_back(f.restPosition);
  const MatrixXd rigid = rigidMotions(places, places[0], 6, cells.lengthScale),
                 nodesRigid = rigidMotions(mesh.vertices, places[0], 3, cells.lengthScale);
  const Index n = rigid.rows();
  const MatrixXd inverse = solvePositive(pinned.frames, MatrixXd::Identity(n, n)), carried = inverse * rigid;
  MatrixXd stiffness = inverse - carried * solvePositive(rigid.transpose() * carried, carried.transpose());
  stiffness = (stiffness + stiffness.transpose()).eval() / 2;
  const MatrixXd squares = rigid.transpose() * rigid;
  Responses out;
  out.grounding = stiffness.trace() / static_cast<double>(n) * rigid * solvePositive(squares, rigid.transpose());
  out.frames = solvePositive(stiffness + out.grounding, MatrixXd::Identity(n, n));
  // Nodes under unit motions of the frames: the pinned solution, and the rigid motion that it lacks.
  const MatrixXd lacking =
      solvePositive(squares, rigid.transpose() * (MatrixXd::Identity(n, n) - pinned.frames * stiffness));
  out.nodes = (pinned.nodes * stiffness + nodesRigid * lacking) * out.frames;
  out.framesUnderTractions = pinned.framesUnderTractions;
  out.nodesUnderTractions = pinned.nodesUnderTractions;
  return out;
}

}  // namespace medulla
