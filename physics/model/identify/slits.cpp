#include "physics/model/identify/slits.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <queue>
#include <unordered_map>
#include <utility>
#include <vector>

#include "physics/model/mesh_topology.h"
#include "physics/model/surface_queries.h"

namespace medulla {

using Eigen::Vector3d;

namespace {

struct Surface {
  const TriangleMesh& mesh;
  SurfaceTree tree;
  IndexLists trianglesOf;  // vertices
};

// Along edges, from a point of triangle `from` to a vertex of `to`, no farther than `reach` (m).
bool isNearAlong(const Surface& surface, const std::array<int, 3>& from, const Vector3d& start,
                 const std::array<int, 3>& to, double reach) {
  using Way = std::pair<double, int>;
  std::priority_queue<Way, std::vector<Way>, std::greater<>> open;
  std::unordered_map<int, double> known;
  const auto offer = [&](int vertex, double distance) {
    const auto [at, isNew] = known.try_emplace(vertex, distance);
    if (!isNew && at->second <= distance) return;
    at->second = distance;
    open.emplace(distance, vertex);
  };
  const std::vector<Vector3d>& x = surface.mesh.vertices;
  for (const int v : from) offer(v, (x[v] - start).norm());
  while (!open.empty()) {
    const auto [distance, v] = open.top();
    open.pop();
    if (std::find(to.begin(), to.end(), v) != to.end()) return true;
    if (distance > reach) return false;
    if (distance > known[v]) continue;
    for (int k = surface.trianglesOf.first[v]; k < surface.trianglesOf.first[v + 1]; ++k)
      for (const int w : surface.mesh.triangles[surface.trianglesOf.item[k]])
        if (w != v) offer(w, distance + (x[w] - x[v]).norm());
  }
  return false;
}

// m, outwards from a triangle's middle to a wall that faces it; infinity where there is none within `most`. `widest`
// says how far away along the surface a wall has to be.
double gapBefore(const Surface& surface, const std::array<int, 3>& triangle, double widest, double most) {
  constexpr double kNone = std::numeric_limits<double>::infinity(), kFaces = 0.5, kFar = 6, kOff = 1e-6;
  const Vector3d middle = centroid(surface.mesh, triangle);
  const Vector3d normal = areaVector(surface.mesh, triangle).stableNormalized();
  const double gap = firstHit(surface.tree, middle + kOff * widest * normal, normal, most);
  if (!(gap < most)) return kNone;
  std::vector<TriangleDistance> walls;
  trianglesWithin(surface.tree, middle + (gap + kOff * widest) * normal, kOff * widest, walls);
  if (walls.empty()) return kNone;
  const std::array<int, 3>& wall = surface.tree.triangles[walls.front().triangle];
  const bool faces = areaVector(surface.mesh, wall).stableNormalized().dot(normal) < -kFaces;
  return faces && !isNearAlong(surface, triangle, middle, wall, kFar * widest) ? gap : kNone;
}

}  // namespace

std::optional<Slit> narrowestSlit(const TriangleMesh& mesh, double widest) {
  constexpr double kLeast = 0.005;  // of the surface
  const double enough = kLeast * surfaceArea(mesh);
  const Surface surface{mesh, makeSurfaceTree(mesh), trianglesOfVertices(mesh)};
  Slit slit{widest, {}};
  double walls = 0;
  for (const std::array<int, 3>& triangle : mesh.triangles) {
    // Once it is told at all, only what is narrower matters.
    const double most = walls < enough ? widest : slit.width, gap = gapBefore(surface, triangle, widest, most);
    if (!(gap < most)) continue;
    walls += areaVector(mesh, triangle).norm();
    if (gap < slit.width) slit = {gap, mesh.vertices[triangle[0]]};
  }
  if (walls < enough) return std::nullopt;
  return slit;
}

}  // namespace medulla
