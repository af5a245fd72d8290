#include "assets/shapes/editable_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "assets/shapes/mesh_check.h"

namespace medulla {

using Eigen::Vector3d;

EditableMesh makeEditable(const TriangleMesh& mesh) {
  EditableMesh editable{mesh.vertices, mesh.triangles, std::vector<std::vector<int>>(mesh.vertices.size())};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const int v : mesh.triangles[t]) editable.trianglesOf[v].push_back(static_cast<int>(t));
  return editable;
}

TriangleMesh withoutGaps(const EditableMesh& mesh) {
  TriangleMesh result;
  std::vector<int> newIndex(mesh.positions.size(), -1);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    if (mesh.trianglesOf[v].empty()) continue;
    newIndex[v] = static_cast<int>(result.vertices.size());
    result.vertices.push_back(mesh.positions[v]);
  }
  for (const auto& t : mesh.triangles)
    if (t[0] >= 0) result.triangles.push_back({newIndex[t[0]], newIndex[t[1]], newIndex[t[2]]});
  return result;
}

int triangleCount(const EditableMesh& mesh) {
  return static_cast<int>(
      std::count_if(mesh.triangles.begin(), mesh.triangles.end(), [](const auto& t) { return t[0] >= 0; }));
}

std::vector<std::array<int, 2>> edgesOf(const EditableMesh& mesh) {
  std::vector<std::array<int, 2>> edges;
  for (const auto& t : mesh.triangles) {
    if (t[0] < 0) continue;
    for (int k = 0; k < 3; ++k)
      if (t[k] < t[(k + 1) % 3]) edges.push_back({t[k], t[(k + 1) % 3]});
  }
  return edges;
}

std::vector<int> neighboursOf(const EditableMesh& mesh, int vertex) {
  std::vector<int> neighbours;
  for (const int t : mesh.trianglesOf[vertex])
    for (const int v : mesh.triangles[t])
      if (v != vertex) neighbours.push_back(v);
  std::sort(neighbours.begin(), neighbours.end());
  neighbours.erase(std::unique(neighbours.begin(), neighbours.end()), neighbours.end());
  return neighbours;
}

EdgeSides sidesOf(const EditableMesh& mesh, int a, int b) {
  EdgeSides sides;
  std::array<int, 2> found = {0, 0};
  for (const int t : mesh.trianglesOf[a]) {
    const auto& v = mesh.triangles[t];
    for (int k = 0; k < 3; ++k) {
      const int from = v[k], to = v[(k + 1) % 3];
      const int side = from == a && to == b ? 0 : from == b && to == a ? 1 : -1;
      if (side < 0) continue;
      sides.triangle[side] = t;
      sides.opposite[side] = v[(k + 2) % 3];
      ++found[side];
    }
  }
  sides.valid = found[0] == 1 && found[1] == 1 && sides.opposite[0] != sides.opposite[1];
  return sides;
}

int valence(const EditableMesh& mesh, int vertex) {
  return static_cast<int>(mesh.trianglesOf[vertex].size());
}

Vector3d doubleAreaVector(const EditableMesh& mesh, int triangle) {
  const auto& t = mesh.triangles[triangle];
  const Vector3d& a = mesh.positions[t[0]];
  return (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a);
}

double quality(const EditableMesh& mesh, int triangle) {
  const auto& t = mesh.triangles[triangle];
  return triangleQuality(mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]);
}

static void removeTriangle(EditableMesh& mesh, int triangle) {
  for (int& v : mesh.triangles[triangle]) {
    auto& around = mesh.trianglesOf[v];
    around.erase(std::find(around.begin(), around.end(), triangle));
    v = -1;
  }
}

static void addTriangle(EditableMesh& mesh, int a, int b, int c) {
  for (const int v : {a, b, c}) mesh.trianglesOf[v].push_back(static_cast<int>(mesh.triangles.size()));
  mesh.triangles.push_back({a, b, c});
}

int splitEdge(EditableMesh& mesh, const EdgeSides& sides, int a, int b, const Vector3d& position) {
  const int middle = static_cast<int>(mesh.positions.size());
  mesh.positions.push_back(position);
  mesh.trianglesOf.emplace_back();
  for (const int t : sides.triangle) removeTriangle(mesh, t);
  addTriangle(mesh, a, middle, sides.opposite[0]);
  addTriangle(mesh, middle, b, sides.opposite[0]);
  addTriangle(mesh, b, middle, sides.opposite[1]);
  addTriangle(mesh, middle, a, sides.opposite[1]);
  return middle;
}

bool mayCollapse(const EditableMesh& mesh, const EdgeSides& sides, int a, int b) {
  const std::vector<int> aroundA = neighboursOf(mesh, a), aroundB = neighboursOf(mesh, b);
  std::vector<int> common;
  std::set_intersection(aroundA.begin(), aroundA.end(), aroundB.begin(), aroundB.end(), std::back_inserter(common));
  return common.size() == 2 && valence(mesh, a) + valence(mesh, b) >= 8 && valence(mesh, sides.opposite[0]) > 4 &&
         valence(mesh, sides.opposite[1]) > 4;
}

void collapseEdge(EditableMesh& mesh, const EdgeSides& sides, int a, int b, const Vector3d& position) {
  for (const int t : sides.triangle) removeTriangle(mesh, t);
  for (const int t : mesh.trianglesOf[a]) {
    std::replace(mesh.triangles[t].begin(), mesh.triangles[t].end(), a, b);
    mesh.trianglesOf[b].push_back(t);
  }
  mesh.trianglesOf[a].clear();
  mesh.positions[b] = position;
}

bool mayFlip(const EditableMesh& mesh, const EdgeSides& sides, int a, int b) {
  return valence(mesh, a) > 4 && valence(mesh, b) > 4 && !sidesOf(mesh, sides.opposite[0], sides.opposite[1]).valid;
}

void flipEdge(EditableMesh& mesh, const EdgeSides& sides, int a, int b) {
  const auto [c, d] = sides.opposite;
  for (const int t : sides.triangle) removeTriangle(mesh, t);
  addTriangle(mesh, c, d, b);
  addTriangle(mesh, d, c, a);
}

}  // namespace medulla
