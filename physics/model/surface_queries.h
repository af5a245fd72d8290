#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <vector>

#include "physics/model/triangle_mesh.h"

// Exact point and segment queries against a closed surface: a bounding-box tree with all arithmetic in double. Native
// ray-tracing hits are float and differ between instruction sets, and a model has to be the same to the byte.
namespace medulla {

struct SurfaceTree {
  struct Node {
    Eigen::Vector3d low, high;
    int left = -1, right = -1;  // children, or -1 in a leaf
    int begin = 0, end = 0;     // leaf: range of `triangles`
  };
  std::vector<Node> nodes;                              // root first
  std::vector<std::array<int, 3>> triangles;            // vertex numbers of the mesh, in leaf order
  std::vector<std::array<Eigen::Vector3d, 3>> corners;  // of `triangles`, m
};

SurfaceTree makeSurfaceTree(const TriangleMesh& mesh);

struct SurfacePoint {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();            // m
  double distance = std::numeric_limits<double>::infinity();  // m; infinity where nothing lies within the bound
};

// The point of the surface nearest to p, if one lies nearer than `within` (m).
SurfacePoint closestPoint(const SurfaceTree& tree, const Eigen::Vector3d& p,
                          double within = std::numeric_limits<double>::infinity());

// The point of the triangle nearest to p.
Eigen::Vector3d closestOnTriangle(const Eigen::Vector3d& p, const std::array<Eigen::Vector3d, 3>& corners);

struct TriangleDistance {
  int triangle = 0;     // in leaf order
  double distance = 0;  // m
};

// Appends every triangle nearer than `within` (m) to p, the nearest first.
void trianglesWithin(const SurfaceTree& tree, const Eigen::Vector3d& p, double within,
                     std::vector<TriangleDistance>& out);

// Parity of crossings, the majority of three skew rays: one ray may graze an edge.
bool isInside(const SurfaceTree& tree, const Eigen::Vector3d& p);

// Radius of the largest ball about p inside the surface; 0 where p is outside. m.
double inscribedRadius(const SurfaceTree& tree, const Eigen::Vector3d& p);

// Distance along the unit `direction` to the first hit nearer than `reach`; infinity where there is none. m.
double firstHit(const SurfaceTree& tree, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double reach);

// Whether the open segment from `inner` to the vertex `vertex` at `outer` crosses the surface. Triangles at that vertex
// touch the segment at its end alone and are left out.
bool segmentCrosses(const SurfaceTree& tree, const Eigen::Vector3d& inner, const Eigen::Vector3d& outer, int vertex);

}  // namespace medulla
