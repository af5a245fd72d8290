#include "physics/model/identify/end_loads.h"

#include "physics/model/identify/check_loads.h"
#include "physics/model/row_of_cells.h"

namespace medulla {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

struct End {
  int cell = 0;
  Matrix3d axes = Matrix3d::Identity();  // of its only link
  Vector3d outward = Vector3d::Zero();   // unit, along that, away from it
};

std::vector<End> endsOf(const std::vector<IdentifiedLink>& links, int frames) {
  std::vector<int> count(frames, 0);
  std::vector<End> last(frames);
  const auto put = [&](int frame, const IdentifiedLink& link, double sign) {
    ++count[frame];
    last[frame] = {frame, link.axes, sign * link.axes.row(0).transpose()};
  };
  for (const IdentifiedLink& link : links) {
    put(link.frame0, link, -1);
    if (link.frame1 < frames) put(link.frame1, link, 1);
  }
  std::vector<End> ends;
  for (int i = 0; i < frames; ++i)
    if (count[i] == 1) ends.push_back(last[i]);
  return ends;
}

// Pa at the mesh's nodes, linear between.
VectorXd twistOn(const TriangleMesh& mesh, const CellFrames& cells, const End& end, const VectorXd& areas) {
  const Vector3d& from = cells.frames[end.cell].restPosition;
  VectorXd out = VectorXd::Zero(3 * areas.size());
  for (Index n = 0; n < areas.size(); ++n) {
    const Vector3d arm = (mesh.vertices[n] - from) / cells.lengthScale;
    if (areas[n] > 0 && arm.dot(end.outward) > 0 && cellAt(cells.sites, mesh.vertices[n]) == end.cell)
      out.segment<3>(3 * n) = arm.dot(end.outward) * end.outward.cross(arm);
  }
  return out;
}

}  // namespace

EndTwists solveEnds(const TriangleMesh& mesh, const VoxelSolid& solid, const CellFrames& cells,
                    const std::vector<IdentifiedLink>& links, const VectorXd& areas) {
  const Index n = cells.motion.rows(), nodes = solid.surface.rows();
  EndTwists out{{}, {}, MatrixXd(nodes, 0), MatrixXd(n, 0), MatrixXd::Zero(n, n), MatrixXd::Zero(nodes, n)};
  if (solid.isFree || !isRowOfCells(links, cells.frames.size())) return out;
  const std::vector<End> all = endsOf(links, static_cast<int>(cells.frames.size()));
  MatrixXd tractions(nodes, static_cast<Index>(all.size()));
  for (Index e = 0; e < tractions.cols(); ++e) tractions.col(e) = twistOn(mesh, cells, all[e], areas);
  const RowMatrix loads = areas.transpose().replicate<3, 1>().reshaped().asDiagonal() * tractions;
  const RowMatrix moved = displacementsUnder(solid, loads);
  const MatrixXd frames = cells.motion * moved, onSurface = solid.surface * moved;
  const VectorXd work = loads.cwiseProduct(solid.loading.transpose() * moved).colwise().sum().transpose();
  for (Index e = 0; e < tractions.cols(); ++e) {
    if (!(work[e] > 0)) continue;  // no free node beyond the frame
    out.framesUnderTwists += frames.col(e) * frames.col(e).transpose() / work[e];
    out.nodesUnderTwists += onSurface.col(e) * frames.col(e).transpose() / work[e];
    out.cells.push_back(all[e].cell);
    out.axes.push_back(all[e].axes);
    out.forces.conservativeResize(nodes, out.forces.cols() + 1);
    out.frames.conservativeResize(n, out.frames.cols() + 1);
    out.forces.rightCols<1>() = consistentForces(mesh, tractions.col(e));
    out.frames.rightCols<1>() = frames.col(e);
  }
  return out;
}

LoadsOnCells loadsOnEnds(const EndTwists& ends, const MatrixXd& compliance, const RowSparse& skin) {
  const Index count = static_cast<Index>(ends.cells.size());
  LoadsOnCells out{ends.cells, MatrixXd::Zero(compliance.rows(), 6 * count), {}};
  for (Index e = 0; e < count; ++e) {
    auto own = out.loads.block<6, 6>(6 * ends.cells[e], 6 * e);
    own.setIdentity();
    own.bottomRightCorner<3, 3>() = ends.axes[e].transpose();
  }
  out.motions = compliance * out.loads;
  for (Index e = 0; e < count; ++e) {
    out.loads.col(6 * e + 3) = skin.transpose() * ends.forces.col(e);
    out.motions.col(6 * e + 3) = ends.frames.col(e);
  }
  return out;
}

}  // namespace medulla
