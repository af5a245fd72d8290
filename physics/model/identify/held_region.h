#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "physics/model/triangle_mesh.h"

namespace medulla {

// A part of the surface that is to be held.
struct HeldRegion {
  std::string text;        // FixedPatch::region
  std::vector<int> nodes;  // of the model, ascending
  bool isSpace = false;    // holds what lies behind its triangles, too
};

// Of each region its triangles, ascending: those with all corners in it and, since a run holds nodes, those with all
// corners in several regions together, which count to the one with most of them. Throws std::runtime_error where a
// region has none, or where they are the whole surface.
std::vector<std::vector<int>> heldTriangles(const TriangleMesh& mesh, const std::vector<HeldRegion>& regions);

// Of each node of the mesh, whether it is a corner of one of the triangles.
std::vector<bool> nodesOfTriangles(const TriangleMesh& mesh, const std::vector<int>& triangles);

// Directed edges of triangles that no other of them has the other way round, ascending.
std::vector<std::pair<int, int>> rimOf(const TriangleMesh& mesh, const std::vector<int>& triangles);

// The material behind triangles that are held: as far as a fan over each of their rims, about the rim's middle.
struct HeldSpace {
  TriangleMesh surface;  // closed: the held triangles, then the fans
  int firstFan = 0;      // of `surface.triangles`
};

// Of every region that is a part of space. `triangles`: of each region.
std::vector<HeldSpace> heldSpaces(const TriangleMesh& mesh, const std::vector<HeldRegion>& regions,
                                  const std::vector<std::vector<int>>& triangles);

// Whether a point of the body lies in one of them. `spaces` are copied.
std::function<bool(const Eigen::Vector3d&)> behindHeld(const std::vector<HeldSpace>& spaces);

}  // namespace medulla
