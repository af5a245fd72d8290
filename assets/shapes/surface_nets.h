#pragma once

#include "assets/shapes/sdf.h"
#include "physics/model/triangle_mesh.h"

namespace medulla {

// Surface nets (Gibson 1998) of the zero set inside `box`, which must enclose it, on a grid of `spacing` mm, with one
// vertex per sheet in a cell (Nielson 2004, dual marching cubes); vertices are then moved onto the surface. The rare
// edge that still pinches is avoided by a slightly different spacing. Throws std::runtime_error if none of six gives
// one closed manifold surface.
TriangleMesh surfaceNets(const SignedDistance& sdf, const Box& box, double spacing);

}  // namespace medulla
