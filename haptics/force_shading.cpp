#include "haptics/force_shading.h"

#include <Eigen/Geometry>

namespace medulla {

using Eigen::Vector3d;

constexpr double kCosineOfCrease = 0.7316888688738209;  // cos 0.75

std::vector<char> nodesOnCreases(const TriangleMesh& rest) {
  constexpr double cosineOfEdge = 0.36;  // 69 degrees: a tube of six sides is still round, a box is not, by far
  std::vector<char> isCrease(rest.vertices.size(), 0);
  std::vector<Vector3d> normals;
  for (const std::array<int, 3>& nodes : rest.triangles) normals.push_back(areaVector(rest, nodes).stableNormalized());
  const std::vector<std::array<int, 3>> adjacent = adjacentTriangles(rest);
  for (std::size_t t = 0; t < rest.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      if (adjacent[t][k] < 0 || normals[t].dot(normals[adjacent[t][k]]) > cosineOfEdge) continue;
      isCrease[rest.triangles[t][k]] = isCrease[rest.triangles[t][(k + 1) % 3]] = 1;
    }
  return isCrease;
}

// Weighted by area; unit, or zero where all triangles are degenerate.
static Vector3d nodeNormal(const BlendedSurface& surface, double alpha, int node) {
  Vector3d sum = Vector3d::Zero();
  const IndexLists& lists = surface.trianglesOfNodes;
  for (int k = lists.first[node]; k < lists.first[node + 1]; ++k)
    sum += doubleArea(surface.triangle(lists.item[k], alpha));
  return sum.stableNormalized();
}

Vector3d shadedNormal(const BlendedSurface& surface, double alpha, int triangle, const Vector3d& weights,
                      const Vector3d& normal) {
  Vector3d face = doubleArea(surface.triangle(triangle, alpha)).stableNormalized();
  // Triangles are touched from behind, too: by a tool in a cavity whose wall is wound to the outside.
  const double side = face.dot(normal) < 0 ? -1 : 1;
  face *= side;
  Vector3d sum = Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const int node = surface.triangles[triangle][k];
    const Vector3d corner = surface.isCrease[node] ? normal : Vector3d(side * nodeNormal(surface, alpha, node));
    sum += weights[k] * (corner.dot(face) > kCosineOfCrease ? corner : normal);
  }
  sum = sum.stableNormalized();
  return sum.dot(normal) > kCosineOfCrease ? sum : normal;
}

}  // namespace medulla
