#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "physics/model/triangle_mesh.h"

namespace medulla {

// A part of the surface that is to be held.
struct HeldRegion {
  std::string text;                                      // FixedPatch::region
  std::vector<int> nodes;                                // of the model, ascending
  std::function<bool(const Eigen::Vector3d&)> contains;  // a part of space: the material there is held, too; or empty
};

// Triangles with all corners in the region, ascending. Throws std::runtime_error where there is none.
std::vector<int> wholeTriangles(const TriangleMesh& mesh, const HeldRegion& region);

// The material in the regions that is nearer to the triangles held there than to all others: what lies behind them,
// where a region ends within a triangle, too. Empty where no region is a part of space. `triangles`: of each region.
// Throws std::runtime_error where a region holds the whole surface.
std::function<bool(const Eigen::Vector3d&)> heldMaterial(const TriangleMesh& mesh,
                                                         const std::vector<HeldRegion>& regions,
                                                         const std::vector<std::vector<int>>& triangles);

}  // namespace medulla
