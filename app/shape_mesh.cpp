#include "app/shape_mesh.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace medulla {

using Eigen::Vector3d;

// A parallelogram of n x n cells, facing along u x v. `place` takes 0..1 along a side to 0..1.
template <class Place>
static void addPatch(TriangleMesh& mesh, const Vector3d& corner, const Vector3d& u, const Vector3d& v, int n,
                     const Place& place) {
  const int first = static_cast<int>(mesh.vertices.size());
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) mesh.vertices.push_back(corner + u * place(double(i) / n) + v * place(double(j) / n));
  const auto id = [&](int i, int j) { return first + i * (n + 1) + j; };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      mesh.triangles.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
      mesh.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
    }
  }
}

// Colour is per vertex: so many cells per metre show a look's pattern.
constexpr double kCellsPerMetre = 64;
constexpr int kFewestCells = 8, kMostCells = 96;

// Faces share no vertices: edges stay sharp where normals are averaged at vertices.
static TriangleMesh boxMesh(const Vector3d& size) {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const int a = (axis + 1) % 3, b = (axis + 2) % 3;
      Vector3d u = size[a] * Vector3d::Unit(a), v = size[b] * Vector3d::Unit(b);
      if (side < 0) std::swap(u, v);
      const int cells =
          std::clamp(static_cast<int>(kCellsPerMetre * std::max(u.norm(), v.norm())), kFewestCells, kMostCells);
      addPatch(mesh, 0.5 * (side * size[axis] * Vector3d::Unit(axis) - u - v), u, v, cells, [](double s) { return s; });
    }
  }
  return mesh;
}

// Cells are a third as wide in the middle, where bodies are, as uniform ones would be, and wider outwards.
static TriangleMesh planeMesh(double side) {
  constexpr double kGrading = 3;
  const auto place = [](double s) { return 0.5 + 0.5 * std::sinh(kGrading * (2 * s - 1)) / std::sinh(kGrading); };
  TriangleMesh mesh;
  addPatch(mesh, Vector3d(-0.5 * side, 0, -0.5 * side), side * Vector3d::UnitZ(), side * Vector3d::UnitX(), kMostCells,
           place);
  return mesh;
}

static TriangleMesh sphereMesh(double radius) {
  constexpr int kRings = 32, kSegments = 64;
  TriangleMesh mesh;
  mesh.vertices.emplace_back(0, radius, 0);
  for (int r = 1; r < kRings; ++r) {
    const double polar = std::numbers::pi * r / kRings;
    for (int s = 0; s < kSegments; ++s) {
      const double around = 2 * std::numbers::pi * s / kSegments;
      mesh.vertices.push_back(
          radius * Vector3d(std::sin(polar) * std::sin(around), std::cos(polar), std::sin(polar) * std::cos(around)));
    }
  }
  mesh.vertices.emplace_back(0, -radius, 0);
  const auto id = [](int ring, int s) { return 1 + (ring - 1) * kSegments + s % kSegments; };
  const int last = static_cast<int>(mesh.vertices.size()) - 1;
  for (int s = 0; s < kSegments; ++s) {
    mesh.triangles.push_back({0, id(1, s), id(1, s + 1)});
    mesh.triangles.push_back({last, id(kRings - 1, s + 1), id(kRings - 1, s)});
    for (int r = 1; r + 1 < kRings; ++r) {
      mesh.triangles.push_back({id(r, s), id(r + 1, s), id(r + 1, s + 1)});
      mesh.triangles.push_back({id(r, s), id(r + 1, s + 1), id(r, s + 1)});
    }
  }
  return mesh;
}

TriangleMesh shapeMesh(const StaticShape& shape, double sceneSize) {
  switch (shape.kind) {
    case StaticShape::Kind::plane:
      return planeMesh(std::max(1.0, 4 * sceneSize));
    case StaticShape::Kind::box:
      return boxMesh(shape.size);
    case StaticShape::Kind::sphere:
      return sphereMesh(shape.radius);
    case StaticShape::Kind::mesh:
      break;
  }
  assert(false && "a mesh comes from its file");
  return {};
}

}  // namespace medulla
