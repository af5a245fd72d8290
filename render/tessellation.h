#pragma once

#include "render/scene_mesh.h"
#include "render/viewpoint.h"

namespace medulla {

// Meshes are made for films of 720 and 1080 lines. In larger pictures their outlines would be polygons, and light,
// which is interpolated over triangles without perspective, would run in zigzags. Mending that takes as long as all the
// light of a film does: below so many lines drawn, those of 720 in the best quality, meshes are taken as they are.
constexpr int kLinesOfMeshes = 1440;

// `out` is `mesh` with edges halved where the picture, so many pixels high, shows them. An edge is judged by its own
// ends, so that both its triangles agree and no crack opens. Instruments are taken as they are.
void tessellate(const SceneMesh& mesh, const Viewpoint& view, int pictureHeight, SceneMesh& out);

}  // namespace medulla
