#pragma once

#include <vector>

#include "physics/model/identify/held_region.h"
#include "physics/model/triangle_mesh.h"

namespace medulla {

// An edge where what is held ends.
struct RimEdge {
  double length = 0;  // m
  double angle = 0;   // rad, of the body, between what is held and the free surface beside
};

// Of held triangles, or of the fans over them where the material behind is held, too.
std::vector<RimEdge> rimOfHeld(const TriangleMesh& mesh, const std::vector<int>& heldTriangles,
                               const std::vector<HeldSpace>& heldSpaces);

// VoxelSolid::give of a rim of this angle (rad), as a rule. Displacements go there as the distance to the power of 0.5
// (a smooth surface, half of it held) to 0.62 (a right angle, at a Poisson's ratio of 0.45: Williams 1952). By how much
// cells follow this too little is the square of the load's stress at the rim times a number, and so is the work that
// springs within a cell of the rim take: what one is of the other depends on element, springs and angle, not on body or
// load.
double usualGive(double angle);
// In the mean of a rim's length; 0 where there is none.
double usualGive(const std::vector<RimEdge>& rim);

}  // namespace medulla
