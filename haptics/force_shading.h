#pragma once

#include "haptics/buckets.h"

// Force shading (Ruspini, Kolarov and Khatib 1997, 4.3; Morgenbesser and Srinivasan 1996): a coarse mesh feels like the
// smooth surface that it stands for, by normals interpolated between its nodes.
namespace medulla {

// Per node of a surface as a run begins: whether the triangles at one of its edges stand more than 69 degrees apart.
// Asked of each triangle alone, by its nodes' mean normals, an unevenly meshed edge is a crease on its one side and
// smooth on the other.
std::vector<char> nodesOnCreases(const TriangleMesh& rest);

// The smooth surface's unit normal at a point of a triangle, given by its barycentric weights, where a sphere is
// touched along the unit `normal` (from the point to the sphere's centre). On a crease, and where its normal is more
// than 0.75 rad off the triangle's, as on a spike, a node has `normal` instead: a box stays a box.
Eigen::Vector3d shadedNormal(const BlendedSurface& surface, double alpha, int triangle, const Eigen::Vector3d& weights,
                             const Eigen::Vector3d& normal);

}  // namespace medulla
