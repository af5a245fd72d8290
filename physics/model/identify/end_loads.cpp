#include "physics/model/identify/end_loads.h"

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

// Forces at the nodes that have the tractions' force and moment: the integrals of linear shapes by linear tractions.
VectorXd consistentForces(const TriangleMesh& mesh, const VectorXd& tractions) {
  VectorXd out = VectorXd::Zero(tractions.size());
  for (const std::array<int, 3>& t : mesh.triangles) {
    const Vector3d normal =
        (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
    for (const int i : t) {
      for (const int j : t)
        out.segment<3>(3 * i) += (i == j ? 2 : 1) * normal.norm() / 24 * tractions.segment<3>(3 * j);
    }
  }
  return out;
}

}  // namespace

EndTwists solveEnds(const TriangleMesh& mesh, const VoxelSolid& solid, const CellFrames& cells,
                    const std::vector<IdentifiedLink>& links, const VectorXd& areas) {
  const Index n = cells.motion.rows(), nodes = solid.surface.rows();
  EndTwists out{{}, {}, MatrixXd(nodes, 0), MatrixXd(n, 0), MatrixXd::Zero(n, n), MatrixXd::Zero(nodes, n)};
  if (solid.isFree || !isRowOfCells(links, cells.frames.size())) return out;
  for (const End& end : endsOf(links, static_cast<int>(cells.frames.size()))) {
    const VectorXd tractions = twistOn(mesh, cells, end, areas);
    const RowMatrix loads = areas.transpose().replicate<3, 1>().reshaped().cwiseProduct(tractions);
    const RowMatrix moved = displacementsUnder(solid, loads);
    const VectorXd frames = cells.motion * moved;
    const double work = (loads.transpose() * (solid.loading.transpose() * moved)).sum();
    if (!(work > 0)) continue;  // no free node beyond the frame
    out.framesUnderTwists += frames * frames.transpose() / work;
    out.nodesUnderTwists += solid.surface * moved * frames.transpose() / work;
    out.cells.push_back(end.cell);
    out.axes.push_back(end.axes);
    out.forces.conservativeResize(nodes, out.forces.cols() + 1);
    out.frames.conservativeResize(n, out.frames.cols() + 1);
    out.forces.rightCols<1>() = consistentForces(mesh, tractions);
    out.frames.rightCols<1>() = frames;
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
