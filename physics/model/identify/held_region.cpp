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

namespace {

// Per region and node: whether it is held.
std::vector<std::vector<bool>> nodesHeld(const TriangleMesh& mesh, const std::vector<HeldRegion>& regions) {
  std::vector<std::vector<bool>> out;
  for (const HeldRegion& region : regions) {
    if (region.nodes.empty()) throw std::runtime_error(region.text + " holds no node of the surface");
    out.emplace_back(mesh.vertices.size(), false);
    for (const int n : region.nodes) out.back()[n] = true;
  }
  return out;
}

}  // namespace

std::vector<std::vector<int>> heldTriangles(const TriangleMesh& mesh, const std::vector<HeldRegion>& regions) {
  const std::vector<std::vector<bool>> held = nodesHeld(mesh, regions);
  std::vector<std::vector<int>> out(regions.size());
  std::size_t count = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& corners = mesh.triangles[t];
    const auto isHeld = [&](int n) {
      return std::any_of(held.begin(), held.end(), [n](const std::vector<bool>& of) { return of[n]; });
    };
    if (!std::all_of(corners.begin(), corners.end(), isHeld)) continue;
    ++count;
    const auto cornersIn = [&](std::size_t r) {
      return std::count_if(corners.begin(), corners.end(), [&](int n) { return held[r][n]; });
    };
    std::size_t most = 0;
    for (std::size_t r = 0; r < regions.size(); ++r) {
      if (cornersIn(r) == 3) out[r].push_back(static_cast<int>(t));
      if (cornersIn(r) > cornersIn(most)) most = r;
    }
    if (cornersIn(most) < 3) out[most].push_back(static_cast<int>(t));
  }
  for (std::size_t r = 0; r < regions.size(); ++r)
    if (out[r].empty())
      throw std::runtime_error(
          fmt::format("{} holds {} nodes but no whole triangle of the surface; expected one at least", regions[r].text,
                      regions[r].nodes.size()));
  if (!regions.empty() && count == mesh.triangles.size())
    throw std::runtime_error(regions[0].text + (regions.size() > 1 ? " and others hold" : " holds") +
                             " the whole surface");
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
