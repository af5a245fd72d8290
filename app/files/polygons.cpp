#include "app/files/polygons.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>

#include "app/files/input_error.h"
#include "physics/model/mesh_topology.h"

namespace medulla {

namespace {

using Eigen::Vector3d;

// Newell's: of the polygon that the fan began as, however it is bent.
Vector3d normalOf(const TriangleMesh& mesh, const std::vector<int>& polygon) {
  Vector3d sum = Vector3d::Zero();
  for (std::size_t k = 2; k < polygon.size(); ++k) sum += areaVector(mesh, {polygon[0], polygon[k - 1], polygon[k]});
  return sum;
}

// Whether the triangle at corner `k` can be cut off: convex, and no other corner in it or on its rim.
bool isEar(const TriangleMesh& mesh, const std::vector<int>& polygon, std::size_t k, const Vector3d& normal) {
  const std::size_t n = polygon.size();
  const int a = polygon[(k + n - 1) % n], b = polygon[k], c = polygon[(k + 1) % n];
  if (!(areaVector(mesh, {a, b, c}).dot(normal) > 0)) return false;
  return std::none_of(polygon.begin(), polygon.end(), [&](int p) {
    for (const int own : {a, b, c})
      if (mesh.vertices[p] == mesh.vertices[own]) return false;
    return areaVector(mesh, {a, b, p}).dot(normal) >= 0 && areaVector(mesh, {b, c, p}).dot(normal) >= 0 &&
           areaVector(mesh, {c, a, p}).dot(normal) >= 0;
  });
}

// Empty where the polygon cuts itself.
std::vector<std::array<int, 3>> cutIntoEars(const TriangleMesh& mesh, std::vector<int> polygon,
                                            const Vector3d& normal) {
  std::vector<std::array<int, 3>> out;
  while (polygon.size() > 3) {
    std::size_t k = 0;
    while (k < polygon.size() && !isEar(mesh, polygon, k, normal)) ++k;
    if (k == polygon.size()) return {};
    const std::size_t n = polygon.size();
    out.push_back({polygon[(k + n - 1) % n], polygon[k], polygon[(k + 1) % n]});
    polygon.erase(polygon.begin() + static_cast<std::ptrdiff_t>(k));
  }
  out.push_back({polygon[0], polygon[1], polygon[2]});
  return out;
}

}  // namespace

void Polygons::add(const std::vector<int>& corners, TriangleMesh& mesh) {
  if (corners.size() > 3) fans_.push_back({mesh.triangles.size(), static_cast<int>(corners.size())});
  for (std::size_t k = 2; k < corners.size(); ++k) mesh.triangles.push_back({corners[0], corners[k - 1], corners[k]});
}

void Polygons::cutConcave(const std::string& file, TriangleMesh& mesh) const {
  constexpr int kMostCorners = 1000;  // the time goes with their cube
  for (const Fan& fan : fans_) {
    const auto first = mesh.triangles.begin() + static_cast<std::ptrdiff_t>(fan.firstTriangle);
    const auto end = first + (fan.corners - 2);
    std::vector<int> polygon{(*first)[0], (*first)[1]};
    for (auto t = first; t != end; ++t) polygon.push_back((*t)[2]);
    const Vector3d normal = normalOf(mesh, polygon);
    const bool folds =
        std::any_of(first, end, [&](const std::array<int, 3>& t) { return areaVector(mesh, t).dot(normal) < 0; });
    if (!folds) continue;
    if (fan.corners > kMostCorners)
      throw inputError(
          file, 0,
          fmt::format("a concave face of {} corners, expected at most {}: cut it up", fan.corners, kMostCorners));
    const std::vector<std::array<int, 3>> ears = cutIntoEars(mesh, polygon, normal);
    std::copy(ears.begin(), ears.end(), first);
  }
}

}  // namespace medulla
