#include "physics/model/long_edges.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "physics/model/mesh_topology.h"

namespace medulla {

using Eigen::Vector3d;

// From the triangle's middle inwards to where the surface is left for the last time: a wall around a hollow counts as
// thick as the whole, for it bends as that does.
static double thicknessBehind(const SurfaceTree& tree, const Vector3d& point, const Vector3d& inward, double diagonal) {
  constexpr int kHitsMax = 16;
  const double step = 1e-6 * diagonal;
  double thickness = 0, at = step;
  for (int k = 0; k < kHitsMax; ++k) {
    const double hit = firstHit(tree, point + at * inward, inward, 2 * diagonal);
    if (!std::isfinite(hit)) break;
    thickness = at + hit;
    at = thickness + step;
  }
  return thickness;
}

std::optional<LongEdges> longEdges(const TriangleMesh& mesh, const SurfaceTree& tree) {
  constexpr double kLong = 3;        // times the thickness
  constexpr double kShort = 0.02;    // of the diagonal: beside these even the thinnest body that can be built is thick
  constexpr double kMuchArea = 0.5;  // of the surface
  const double diagonal = boundsDiagonal(mesh);
  double total = 0, area = 0;
  std::vector<LongEdges> found;
  for (const std::array<int, 3>& t : mesh.triangles) {
    const Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const Vector3d across = (b - a).cross(c - a);
    const double edge = longestEdge(mesh, t);
    total += across.norm();
    if (edge < kShort * diagonal || across.isZero(0)) continue;
    const double thickness = thicknessBehind(tree, centroid(mesh, t), -across.normalized(), diagonal);
    if (thickness <= 0 || edge < kLong * thickness) continue;
    area += across.norm();
    found.push_back({edge, thickness});
  }
  if (area <= kMuchArea * total) return std::nullopt;
  const auto middle = found.begin() + static_cast<std::ptrdiff_t>(found.size() / 2);
  std::nth_element(found.begin(), middle, found.end(),
                   [](const LongEdges& p, const LongEdges& q) { return p.edge * q.thickness < q.edge * p.thickness; });
  return *middle;
}

}  // namespace medulla
