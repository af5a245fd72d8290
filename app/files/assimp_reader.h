#pragma once

#include <string>

#include "physics/model/triangle_mesh.h"

namespace medulla {

// Whether assimp knows the extension, given with its dot and in lower case.
bool assimpReads(const std::string& extension);

// Any format that assimp knows, single precision, all meshes of the file in one, placed as its scene says; identical
// vertices are joined. Coordinates as they stand. Throws std::runtime_error "FILE: ..." with assimp's own reason, and
// on NaN, infinity and files without triangles.
TriangleMesh readWithAssimp(const std::string& path);

}  // namespace medulla
