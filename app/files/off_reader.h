#pragma once

#include <string>
#include <string_view>

#include "physics/model/triangle_mesh.h"

namespace medulla {

// Object File Format (Geomview) from memory, text only: OFF, COFF, NOFF and their kin, counts on the header's line or
// on the next. Vertices keep their order and number, double precision; polygons are cut into triangles (polygons.h);
// colours and normals are ignored. Coordinates as they stand.
// Throws std::runtime_error "NAME:LINE: ..." on malformed, not finite or out-of-range values, on counts that the file
// does not bear out, and without triangles.
TriangleMesh parseOff(std::string_view text, const std::string& name);

}  // namespace medulla
