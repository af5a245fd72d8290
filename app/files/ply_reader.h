#pragma once

#include <string>
#include <string_view>

#include "physics/model/triangle_mesh.h"

namespace medulla {

// Text or binary PLY, of either byte order; vertices in the order of the file, polygons are cut (polygons.h),
// everything else is stepped over. `name` is the path that errors begin with. Throws std::runtime_error "NAME:LINE:
// ...", without the line in a binary part, for a header that is not understood, a file that holds less or more than its
// header counts, coordinates that are not finite and corners that name no vertex.
TriangleMesh parsePly(std::string_view bytes, const std::string& name);

}  // namespace medulla
