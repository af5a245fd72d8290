#pragma once

#include <array>
#include <vector>

#include "physics/model/triangle_mesh.h"

namespace medulla {

// A closed triangle mesh that can be split, collapsed and flipped. Removed triangles and vertices keep their index:
// a removed triangle has vertex -1, a removed vertex no triangles.
struct EditableMesh {
  std::vector<Eigen::Vector3d> positions;
  std::vector<std::array<int, 3>> triangles;
  std::vector<std::vector<int>> trianglesOf;  // per vertex
};

// The two triangles at an edge and the vertices opposite to it. The first triangle runs through the edge from a to b.
// `valid` is false for anything but an edge of exactly two triangles.
struct EdgeSides {
  bool valid = false;
  std::array<int, 2> triangle{}, opposite{};
};

EditableMesh makeEditable(const TriangleMesh& mesh);
TriangleMesh withoutGaps(const EditableMesh& mesh);

int triangleCount(const EditableMesh& mesh);
std::vector<std::array<int, 2>> edgesOf(const EditableMesh& mesh);    // lower vertex first, in the triangles' order
std::vector<int> neighboursOf(const EditableMesh& mesh, int vertex);  // sorted
EdgeSides sidesOf(const EditableMesh& mesh, int a, int b);
int valence(const EditableMesh& mesh, int vertex);

// Twice the area times the unit normal.
Eigen::Vector3d doubleAreaVector(const EditableMesh& mesh, int triangle);
double quality(const EditableMesh& mesh, int triangle);

// Puts a new vertex on the edge and returns it.
int splitEdge(EditableMesh& mesh, const EdgeSides& sides, int a, int b, const Eigen::Vector3d& position);

// Merges a into b at `position`. Allowed where it leaves a manifold: the link condition (Dey et al. 1999) and no vertex
// with fewer than four triangles.
bool mayCollapse(const EditableMesh& mesh, const EdgeSides& sides, int a, int b);
void collapseEdge(EditableMesh& mesh, const EdgeSides& sides, int a, int b, const Eigen::Vector3d& position);

// Turns the edge so that it joins the opposite vertices.
bool mayFlip(const EditableMesh& mesh, const EdgeSides& sides, int a, int b);
void flipEdge(EditableMesh& mesh, const EdgeSides& sides, int a, int b);

}  // namespace medulla
