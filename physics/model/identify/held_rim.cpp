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

// By the edge along which a triangle meets a rim: the area of what bounds the free body there, outwards.
std::map<std::pair<int, int>, Vector3d> heldAreas(const TriangleMesh& mesh, const std::vector<Corners>& triangles,
                                                  const std::vector<HeldSpace>& spaces) {
  std::map<std::pair<int, int>, Vector3d> out;
  for (const Corners& t : triangles)
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
  std::vector<Corners> triangles;
  triangles.reserve(heldTriangles.size());
  for (const int t : heldTriangles) triangles.push_back(mesh.triangles[t]);
  const auto held = heldAreas(mesh, triangles, heldSpaces);
  std::map<std::pair<int, int>, Vector3d> beside;  // of the mesh's triangles, by the edge as their neighbour has it
  for (const Corners& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) beside[{t[(k + 1) % 3], t[k]}] = areaVector(mesh, t);
  std::vector<RimEdge> out;
  for (const auto& [a, b] : rimOf(triangles)) {
    const Vector3d along = (mesh.vertices[b] - mesh.vertices[a]).normalized();
    const Vector3d &own = held.at({a, b}), &free = beside.at({a, b});
    const double bend = std::atan2(own.cross(free).dot(along), own.dot(free));  // convex: positive
    out.push_back({mesh.vertices[a], mesh.vertices[b], std::numbers::pi - bend});
  }
  return out;
}

// Two measured numbers and a line through them: what brings the cells' answers to loads on ten bodies to CalculiX's in
// small displacements (tests/accuracy/limits.md).
double usualGive(double angle) {
  constexpr double right = 0.6, straight = 1.95;
  return std::max(0., right + (straight - right) * (angle / (std::numbers::pi / 2) - 1));
}

double usualGive(const std::vector<RimEdge>& rim) {
  double give = 0, length = 0;
  for (const RimEdge& edge : rim) {
    const double own = (edge.to - edge.from).norm();
    give += own * usualGive(edge.angle);
    length += own;
  }
  return length > 0 ? give / length : 0;
}

}  // namespace medulla
