#include "physics/model/identify/held_region.h"

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

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

std::function<bool(const Vector3d&)> heldMaterial(const TriangleMesh& mesh, const std::vector<HeldRegion>& regions,
                                                  const std::vector<std::vector<int>>& triangles) {
  struct Space {
    std::function<bool(const Vector3d&)> contains;
    SurfaceTree held, others;
  };
  const auto spaces = std::make_shared<std::vector<Space>>();
  for (std::size_t r = 0; r < regions.size(); ++r) {
    if (!regions[r].contains) continue;
    TriangleMesh held{mesh.vertices, {}}, others{mesh.vertices, {}};
    for (std::size_t t = 0, next = 0; t < mesh.triangles.size(); ++t) {
      const bool isHeld = next < triangles[r].size() && triangles[r][next] == static_cast<int>(t);
      (isHeld ? held : others).triangles.push_back(mesh.triangles[t]);
      next += isHeld ? 1 : 0;
    }
    if (others.triangles.empty()) throw std::runtime_error(regions[r].text + " holds the whole surface");
    spaces->push_back({regions[r].contains, makeSurfaceTree(held), makeSurfaceTree(others)});
  }
  if (spaces->empty()) return {};
  return [spaces](const Vector3d& x) {
    return std::any_of(spaces->begin(), spaces->end(), [&](const Space& s) {
      return s.contains(x) && closestPoint(s.held, x).distance < closestPoint(s.others, x).distance;
    });
  };
}

}  // namespace medulla
