#include "physics/model/identify/held_rim.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "physics/model/mesh_topology.h"

namespace medulla {

using Eigen::Vector3d;

namespace {

using Corners = std::array<int, 3>;

// The triangles' areas, outwards, by each of their edges; where a fan cuts the free body off, at the held triangle's
// edge, that of the cut.
std::map<std::pair<int, int>, Vector3d> areasByEdge(const TriangleMesh& mesh, const std::vector<HeldSpace>& spaces) {
  std::map<std::pair<int, int>, Vector3d> out;
  for (const Corners& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) out[{t[k], t[(k + 1) % 3]}] = areaVector(mesh, t);
  for (const HeldSpace& space : spaces) {
    for (std::size_t f = space.firstFan; f < space.surface.triangles.size(); ++f) {
      const Corners& fan = space.surface.triangles[f];
      out[{fan[1], fan[0]}] = -areaVector(space.surface, fan);
    }
  }
  return out;
}

}  // namespace

std::vector<RimEdge> rimOfHeld(const TriangleMesh& mesh, const std::vector<int>& heldTriangles,
                               const std::vector<HeldSpace>& heldSpaces) {
  const auto areas = areasByEdge(mesh, heldSpaces);
  std::vector<RimEdge> out;
  for (const auto& [a, b] : rimOf(mesh, heldTriangles)) {
    const Vector3d along = mesh.vertices[b] - mesh.vertices[a];
    const Vector3d &held = areas.at({a, b}), &free = areas.at({b, a});
    const double length = along.norm();
    const double bend = std::atan2(held.cross(free).dot(along / length), held.dot(free));  // convex: positive
    out.push_back({length, std::numbers::pi - bend});
  }
  return out;
}

// Two measured numbers and a line through them: what brings the cells' answers to loads on nine bodies to CalculiX's in
// small displacements (tests/accuracy/limits.md).
double usualGive(double angle) {
  constexpr double right = 0.6, straight = 1.95;
  return std::max(0., right + (straight - right) * (angle / (std::numbers::pi / 2) - 1));
}

double usualGive(const std::vector<RimEdge>& rim) {
  double give = 0, length = 0;
  for (const RimEdge& edge : rim) {
    give += edge.length * usualGive(edge.angle);
    length += edge.length;
  }
  return length > 0 ? give / length : 0;
}

}  // namespace medulla
