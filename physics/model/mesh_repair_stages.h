#pragma once

#include <string>
#include <vector>

#include "physics/model/triangle_mesh.h"

// The stages of repairMesh, in the order they run. Each changes the mesh in place, notes what it did, and throws
// std::runtime_error where repair would be guesswork. Vertices are named in messages by their number in the input.
namespace medulla {

struct MeshUnderRepair {
  TriangleMesh mesh;
  std::vector<int> vertexOfInput;  // -1 where dropped
  std::vector<int> inputOfVertex;  // the lowest input vertex that became this one
  std::vector<std::string> notes;
};

// Before anything is changed (mesh_refusal.cpp): indices, finite numbers, a size in metres, vertices far from the rest.
void requireUsableNumbers(const TriangleMesh& input);
void requireNoFarVertex(const TriangleMesh& input);

// mesh_cleaning.cpp
MeshUnderRepair weldVertices(const TriangleMesh& input);
void dropRepeatedTriangles(MeshUnderRepair& repair);  // degenerate ones and duplicates
void dropFins(MeshUnderRepair& repair);
void dropUnusedVertices(MeshUnderRepair& repair);

void requireThickness(const MeshUnderRepair& repair);      // not all in one plane (mesh_refusal.cpp)
void requireManifoldEdges(const MeshUnderRepair& repair);  // at most two triangles on an edge (mesh_refusal.cpp)

void orientNeighboursAlike(MeshUnderRepair& repair);  // mesh_orientation.cpp
void fillSmallHoles(MeshUnderRepair& repair);         // mesh_holes.cpp; afterwards the surface is closed

// mesh_cleaning.cpp, for closed surfaces
void splitPinchedVertices(MeshUnderRepair& repair);
void flipTrianglesWithoutArea(MeshUnderRepair& repair);

void requireApart(const MeshUnderRepair& repair);     // pieces do not overlap (mesh_refusal.cpp)
void orientBodyAndCavities(MeshUnderRepair& repair);  // one body, outward; cavities inward (mesh_orientation.cpp)

// mesh_refusal.cpp
void requireVolume(const MeshUnderRepair& repair);
void judgeSelfIntersections(MeshUnderRepair& repair);

// "12 mm": lengths in messages. The argument is in metres.
std::string millimetres(double length);
// "3 triangles", "1 triangle".
std::string counted(std::size_t count, const std::string& singular, const std::string& plural);

}  // namespace medulla
