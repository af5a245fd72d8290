#pragma once

#include <string>
#include <string_view>

#include "physics/model/triangle_mesh.h"

namespace medulla {

// Text or binary STL (3D Systems, 1989). Corners at the same place are one vertex, in the order of the file; facet
// normals, names and colours are stepped over, degenerate facets stay. `name` is the path that errors begin with.
// Throws std::runtime_error "NAME:LINE: ...", without the line for a binary file, where facets are not whole, a
// coordinate is no finite number, a file ends early or holds more than it counts, and without triangles.
TriangleMesh parseStl(std::string_view bytes, const std::string& name);

}  // namespace medulla
