#include <fmt/format.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>
#include <set>
#include <stdexcept>

#include "physics/model/mesh_repair_stages.h"
#include "physics/model/mesh_topology.h"

namespace medulla {

namespace {

// Loops up to this fraction of the bounding box's diagonal are holes; longer ones are openings of a surface that was
// never closed.
constexpr double kSmallHole = 0.5;
// Edges of a loop: the filling takes their cube, 0.3 s here.
constexpr std::size_t kMostEdges = 600;

using Edge = std::array<int, 2>;

struct Loop {
  std::vector<int> vertices;  // in the sense in which triangles that close the hole run along it
  double length = 0;          // m
};

double loopLength(const TriangleMesh& mesh, const std::vector<int>& loop) {
  double length = 0;
  for (std::size_t i = 0; i < loop.size(); ++i)
    length += (mesh.vertices[loop[(i + 1) % loop.size()]] - mesh.vertices[loop[i]]).norm();
  return length;
}

// Of the ends of open edges that leave `v`, that of the edge which turns back most sharply from the one that came from
// `before` (-1: none did): within the gap between a coarse edge and the two that meet its middle, not round all coarse
// edges and then round all fine ones. Whatever the order of the triangles.
std::vector<int>::iterator sharpestTurn(const TriangleMesh& mesh, int before, int v, std::vector<int>& ends) {
  const auto turn = [&](int to) {
    if (before < 0) return 0.;
    const Eigen::Vector3d back = mesh.vertices[before] - mesh.vertices[v], on = mesh.vertices[to] - mesh.vertices[v];
    return back.stableNormalized().dot(on.stableNormalized());
  };
  return std::min_element(ends.begin(), ends.end(),
                          [&](int a, int b) { return turn(a) != turn(b) ? turn(a) > turn(b) : a < b; });
}

// Simple loops of open edges. Where two openings meet in a vertex, the walk cuts a loop off whenever it returns to a
// vertex that it has passed.
std::vector<Loop> openLoops(const TriangleMesh& mesh) {
  const auto onEdge = trianglesOnEdges(mesh);
  std::vector<std::vector<int>> next(mesh.vertices.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k)
      if (onEdge[t][k] == 1) next[mesh.triangles[t][(k + 1) % 3]].push_back(mesh.triangles[t][k]);
  }
  std::vector<Loop> loops;
  std::vector<int> path, positionOnPath(mesh.vertices.size(), -1);
  for (int start = 0; start < static_cast<int>(next.size()); ++start) {
    int v = start;
    while (!next[v].empty() || !path.empty()) {
      if (positionOnPath[v] >= 0) {
        Loop loop;
        loop.vertices.assign(path.begin() + positionOnPath[v], path.end());
        path.resize(positionOnPath[v]);
        for (const int passed : loop.vertices) positionOnPath[passed] = -1;
        loop.length = loopLength(mesh, loop.vertices);
        loops.push_back(std::move(loop));
        continue;
      }
      positionOnPath[v] = static_cast<int>(path.size());
      path.push_back(v);
      const int before = path.size() > 1 ? path[path.size() - 2] : -1;
      const auto to = sharpestTurn(mesh, before, v, next[v]);  // as many edges leave a vertex as arrive
      const int end = *to;
      next[v].erase(to);
      v = end;
    }
  }
  return loops;
}

// Triangulation of a loop without new vertices that has the least area (Barequet and Sharir 1995), with a hundredth of
// the squared edges so that among equal areas the well-shaped one wins. Edges that the mesh has already are not used a
// third time. Empty where there is none.
std::vector<std::array<int, 3>> triangulate(const TriangleMesh& mesh, const std::vector<int>& loop,
                                            const std::set<Edge>& edges) {
  const int n = static_cast<int>(loop.size());
  constexpr double kNever = std::numeric_limits<double>::infinity();
  std::vector<double> cost(static_cast<std::size_t>(n) * n, kNever);
  std::vector<int> apex(cost.size(), -1);
  const auto triangleCost = [&](int i, int j, int k) {
    const Eigen::Vector3d &a = mesh.vertices[loop[i]], &b = mesh.vertices[loop[j]], &c = mesh.vertices[loop[k]];
    return 0.5 * (b - a).cross(c - a).norm() +
           0.01 * ((b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm());
  };
  for (int i = 0; i + 1 < n; ++i) cost[i * n + i + 1] = 0;
  for (int span = 2; span < n; ++span) {
    for (int i = 0; i + span < n; ++i) {
      const int k = i + span;
      if (span < n - 1 && edges.contains(edgeOf(loop[i], loop[k]))) continue;
      for (int j = i + 1; j < k; ++j) {
        const double sides = cost[i * n + j] + cost[j * n + k];
        if (sides >= cost[i * n + k]) continue;
        const double total = sides + triangleCost(i, j, k);
        if (total >= cost[i * n + k]) continue;
        cost[i * n + k] = total;
        apex[i * n + k] = j;
      }
    }
  }
  std::vector<std::array<int, 3>> triangles;
  if (cost[n - 1] == kNever) return triangles;
  std::vector<Edge> open{{0, n - 1}};
  while (!open.empty()) {
    const auto [i, k] = open.back();
    open.pop_back();
    const int j = apex[i * n + k];
    if (j < 0) continue;
    triangles.push_back({loop[i], loop[j], loop[k]});
    open.push_back({i, j});
    open.push_back({j, k});
  }
  return triangles;
}

std::array<int, 3> sorted(std::array<int, 3> corners) {
  std::sort(corners.begin(), corners.end());
  return corners;
}

}  // namespace

void fillSmallHoles(MeshUnderRepair& repair) {
  const std::vector<Loop> loops = openLoops(repair.mesh);
  if (loops.empty()) return;
  const double diagonal = boundsDiagonal(repair.mesh);
  const auto& longest =
      *std::max_element(loops.begin(), loops.end(), [](const Loop& a, const Loop& b) { return a.length < b.length; });
  if (longest.length > kSmallHole * diagonal) {
    throw std::runtime_error(fmt::format(
        "the surface is open: {} of {} ({} edges), expected a closed surface; up to {}, half the diagonal, is filled",
        loops.size() == 1 ? "an opening" : fmt::format("{} openings, the largest", loops.size()),
        millimetres(longest.length), longest.vertices.size(), millimetres(kSmallHole * diagonal)));
  }
  const auto list = uniqueEdges(repair.mesh);
  std::set<Edge> edges(list.begin(), list.end());
  std::set<std::array<int, 3>> known;
  for (const std::array<int, 3>& t : repair.mesh.triangles) known.insert(sorted(t));
  for (const Loop& loop : loops) {
    const bool tooMany = loop.vertices.size() > kMostEdges;
    const auto triangles = tooMany ? decltype(repair.mesh.triangles)() : triangulate(repair.mesh, loop.vertices, edges);
    // A lone triangle's outline could only be closed by its own back.
    if (triangles.empty() || (triangles.size() == 1 && known.contains(sorted(triangles[0])))) {
      throw std::runtime_error(
          fmt::format("a hole of {} ({} edges) near vertex {} cannot be filled, expected a closed surface",
                      millimetres(loop.length), loop.vertices.size(), repair.inputOfVertex[loop.vertices[0]]));
    }
    for (const auto& t : triangles) {
      repair.mesh.triangles.push_back(t);
      known.insert(sorted(t));
      for (int k = 0; k < 3; ++k) edges.insert(edgeOf(t[k], t[(k + 1) % 3]));
    }
  }
  const std::string size = fmt::format("of {} ({} edges)", millimetres(longest.length), longest.vertices.size());
  repair.notes.push_back(loops.size() == 1 ? "filled a hole " + size
                                           : fmt::format("filled {} holes, the largest {}", loops.size(), size));
}

}  // namespace medulla
