#include "physics/model/identify/skin_fit.h"

#include <Eigen/LU>
#include <algorithm>

namespace medulla {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;

namespace {

// All frames, nearest first, with rest points.
std::vector<SkinFrame> framesByDistance(const TriangleMesh& mesh, const CellFrames& cells,
                                        const std::vector<FixedPatch>& patches, const Vector3d& node) {
  std::vector<SkinFrame> all;
  for (std::size_t i = 0; i < cells.frames.size(); ++i)
    all.push_back({static_cast<int>(i), 0, cells.frames[i].restPosition});
  for (const FixedPatch& patch : patches)
    all.push_back({static_cast<int>(all.size()), 0, mesh.vertices[nearestNode(mesh, patch, node)]});
  const auto distance = [&](const SkinFrame& f) { return (f.restPoint - node).norm(); };
  std::stable_sort(all.begin(), all.end(),
                   [&](const SkinFrame& a, const SkinFrame& b) { return distance(a) < distance(b); });
  return all;
}

void setWeights(const CellFrames& cells, const Vector3d& node, std::vector<SkinFrame>& frames) {
  double sum = 0;
  for (SkinFrame& f : frames)
    sum += f.weight = std::pow(std::max((f.restPoint - node).norm(), 0.1 * cells.lengthScale), -2);
  for (SkinFrame& f : frames) f.weight /= sum;
}

// Rows: the motions of the frames, (u, lengthScale theta) each, in rigid motions about the node; columns: translation
// and lengthScale times rotation.
MatrixXd rigidMotions(const std::vector<SkinFrame>& frames, const Vector3d& node, double lengthScale) {
  MatrixXd out = MatrixXd::Zero(6 * static_cast<Index>(frames.size()), 6);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const Vector3d r = (frames[k].restPoint - node) / lengthScale;
    auto rows = out.middleRows<6>(6 * static_cast<Index>(k));
    rows.setIdentity();
    rows.topRightCorner<3, 3>() << 0, r.z(), -r.y(), -r.z(), 0, r.x(), r.y(), -r.x(), 0;
  }
  return out;
}

// The maps B of least tr (Phi - B) C (Phi - B)^T whose rigid motions are the node's: with C and Phi C restricted to
// the node's frames, B C = Phi C + multipliers. Returns that trace, less what does not depend on B.
double fitNode(const MatrixXd& compliance, const Eigen::Ref<const MatrixXd>& response, const Vector3d& node,
               double lengthScale, std::vector<SkinFrame>& frames) {
  const auto m = 6 * static_cast<Index>(frames.size()), spheres = compliance.rows() / 6;
  MatrixXd system = MatrixXd::Zero(m + 6, m + 6), right = MatrixXd::Zero(m + 6, 3);
  for (std::size_t a = 0; a < frames.size(); ++a) {
    if (frames[a].frame >= spheres) continue;  // patches never move
    const auto row = 6 * static_cast<Index>(a);
    for (std::size_t b = 0; b < frames.size(); ++b) {
      if (frames[b].frame >= spheres) continue;
      system.block<6, 6>(row, 6 * static_cast<Index>(b)) =
          compliance.block<6, 6>(6 * frames[a].frame, 6 * frames[b].frame);
    }
    right.middleRows<6>(row) = response.middleCols<6>(6 * frames[a].frame).transpose();
  }
  const MatrixXd among = system.topLeftCorner(m, m), toNode = right.topRows(m);
  const double scale = system.trace() / static_cast<double>(m);
  if (scale > 0) {
    system /= scale;
    right /= scale;
  }
  system.diagonal().head(m).array() += 1e-9;  // settles what the patches, which never move, leave open
  const MatrixXd rigid = rigidMotions(frames, node, lengthScale);
  system.topRightCorner(m, 6) = rigid;
  system.bottomLeftCorner(6, m) = rigid.transpose();
  right.bottomRows<6>().topRows<3>().setIdentity();
  const Eigen::PartialPivLU<MatrixXd> factors(system);
  MatrixXd solution = factors.solve(right);
  solution += factors.solve(right - system * solution);
  for (std::size_t k = 0; k < frames.size(); ++k)
    frames[k].map = solution.middleRows<6>(6 * static_cast<Index>(k)).transpose();
  const MatrixXd maps = solution.topRows(m);
  return (maps.transpose() * (among * maps - 2 * toNode)).trace();
}

}  // namespace

int nearestNode(const TriangleMesh& mesh, const FixedPatch& patch, const Vector3d& point) {
  return *std::min_element(patch.nodes.begin(), patch.nodes.end(), [&](int a, int b) {
    return (mesh.vertices[a] - point).squaredNorm() < (mesh.vertices[b] - point).squaredNorm();
  });
}

std::vector<std::vector<SkinFrame>> fitSkin(const TriangleMesh& mesh, const CellFrames& cells,
                                            const std::vector<FixedPatch>& patches, const MatrixXd& compliance,
                                            const MatrixXd& nodesUnderLoads) {
  std::vector<std::vector<SkinFrame>> skin(mesh.vertices.size());
  for (std::size_t p = 0; p < patches.size(); ++p) {
    for (const int n : patches[p].nodes) {
      if (!skin[n].empty()) continue;  // the first patch of several
      SkinFrame& held = skin[n].emplace_back();
      held = {static_cast<int>(cells.frames.size() + p), 1, mesh.vertices[n]};
      held.map.leftCols<3>().setIdentity();
    }
  }
  for (std::size_t n = 0; n < skin.size(); ++n) {
    if (!skin[n].empty()) continue;
    const Vector3d& node = mesh.vertices[n];
    const auto fit = [&](std::vector<SkinFrame>& frames) {
      setWeights(cells, node, frames);
      return fitNode(compliance, nodesUnderLoads.middleRows<3>(3 * static_cast<Index>(n)), node, cells.lengthScale,
                     frames);
    };
    const std::vector<SkinFrame> all = framesByDistance(mesh, cells, patches, node);
    const auto end = all.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(all.size(), kSkinFrames));
    skin[n].assign(all.begin(), end);
    const double left = fit(skin[n]);
    // Moving frames alone have to carry the node along with their common rigid motion, which ties its maps where all of
    // them are held by what is near: then a patch may tell more than the farthest of them. What is far from it turns
    // too much for maps that are linear.
    constexpr double kPatchReach = 1.5;  // of the farthest frame's distance
    const auto patch = std::find_if(
        all.begin(), all.end(), [&](const SkinFrame& f) { return f.frame >= static_cast<int>(cells.frames.size()); });
    const double farthest = (skin[n].back().restPoint - node).norm();
    if (patch == all.end() || patch < end || (patch->restPoint - node).norm() > kPatchReach * farthest) continue;
    std::vector<SkinFrame> grounded(all.begin(), end - 1);
    grounded.push_back(*patch);
    if (fit(grounded) < left) skin[n] = std::move(grounded);
  }
  return skin;
}

RowSparse skinMatrix(const std::vector<std::vector<SkinFrame>>& skin, int frames) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t n = 0; n < skin.size(); ++n) {
    for (const SkinFrame& f : skin[n]) {
      if (f.frame >= frames) continue;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 6; ++j) entries.emplace_back(static_cast<int>(3 * n) + i, 6 * f.frame + j, f.map(i, j));
    }
  }
  RowSparse out(3 * static_cast<Index>(skin.size()), 6 * frames);
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

}  // namespace medulla
