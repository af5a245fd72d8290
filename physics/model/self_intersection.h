#pragma once

#include <vector>

#include "physics/model/triangle_mesh.h"

namespace medulla {

// Two triangles of one surface that cut through each other.
struct TriangleCut {
  int triangle0 = 0, triangle1 = 0;  // triangle0 < triangle1
  double length = 0;                 // m of their common segment; of coplanar ones half the perimeter of the overlap
};

// Every pair of triangles that cut each other or overlap in one plane, sorted. Triangles that only meet in
// shared vertices and edges or touch in a point do not count, nor do triangles without area; an edge that lies across
// another triangle does, because the surface may go on behind it. Triangle-triangle test
// by intervals on the common line (Moller 1997), broad phase by sweeping along the longest axis.
std::vector<TriangleCut> findSelfIntersections(const TriangleMesh& mesh);

}  // namespace medulla
