#pragma once

#include <string>

#include "physics/model/triangle_mesh.h"

namespace medulla {

// Whether this is a format that assimp reads for us; extensions have their dot and are in lower case.
bool assimpReads(const std::string& extension);
std::string assimpFormats();  // all of them, for complaints

// Any of these formats, single precision, all meshes of the file in one, placed as its scene says; identical
// vertices are joined. Coordinates as they stand. Throws std::runtime_error "FILE: ..." with assimp's own reason, and
// on NaN, infinity and files without triangles.
TriangleMesh readWithAssimp(const std::string& path);

}  // namespace medulla
