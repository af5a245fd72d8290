#include "physics/model/render_surface.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "physics/model/loop_subdivision.h"
#include "physics/model/surface_queries.h"
#include "physics/sort_unique.h"

namespace medulla {

using Eigen::Vector3d;

namespace {

// Floats must sum to exactly what the doubles do, 1 or 0: a body far from the origin would else shift or turn its
// skin. The largest weight takes the rounding of all.
void appendRow(const Stencil& row, double sum, const std::vector<int>& nodes, std::vector<float>& out) {
  const std::size_t begin = out.size();
  auto term = row.begin();
  for (const int node : nodes) {
    const bool present = term != row.end() && term->first == node;
    out.push_back(present ? static_cast<float>(term->second) : 0.f);
    if (present) ++term;
  }
  const auto largest = std::max_element(out.begin() + static_cast<std::ptrdiff_t>(begin), out.end(),
                                        [](float a, float b) { return std::abs(a) < std::abs(b); });
  for (int round = 0; round < 2; ++round) {
    double total = 0;
    for (std::size_t k = begin; k < out.size(); ++k) total += out[k];
    *largest = static_cast<float>(*largest + (sum - total));
  }
}

// Physics nodes that any of a vertex's three stencils names.
std::vector<int> nodesOf(const LimitStencils& limit, std::size_t vertex) {
  std::vector<int> nodes;
  for (const Stencil* row : {&limit.position[vertex], &limit.tangent0[vertex], &limit.tangent1[vertex]})
    for (const auto& [node, weight] : *row) nodes.push_back(node);
  sortUnique(nodes);
  return nodes;
}

struct LimitPoint {
  Vector3d position;
  Eigen::Matrix3d frame;  // columns t0, n x t0, n
};

LimitPoint evaluate(const RenderSurface& surface, std::size_t vertex, const std::vector<Vector3d>& nodes) {
  Vector3d position = Vector3d::Zero(), a = Vector3d::Zero(), b = Vector3d::Zero();
  for (int k = surface.first[vertex]; k < surface.first[vertex + 1]; ++k) {
    const Vector3d& x = nodes[surface.node[k]];
    position += static_cast<double>(surface.weight[k]) * x;
    a += static_cast<double>(surface.tangent0[k]) * x;
    b += static_cast<double>(surface.tangent1[k]) * x;
  }
  LimitPoint point{position, {}};
  const Vector3d t0 = a.normalized(), normal = a.cross(b).normalized();
  point.frame << t0, normal.cross(t0), normal;
  return point;
}

double meanEdge(const TriangleMesh& mesh) {
  double sum = 0;
  for (const std::array<int, 3>& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) sum += (mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm();
  return sum / (3. * static_cast<double>(mesh.triangles.size()));
}

std::optional<Vector3d> offsetToFine(const SurfaceTree& fine, const LimitPoint& point, double bound) {
  constexpr double kOnIt = 1e-9;  // of the bound: from the surface itself a ray would go on to the opposite wall
  const SurfacePoint nearest = closestPoint(fine, point.position, bound);
  if (nearest.distance < kOnIt * bound) return Vector3d::Zero();
  const Vector3d normal = point.frame.col(2);
  const double outward = firstHit(fine, point.position, normal, bound);
  const double inward = firstHit(fine, point.position, -normal, bound);
  if (std::isfinite(std::min(outward, inward))) return (outward <= inward ? outward : -inward) * normal;
  if (!std::isfinite(nearest.distance)) return std::nullopt;
  return nearest.point - point.position;
}

std::array<float, 3> toFloat(const Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

}  // namespace

RenderSurface makeRenderSurface(const TriangleMesh& mesh, int levels, const TriangleMesh* fine) {
  SubdivisionLevel level = controlLevel(static_cast<int>(mesh.vertices.size()), mesh.triangles);
  for (int k = 0; k < levels; ++k) level = subdivideLoop(level);
  const LimitStencils limit = limitStencils(level);

  RenderSurface surface;
  surface.triangles = level.triangles;
  surface.first.push_back(0);
  for (std::size_t v = 0; v < limit.position.size(); ++v) {
    const std::vector<int> nodes = nodesOf(limit, v);
    surface.node.insert(surface.node.end(), nodes.begin(), nodes.end());
    appendRow(limit.position[v], 1, nodes, surface.weight);
    appendRow(limit.tangent0[v], 0, nodes, surface.tangent0);
    appendRow(limit.tangent1[v], 0, nodes, surface.tangent1);
    surface.first.push_back(static_cast<int>(surface.node.size()));
  }

  const SurfaceTree fineTree = fine != nullptr ? makeSurfaceTree(*fine) : SurfaceTree{};
  const double bound = 1.5 * meanEdge(mesh);
  std::size_t apart = 0;
  for (std::size_t v = 0; v < limit.position.size(); ++v) {
    const LimitPoint point = evaluate(surface, v, mesh.vertices);
    const std::optional<Vector3d> found = fine != nullptr ? offsetToFine(fineTree, point, bound) : Vector3d::Zero();
    const Vector3d offset = found.value_or(Vector3d::Zero());
    apart += found ? 0 : 1;
    surface.offset.push_back(toFloat(point.frame.transpose() * offset));
    surface.restPosition.push_back(toFloat(point.position + offset));
  }
  if (2 * apart > limit.position.size())
    throw std::runtime_error(
        fmt::format("the fine shape lies elsewhere: {} of {} points of the surface have none of it within {:.2g} m; "
                    "expected the same body, unit and place",
                    apart, limit.position.size(), bound));
  return surface;
}

}  // namespace medulla
