#pragma once

#include <string>
#include <vector>

#include "physics/model/triangle_mesh.h"

// What those who read a mesh, to build a model or to tell of it, note on standard error.
namespace medulla {

// An organ of 60 m is a mesh in millimetres read as metres.
void noteSize(const std::string& path, const TriangleMesh& mesh);

// What makes runs slow that touch it: slivers, which ask for short steps, and more nodes than anybody feels. A mesh
// that was remeshed simulates as well, and with this one as --fine it looks as this one does.
void noteCost(const std::string& path, const TriangleMesh& mesh);

// All that was repaired and found (RepairedMesh::notes), in one line; nothing of a clean mesh.
void noteRepairs(const std::string& path, const std::vector<std::string>& notes);

}  // namespace medulla
