#pragma once

#include <string>
#include <string_view>

#include "physics/model/triangle_mesh.h"

namespace medulla {

// Wavefront OBJ from memory. Vertices keep their order and number in the file, double precision; faces may be given as
// v, v/vt, v//vn or v/vt/vn, counted from 1 or, negative, back from the latest vertex; polygons are cut into
// triangles (polygons.h). Everything but vertices and faces is ignored. Coordinates as they stand.
// Throws std::runtime_error "NAME:LINE: ..." on malformed, not finite or out-of-range values and without triangles.
TriangleMesh parseObj(std::string_view text, const std::string& name);

}  // namespace medulla
