#include "haptics/force_shading.h"

#include <Eigen/Geometry>

namespace medulla {

using Eigen::Vector3d;

constexpr double kCosineOfCrease = 0.7316888688738209;  // cos 0.75

static Vector3d doubleArea(const Triangle& t) {
  return (t.b - t.a).cross(t.c - t.a);
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
    const Vector3d corner = side * nodeNormal(surface, alpha, surface.triangles[triangle][k]);
    sum += weights[k] * (corner.dot(face) > kCosineOfCrease ? corner : normal);
  }
  sum = sum.stableNormalized();
  return sum.dot(normal) > kCosineOfCrease ? sum : normal;
}

}  // namespace medulla
