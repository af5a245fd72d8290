#pragma once

#include "physics/model/soft_body_model.h"
#include "physics/model/triangle_mesh.h"

namespace medulla {

// Skeleton of a closed mesh by edge collapse (Li, Woon, Tan and Huang 2001; paper 2.1). The shortest edge collapses
// into the middle of its ends until no triangle is left; an edge that has lost its triangles is skeletal, and its ends
// stay where they are. Both papers leave open what to do with an edge between two skeletal nodes that still has
// triangles: it collapses too (into its lower node), since leaving it kept loops that the shape does not have. Equal
// lengths: lower node numbers first. At least one node; n log n.
Skeleton collapseEdges(const TriangleMesh& mesh);

}  // namespace medulla
