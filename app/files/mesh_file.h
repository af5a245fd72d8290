#pragma once

#include <string>
#include <vector>

#include "physics/model/triangle_mesh.h"

namespace medulla {

const std::vector<std::string>& lengthUnits();  // m, cm, mm, micron, inch

// Metres per unit of a file. Throws std::runtime_error naming the known units.
double metresPerUnit(const std::string& unit);

// Whether a file is one by its ending. Of .xml, which assimp reads as well, it is none: those are scenes and models.
bool isMeshFile(const std::string& path);

// Reads a triangle mesh. OBJ, OFF and PLY by a reader of our own (vertex order kept, double precision, indices checked,
// polygons cut into triangles); every other format through assimp. Vertices are scaled to metres.
// Throws std::runtime_error "FILE:LINE: ..." on missing, unreadable or malformed files, NaN, infinity, bad indices.
TriangleMesh readMesh(const std::string& path, double metresPerFileUnit = 1);

}  // namespace medulla
