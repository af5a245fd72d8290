#pragma once

#include "render/scene_mesh.h"

namespace medulla {

// Everything that sticks to a surface, computed once from its rest positions (already in the mesh, with normals):
// texture coordinates and albedo.
void bakeTextureCoordinates(SceneMesh& mesh, const MeshPart& part);
void bakeAlbedo(SceneMesh& mesh, const MeshPart& part);

// Ambient occlusion of all parts together: for each vertex the cosine-weighted share of directions in which nothing but
// the cavity's wall is in the way. And how thin the tissue is, for looks that glow.
void bakeOpenness(SceneMesh& mesh);

}  // namespace medulla
