#pragma once

#include "physics/model/triangle_mesh.h"

namespace medulla {

struct MeshCheck {
  bool closed = false;    // every edge has two triangles that run through it in opposite directions
  bool manifold = false;  // and every vertex one fan of triangles
  int components = 0;
  int genus = 0;                             // summed over the components; 0: a ball each
  double qualityMin = 0, qualityMedian = 0;  // see triangleQuality
  double volume = 0;                         // negative where the triangles are wound inwards
};

// 2 x inradius / circumradius: 1 equilateral, 0 degenerate.
double triangleQuality(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);

MeshCheck checkMesh(const TriangleMesh& mesh);

// Largest distance between two vertices.
double meshLength(const TriangleMesh& mesh);

}  // namespace medulla
