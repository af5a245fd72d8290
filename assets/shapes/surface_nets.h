#pragma once

#include "assets/shapes/sdf.h"
#include "physics/model/triangle_mesh.h"

namespace medulla {

// Surface nets (Gibson 1998) of the zero set inside `box`, which must enclose it, on a grid of `spacing` mm; vertices
// are then moved onto the surface. Where two sheets share a cell the net pinches: slightly different spacings are tried
// until the mesh is closed and manifold. Throws std::runtime_error if none is.
TriangleMesh surfaceNets(const SignedDistance& sdf, const Box& box, double spacing);

}  // namespace medulla
