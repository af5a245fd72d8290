#pragma once

#include <string>

#include "physics/model/triangle_mesh.h"

namespace medulla {

// The mesh, in millimetres, as an OBJ file in metres with 0.1 micrometre resolution.
std::string objText(const TriangleMesh& meshInMillimetres, const std::string& name);

}  // namespace medulla
