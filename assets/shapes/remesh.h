#pragma once

#include "assets/shapes/sdf.h"
#include "physics/model/triangle_mesh.h"

namespace medulla {

struct RemeshSettings {
  int triangles = 1000;           // exactly as many come out; even
  double fullSizeRadius = 15;     // mm; where the surface bends tighter than this, edges shrink with sqrt(radius)
  double smallestRelative = 0.4;  // 0..1, limit of that; 1 makes all edges equally long
  bool keepRims = false;          // vertices of rims thinner than an edge stay on their crest: for fins
};

// Isotropic remeshing (Botsch and Kobbelt 2004) of a closed mesh onto the zero set that it approximates: split long
// edges, collapse short ones, flip towards valence 6 and good shape, smooth along the surface, project. Edge lengths
// follow curvature; then single splits or collapses reach the exact count.
// Throws std::runtime_error if the count cannot be reached.
TriangleMesh remesh(const TriangleMesh& start, const SignedDistance& sdf, const RemeshSettings& settings);

}  // namespace medulla
