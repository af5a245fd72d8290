#include "app/surface_smoothing.h"

#include <algorithm>
#include <cmath>

#include "physics/dynamics/body_mechanics.h"

namespace medulla {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

// How often each node is to give way to the mean of itself and its neighbours, half each. Once spreads a node over half
// an edge, as Loop's limit does, and squares of spreads add up.
static int passes(const SoftBodyModel& model) {
  const double radius = meanRadius(model);
  double squaredEdge = 0;
  for (const auto& [a, b] : model.edges)
    squaredEdge += (model.restNodes[a] - model.restNodes[b]).squaredNorm() / static_cast<double>(model.edges.size());
  const double coarser = std::min(static_cast<double>(model.triangles.size()) / kSmoothTriangles,
                                  kSmoothEdge * kSmoothEdge * radius * radius / squaredEdge);
  return std::max(0, static_cast<int>(std::lround(coarser)) - 1);
}

// ((1 + A) / 2)^n as a series of T_k(A): with A = cos x it is cos^2n (x / 2). Of n terms some 3 sqrt(n) count.
static std::vector<double> seriesOf(int n) {
  constexpr double kCounts = 1e-4;
  std::vector<double> share{1};
  for (int k = 1; k <= n; ++k) share[0] *= (2. * k - 1) / (2. * k);
  double term = share[0], sum = share[0];
  for (int k = 1; k <= n; ++k) {
    term *= static_cast<double>(n - k + 1) / (n + k);
    if (term < kCounts) break;
    share.push_back(2 * term);
    sum += 2 * term;
  }
  for (double& s : share) s /= sum;
  return share;
}

static IndexLists neighboursOf(const SoftBodyModel& model) {
  std::vector<std::array<int, 2>> pairs;
  pairs.reserve(2 * model.edges.size());
  for (const auto& [a, b] : model.edges) pairs.insert(pairs.end(), {{a, b}, {b, a}});
  return gather(static_cast<int>(model.restNodes.size()), pairs);
}

// next = scale * A now - before
static void meanOfNeighbours(const IndexLists& neighbours, double scale, const Points& now, Points& before) {
  for (std::size_t i = 0; i < now.size(); ++i) {
    Vector3d sum = Vector3d::Zero();
    for (int k = neighbours.first[i]; k < neighbours.first[i + 1]; ++k) sum += now[neighbours.item[k]];
    before[i] = scale / (neighbours.first[i + 1] - neighbours.first[i]) * sum - before[i];
  }
}

// Chebyshev's recursion T_k+1 = 2 A T_k - T_k-1.
static Points spread(const SurfaceSmoothing& smoothing, const Points& nodes) {
  Points sum(nodes.size()), before(nodes.size(), Vector3d::Zero()), now = nodes;
  for (std::size_t i = 0; i < nodes.size(); ++i) sum[i] = smoothing.share[0] * nodes[i];
  for (std::size_t k = 1; k < smoothing.share.size(); ++k) {
    meanOfNeighbours(smoothing.neighbours, k == 1 ? 1 : 2, now, before);
    std::swap(now, before);
    for (std::size_t i = 0; i < nodes.size(); ++i) sum[i] += smoothing.share[k] * now[i];
  }
  return sum;
}

// Columns t0, n x t0, n.
static Eigen::Matrix3d frameAt(const SurfaceSmoothing& smoothing, const Points& y, std::size_t i) {
  const Vector3d t0 = (y[smoothing.along[i]] - y[i]).normalized();
  const Vector3d n = t0.cross(y[smoothing.across[i]] - y[i]).normalized();
  Eigen::Matrix3d frame;
  frame << t0, n.cross(t0), n;
  return frame;
}

// The two neighbours that span the plane of all most firmly.
static void chooseFrame(const Points& y, std::size_t i, SurfaceSmoothing& smoothing) {
  const IndexLists& lists = smoothing.neighbours;
  double widest = -1;
  for (int k = lists.first[i]; k < lists.first[i + 1]; ++k)
    for (int j = lists.first[i]; j < k; ++j) {
      const Vector3d a = y[lists.item[j]] - y[i], b = y[lists.item[k]] - y[i];
      const double wide = a.cross(b).squaredNorm();
      if (wide <= widest) continue;
      widest = wide;
      smoothing.along[i] = lists.item[j];
      smoothing.across[i] = lists.item[k];
    }
}

SurfaceSmoothing makeSurfaceSmoothing(const SoftBodyModel& model) {
  SurfaceSmoothing smoothing;
  const int n = model.links.empty() || model.edges.empty() ? 0 : passes(model);
  if (n == 0) return smoothing;
  smoothing.share = seriesOf(n);
  smoothing.neighbours = neighboursOf(model);
  const std::size_t count = model.restNodes.size();
  smoothing.along.resize(count);
  smoothing.across.resize(count);
  smoothing.offset.resize(count);
  const Points y = spread(smoothing, model.restNodes);
  for (std::size_t i = 0; i < count; ++i) {
    chooseFrame(y, i, smoothing);
    smoothing.offset[i] = frameAt(smoothing, y, i).transpose() * (model.restNodes[i] - y[i]);
  }
  return smoothing;
}

Points smoothed(const SurfaceSmoothing& smoothing, const Points& nodes) {
  const Points y = spread(smoothing, nodes);
  Points out(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) out[i] = y[i] + frameAt(smoothing, y, i) * smoothing.offset[i];
  return out;
}

}  // namespace medulla
