#include "assets/shapes/mesh_check.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

namespace medulla {

using Eigen::Vector3d;

double triangleQuality(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const double x = (b - c).norm(), y = (c - a).norm(), z = (a - b).norm(), product = x * y * z;
  return product > 0 ? (y + z - x) * (z + x - y) * (x + y - z) / product : 0;
}

// Half-edges of a closed oriented mesh are unique and come in opposite pairs.
static bool isClosed(const std::vector<std::pair<int, int>>& sortedHalfEdges) {
  for (std::size_t i = 0; i < sortedHalfEdges.size(); ++i) {
    const auto [a, b] = sortedHalfEdges[i];
    if (i > 0 && sortedHalfEdges[i - 1] == sortedHalfEdges[i]) return false;
    if (!std::binary_search(sortedHalfEdges.begin(), sortedHalfEdges.end(), std::pair(b, a))) return false;
  }
  return !sortedHalfEdges.empty();
}

// Walking from one triangle to the next around each vertex must pass all of its triangles.
static bool hasOneFanPerVertex(const TriangleMesh& mesh) {
  std::vector<std::map<int, int>> next(mesh.vertices.size());  // around the key vertex: neighbour -> neighbour
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) next[t[k]][t[(k + 1) % 3]] = t[(k + 2) % 3];
  for (const auto& around : next) {
    if (around.empty()) return false;
    const int first = around.begin()->first;
    int current = first;
    std::size_t passed = 0;
    do {
      const auto found = around.find(current);
      if (found == around.end()) return false;
      current = found->second;
      ++passed;
    } while (current != first && passed <= around.size());
    if (passed != around.size()) return false;
  }
  return true;
}

static int countComponents(const TriangleMesh& mesh) {
  std::vector<int> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  int components = static_cast<int>(mesh.vertices.size());
  for (const auto& t : mesh.triangles) {
    for (int k = 0; k < 2; ++k) {
      const int a = root(t[k]), b = root(t[k + 1]);
      if (a == b) continue;
      parent[a] = b;
      --components;
    }
  }
  return components;
}

MeshCheck checkMesh(const TriangleMesh& mesh) {
  MeshCheck check;
  std::vector<std::pair<int, int>> halfEdges;
  std::vector<double> qualities;
  for (const auto& t : mesh.triangles) {
    const Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    check.volume += a.dot(b.cross(c)) / 6;
    qualities.push_back(triangleQuality(a, b, c));
    for (int k = 0; k < 3; ++k) halfEdges.emplace_back(t[k], t[(k + 1) % 3]);
  }
  if (qualities.empty()) return check;
  std::sort(halfEdges.begin(), halfEdges.end());
  std::sort(qualities.begin(), qualities.end());
  check.closed = isClosed(halfEdges);
  check.manifold = check.closed && hasOneFanPerVertex(mesh);
  check.components = countComponents(mesh);
  const int eulerCharacteristic = static_cast<int>(mesh.vertices.size()) - static_cast<int>(halfEdges.size() / 2) +
                                  static_cast<int>(qualities.size());
  check.genus = check.components - eulerCharacteristic / 2;
  check.qualityMin = qualities.front();
  check.qualityMedian = qualities[qualities.size() / 2];
  return check;
}

double meshLength(const TriangleMesh& mesh) {
  double largest = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      largest = std::max(largest, (mesh.vertices[i] - mesh.vertices[j]).squaredNorm());
  return std::sqrt(largest);
}

}  // namespace medulla
