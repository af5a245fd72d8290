#include "physics/model/identify/held_region.h"

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <set>
#include <stdexcept>
#include <utility>

#include "physics/model/surface_queries.h"

namespace medulla {

using Eigen::Vector3d;

std::vector<int> wholeTriangles(const TriangleMesh& mesh, const HeldRegion& region) {
  if (region.nodes.empty()) throw std::runtime_error(fmt::format("{} holds no node of the surface", region.text));
  std::vector<bool> held(mesh.vertices.size(), false);
  for (const int n : region.nodes) held[n] = true;
  std::vector<int> out;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    if (held[a] && held[b] && held[c]) out.push_back(static_cast<int>(t));
  }
  if (out.empty()) {
    throw std::runtime_error(
        fmt::format("{} holds {} nodes but no whole triangle of the surface; expected one at least", region.text,
                    region.nodes.size()));
  }
  return out;
}

using Edge = std::pair<int, int>;

std::vector<bool> nodesOfTriangles(const TriangleMesh& mesh, const std::vector<int>& triangles) {
  std::vector<bool> out(mesh.vertices.size(), false);
  for (const int t : triangles)
    for (const int n : mesh.triangles[t]) out[n] = true;
  return out;
}

std::vector<Edge> rimOf(const TriangleMesh& mesh, const std::vector<int>& triangles) {
  std::set<Edge> edges;
  for (const int t : triangles)
    for (int k = 0; k < 3; ++k) edges.insert({mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]});
  std::vector<Edge> rim;
  for (const Edge& e : edges)
    if (!edges.contains({e.second, e.first})) rim.push_back(e);
  return rim;
}

namespace {

// The parts of a rim that hang together.
std::vector<std::vector<Edge>> loopsOf(std::vector<Edge> rim) {
  std::vector<std::vector<Edge>> loops;
  while (!rim.empty()) {
    std::set<int> corners = {rim[0].first};
    std::vector<Edge> loop;
    for (bool more = true; more;) {
      const auto touches = [&](const Edge& e) { return corners.contains(e.first) || corners.contains(e.second); };
      const auto rest = std::stable_partition(rim.begin(), rim.end(), touches);
      more = rest != rim.begin();
      for (auto e = rim.begin(); e != rest; ++e) {
        corners.insert({e->first, e->second});
        loop.push_back(*e);
      }
      rim.erase(rim.begin(), rest);
    }
    loops.push_back(loop);
  }
  return loops;
}

HeldSpace spaceBehind(const TriangleMesh& mesh, const std::vector<int>& held) {
  HeldSpace out{{mesh.vertices, {}}, static_cast<int>(held.size())};
  for (const int t : held) out.surface.triangles.push_back(mesh.triangles[t]);
  for (const std::vector<Edge>& loop : loopsOf(rimOf(mesh, held))) {
    Vector3d middle = Vector3d::Zero();
    for (const Edge& e : loop) middle += mesh.vertices[e.first] / static_cast<double>(loop.size());
    const int centre = static_cast<int>(out.surface.vertices.size());
    out.surface.vertices.push_back(middle);
    for (const auto& [a, b] : loop) out.surface.triangles.push_back({b, a, centre});
  }
  return out;
}

}  // namespace

std::vector<HeldSpace> heldSpaces(const TriangleMesh& mesh, const std::vector<HeldRegion>& regions,
                                  const std::vector<std::vector<int>>& triangles) {
  std::vector<HeldSpace> out;
  for (std::size_t r = 0; r < regions.size(); ++r) {
    if (!regions[r].isSpace) continue;
    if (triangles[r].size() == mesh.triangles.size())
      throw std::runtime_error(regions[r].text + " holds the whole surface");
    out.push_back(spaceBehind(mesh, triangles[r]));
  }
  return out;
}

std::function<bool(const Vector3d&)> behindHeld(const std::vector<HeldSpace>& spaces) {
  const auto trees = std::make_shared<std::vector<SurfaceTree>>();
  for (const HeldSpace& s : spaces) trees->push_back(makeSurfaceTree(s.surface));
  return [trees](const Vector3d& x) {
    return std::any_of(trees->begin(), trees->end(), [&](const SurfaceTree& tree) { return isInside(tree, x); });
  };
}

}  // namespace medulla
