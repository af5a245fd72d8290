#pragma once

#include <string>

#include "physics/dynamics/region.h"
#include "physics/model/identify/held_region.h"
#include "physics/model/soft_body_model.h"

namespace medulla {

// What medulla build --fix names, as a scene's <fix> does: "box=x0,y0,z0,x1,y1,z1", "sphere=x,y,z,r",
// "plane=nx,ny,nz,d" (holds n.x <= d), in metres of the mesh, or "vertices=FILE.csv", vertices of the mesh file.
// A part of space holds what lies behind its triangles, too; vertices hold the surface between them.
// Throws std::runtime_error on anything else.
HeldRegion parseHeldRegion(const std::string& text, const SoftBodyModel& model);

// FILE of "vertices=FILE", else nothing.
std::string vertexFileOf(const std::string& text);

// The text of a part of space; it reads back as the same bits.
std::string regionText(const Region& region);

}  // namespace medulla
