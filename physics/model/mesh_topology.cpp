#include "physics/model/mesh_topology.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "physics/model/disjoint_sets.h"
#include "physics/sort_unique.h"

namespace medulla {

namespace {

// One side of a triangle, keyed so that sorting brings the triangles of one edge together, in order of triangle.
struct Side {
  int low, high, triangle, corner;
  bool operator<(const Side& o) const {
    if (low != o.low) return low < o.low;
    if (high != o.high) return high < o.high;
    return triangle != o.triangle ? triangle < o.triangle : corner < o.corner;
  }
};

std::vector<Side> sortedSides(const TriangleMesh& mesh) {
  std::vector<Side> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) {
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = edgeOf(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]);
      sides.push_back({low, high, t, k});
    }
  }
  std::sort(sides.begin(), sides.end());
  return sides;
}

// Calls visit(sides of one edge) for every edge.
template <typename Visit>
void forEachEdge(const std::vector<Side>& sides, const Visit& visit) {
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    while (end < sides.size() && sides[end].low == sides[begin].low && sides[end].high == sides[begin].high) ++end;
    visit(std::span(sides.data() + begin, end - begin));
  }
}

}  // namespace

// A counting sort.
IndexLists gather(int lists, const std::vector<std::array<int, 2>>& pairs) {
  IndexLists out;
  out.first.assign(lists + 1, 0);
  out.item.resize(pairs.size());
  for (const auto& pair : pairs) ++out.first[pair[0] + 1];
  for (int i = 0; i < lists; ++i) out.first[i + 1] += out.first[i];
  std::vector<int> next(out.first.begin(), out.first.end() - 1);
  for (const auto& pair : pairs) out.item[next[pair[0]]++] = pair[1];
  return out;
}

std::vector<std::array<int, 2>> uniqueEdges(const TriangleMesh& mesh) {
  std::vector<std::array<int, 2>> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) edges.push_back(edgeOf(t[k], t[(k + 1) % 3]));
  sortUnique(edges);
  return edges;
}

IndexLists trianglesOfVertices(const TriangleMesh& mesh) {
  std::vector<std::array<int, 2>> pairs;
  pairs.reserve(3 * mesh.triangles.size());
  for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t)
    for (const int v : mesh.triangles[t]) pairs.push_back({v, t});
  return gather(static_cast<int>(mesh.vertices.size()), pairs);
}

std::vector<std::array<int, 3>> adjacentTriangles(const TriangleMesh& mesh) {
  std::vector<std::array<int, 3>> adjacent(mesh.triangles.size(), {-1, -1, -1});
  forEachEdge(sortedSides(mesh), [&adjacent](std::span<const Side> sides) {
    if (sides.size() != 2) return;
    adjacent[sides[0].triangle][sides[0].corner] = sides[1].triangle;
    adjacent[sides[1].triangle][sides[1].corner] = sides[0].triangle;
  });
  return adjacent;
}

std::vector<std::array<int, 3>> trianglesOnEdges(const TriangleMesh& mesh) {
  std::vector<std::array<int, 3>> count(mesh.triangles.size());
  forEachEdge(sortedSides(mesh), [&count](std::span<const Side> sides) {
    for (const Side& side : sides) count[side.triangle][side.corner] = static_cast<int>(sides.size());
  });
  return count;
}

double surfaceArea(const TriangleMesh& mesh) {
  double area = 0;
  for (const auto& t : mesh.triangles) area += areaVector(mesh, t).norm();
  return area;
}

std::vector<double> vertexAreas(const TriangleMesh& mesh) {
  std::vector<double> areas(mesh.vertices.size(), 0);
  for (const auto& t : mesh.triangles) {
    const double third = areaVector(mesh, t).norm() / 3;
    for (const int v : t) areas[v] += third;
  }
  return areas;
}

std::vector<Eigen::Vector3d> vertexNormals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> normals(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d area = areaVector(mesh, t);
    for (const int v : t) normals[v] += area;
  }
  for (auto& normal : normals) normal.normalize();  // Eigen leaves a zero vector alone
  return normals;
}

double enclosedVolume(const TriangleMesh& mesh) {
  // About the first vertex: far from the origin the terms would cancel badly.
  double volume = 0;
  for (const auto& t : mesh.triangles) volume += areaVector(mesh, t).dot(mesh.vertices[t[0]] - mesh.vertices[0]) / 3;
  return volume;
}

Eigen::AlignedBox3d boundsOf(const std::vector<Eigen::Vector3d>& points) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : points) box.extend(point);
  return box;
}

double boundsDiagonal(const TriangleMesh& mesh) {
  return mesh.vertices.empty() ? 0 : boundsOf(mesh.vertices).diagonal().norm();
}

std::vector<int> componentOfTriangles(const TriangleMesh& mesh, int& components) {
  // Edges of three and more triangles connect too, which adjacentTriangles would not tell.
  DisjointSets sets(mesh.triangles.size());
  forEachEdge(sortedSides(mesh), [&sets](std::span<const Side> sides) {
    for (const Side& side : sides) sets.join(sides[0].triangle, side.triangle);
  });
  components = 0;
  std::vector<int> component(mesh.triangles.size());
  for (int t = 0; t < static_cast<int>(component.size()); ++t) {
    const int r = sets.of(t);
    component[t] = r == t ? components++ : component[r];
  }
  return component;
}

double solidAngle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                  const Eigen::Vector3d& point) {
  const Eigen::Vector3d toA = a - point, toB = b - point, toC = c - point;
  const double la = toA.norm(), lb = toB.norm(), lc = toC.norm();
  return 2 *
         std::atan2(toA.dot(toB.cross(toC)), la * lb * lc + toA.dot(toB) * lc + toB.dot(toC) * la + toC.dot(toA) * lb);
}

}  // namespace medulla
