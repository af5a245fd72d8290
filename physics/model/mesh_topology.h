#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <vector>

#include "physics/model/triangle_mesh.h"

// Questions about a triangle surface that more than one stage of model building asks. Pure functions; indices must be
// in range. Lengths in the unit of the mesh (metres).
namespace medulla {

// Lists of differing lengths in one array: list i is item[first[i]] .. item[first[i + 1] - 1].
struct IndexLists {
  std::vector<int> first;  // number of lists + 1
  std::vector<int> item;
};

// The lists of (list, item) pairs; items keep their order within a list.
IndexLists gather(int lists, const std::vector<std::array<int, 2>>& pairs);

// Of two vertices, the lower first.
inline std::array<int, 2> edgeOf(int a, int b) {
  return {std::min(a, b), std::max(a, b)};
}

// Every edge once, sorted.
std::vector<std::array<int, 2>> uniqueEdges(const TriangleMesh& mesh);

// Triangles around each vertex, ascending.
IndexLists trianglesOfVertices(const TriangleMesh& mesh);

// The triangle across each triangle's edges: entry k of a triangle lies across its edge (corner k, corner k + 1).
// -1 where that edge does not belong to exactly two triangles.
std::vector<std::array<int, 3>> adjacentTriangles(const TriangleMesh& mesh);

// Half the cross product of two edges: length = area, direction = normal by the winding.
inline Eigen::Vector3d areaVector(const TriangleMesh& mesh, const std::array<int, 3>& triangle) {
  const Eigen::Vector3d& a = mesh.vertices[triangle[0]];
  return 0.5 * (mesh.vertices[triangle[1]] - a).cross(mesh.vertices[triangle[2]] - a);
}

inline Eigen::Vector3d centroid(const TriangleMesh& mesh, const std::array<int, 3>& triangle) {
  return (mesh.vertices[triangle[0]] + mesh.vertices[triangle[1]] + mesh.vertices[triangle[2]]) / 3;
}

inline double longestEdge(const TriangleMesh& mesh, const std::array<int, 3>& triangle) {
  const Eigen::Vector3d &a = mesh.vertices[triangle[0]], &b = mesh.vertices[triangle[1]],
                        &c = mesh.vertices[triangle[2]];
  return std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
}

// How many triangles share each triangle's edges: entry k counts those on (corner k, corner k + 1), itself included.
// 1 at an opening, 2 on a manifold edge.
std::vector<std::array<int, 3>> trianglesOnEdges(const TriangleMesh& mesh);

// Calls visit(i, j, area, squaredLength) for the edges i to j of every triangle, with its area (m2): an edge between
// two triangles comes twice. Springs on edges as stiff as a sheet sum area / squaredLength (Van Gelder 1998).
template <class Visit>
void visitEdges(const TriangleMesh& mesh, const Visit& visit) {
  for (const std::array<int, 3>& t : mesh.triangles) {
    const double area = areaVector(mesh, t).norm();
    for (int k = 0; k < 3; ++k) {
      const int i = t[k], j = t[(k + 1) % 3];
      visit(i, j, area, (mesh.vertices[j] - mesh.vertices[i]).squaredNorm());
    }
  }
}

// m2; the whole surface.
double surfaceArea(const TriangleMesh& mesh);

// m2 per vertex: a third of the triangles around it.
std::vector<double> vertexAreas(const TriangleMesh& mesh);

// Unit normal per vertex, area weighted; zero where the triangles around it cancel or have no area.
std::vector<Eigen::Vector3d> vertexNormals(const TriangleMesh& mesh);

// m3 by the divergence theorem: positive when a closed surface is wound outward, cavities subtract.
double enclosedVolume(const TriangleMesh& mesh);

// The axis-aligned box around all; empty without points.
Eigen::AlignedBox3d boundsOf(const std::vector<Eigen::Vector3d>& points);

// m; the box's diagonal, 0 without vertices.
double boundsDiagonal(const TriangleMesh& mesh);

// Component of every triangle, connected through shared edges, numbered by its first triangle; count in `components`.
std::vector<int> componentOfTriangles(const TriangleMesh& mesh, int& components);

// Solid angle under which a point sees the triangle a, b, c (Van Oosterom and Strackee 1983), signed by the winding:
// positive from behind. In steradian; over a closed surface wound outward they sum to 4 pi inside and to 0 outside.
double solidAngle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                  const Eigen::Vector3d& point);
inline double solidAngle(const TriangleMesh& mesh, const std::array<int, 3>& triangle, const Eigen::Vector3d& point) {
  return solidAngle(mesh.vertices[triangle[0]], mesh.vertices[triangle[1]], mesh.vertices[triangle[2]], point);
}

}  // namespace medulla
