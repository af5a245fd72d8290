#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "physics/model/mesh_repair_stages.h"
#include "physics/model/mesh_topology.h"

namespace medulla {

namespace {

// More pieces than this are not a body with cavities, and telling them apart takes pieces times triangles.
constexpr int kMostComponents = 1000;

void turn(std::array<int, 3>& triangle) {
  std::swap(triangle[1], triangle[2]);
}

// Whether `triangle` runs along the edge from a to b in this sense.
bool runsAlong(const std::array<int, 3>& triangle, int a, int b) {
  for (int k = 0; k < 3; ++k)
    if (triangle[k] == a && triangle[(k + 1) % 3] == b) return true;
  return false;
}

struct Component {
  std::vector<int> triangles;
  double volume = 0;  // m3, signed by the winding
  Eigen::AlignedBox3d box;
  int depth = 0;  // number of other components around this one
};

std::vector<Component> closedComponents(const TriangleMesh& mesh) {
  int count = 0;
  const std::vector<int> componentOf = componentOfTriangles(mesh, count);
  if (count > kMostComponents)
    throw std::runtime_error(fmt::format("the mesh has {} separate pieces, expected one closed surface", count));
  std::vector<Component> components(count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Component& component = components[componentOf[t]];
    component.triangles.push_back(static_cast<int>(t));
    const auto& corners = mesh.triangles[t];
    component.volume += areaVector(mesh, corners).dot(mesh.vertices[corners[0]] - mesh.vertices[0]) / 3;
    for (const int v : corners) component.box.extend(mesh.vertices[v]);
  }
  return components;
}

bool encloses(const TriangleMesh& mesh, const Component& outer, const Eigen::Vector3d& point) {
  if (!outer.box.contains(point)) return false;
  double angle = 0;
  for (const int t : outer.triangles) angle += solidAngle(mesh, mesh.triangles[t], point);
  return std::abs(angle) > 2 * std::numbers::pi;  // half a turn; the winding is not yet known to be outward
}

void findDepths(const TriangleMesh& mesh, std::vector<Component>& components) {
  for (Component& inner : components) {
    const Eigen::Vector3d point = centroid(mesh, mesh.triangles[inner.triangles[0]]);
    for (const Component& outer : components)
      if (&outer != &inner && encloses(mesh, outer, point)) ++inner.depth;
  }
}

}  // namespace

// Flood over shared edges; in each component the winding of the majority stays.
void orientNeighboursAlike(MeshUnderRepair& repair) {
  TriangleMesh& mesh = repair.mesh;
  const auto adjacent = adjacentTriangles(mesh);
  std::vector<bool> seen(mesh.triangles.size(), false), turned(mesh.triangles.size(), false);
  std::size_t total = 0;
  for (std::size_t seed = 0; seed < seen.size(); ++seed) {
    if (seen[seed]) continue;
    std::vector<int> component{static_cast<int>(seed)};
    seen[seed] = true;
    std::size_t count = 0;
    for (std::size_t i = 0; i < component.size(); ++i) {
      const int t = component[i];
      for (int k = 0; k < 3; ++k) {
        const int other = adjacent[t][k];
        if (other < 0) continue;
        const bool alike = !runsAlong(mesh.triangles[other], mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]);
        const bool turnOther = alike ? turned[t] : !turned[t];
        if (seen[other] && turned[other] != turnOther)
          throw std::runtime_error("the surface has only one side and cannot be oriented, expected a closed surface");
        if (seen[other]) continue;
        seen[other] = true;
        turned[other] = turnOther;
        count += turnOther ? 1 : 0;
        component.push_back(other);
      }
    }
    const bool turnMinority = 2 * count <= component.size();
    for (const int t : component)
      if (turned[t] == turnMinority) turn(mesh.triangles[t]);
    total += turnMinority ? count : component.size() - count;
  }
  if (total > 0) {
    repair.notes.push_back(fmt::format("turned {}", counted(total, "triangle to face as its neighbours do",
                                                            "triangles to face as their neighbours do")));
  }
}

// A component inside an odd number of others bounds a cavity, whatever its winding said: by the sign of its volume
// alone a cavity would become solid.
void orientBodyAndCavities(MeshUnderRepair& repair) {
  std::vector<Component> components = closedComponents(repair.mesh);
  if (components.size() > 1) findDepths(repair.mesh, components);
  const auto bodies =
      std::count_if(components.begin(), components.end(), [](const Component& c) { return c.depth % 2 == 0; });
  if (bodies != 1) {
    std::string sizes;
    for (const Component& c : components)
      if (c.depth % 2 == 0 && sizes.size() < 60)
        sizes += fmt::format("{}{}", sizes.empty() ? "" : ", ", c.triangles.size());
    throw std::runtime_error(
        fmt::format("the mesh holds {} separate bodies (triangles: {}), expected one: save each in a file of its own",
                    bodies, sizes));
  }
  std::size_t cavities = 0, inCavities = 0, turned = 0;
  for (const Component& c : components) {
    const bool cavity = c.depth % 2 == 1;
    cavities += cavity ? 1 : 0;
    inCavities += cavity ? c.triangles.size() : 0;
    if ((c.volume < 0) == cavity) continue;
    for (const int t : c.triangles) turn(repair.mesh.triangles[t]);
    if (cavity)
      ++turned;
    else
      repair.notes.emplace_back("turned the surface inside out: it faced inward");
  }
  if (cavities > 0)
    repair.notes.push_back(fmt::format("kept {} of {}{}",
                                       cavities == 1 ? "a cavity" : counted(cavities, "", "cavities"),
                                       counted(inCavities, "triangle", "triangles"),
                                       turned == 0     ? ""
                                       : cavities == 1 ? ", which faced outward as a solid does, and was turned"
                                                       : ", those turned that faced outward as solids do"));
}

}  // namespace medulla
