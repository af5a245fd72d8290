#pragma once

#include <string>
#include <vector>

#include "physics/model/triangle_mesh.h"

namespace medulla {

const std::vector<std::string>& lengthUnits();  // m, cm, mm, micron, inch

// Metres per unit of a file. Throws std::runtime_error naming the known units.
double metresPerUnit(const std::string& unit);

// Whether a file is one by its ending.
bool isMeshFile(const std::string& path);

// Reads a triangle mesh. OBJ, OFF, PLY and STL by a reader of our own (vertex order kept, double precision, indices
// checked, polygons cut into triangles); those that assimp_reader.h names through assimp. Vertices are scaled to
// metres. Throws std::runtime_error "FILE:LINE: ..." on missing, unreadable or malformed files, NaN, infinity, bad
// indices.
TriangleMesh readMesh(const std::string& path, double metresPerFileUnit = 1);

}  // namespace medulla
