#pragma once

#include "render/scene_mesh.h"
#include "render/viewpoint.h"

namespace medulla {

// Meshes are made for films of 720 and 1080 lines. In larger pictures their outlines would be polygons, and light,
// which is interpolated over triangles without perspective, would run in zigzags. Mending that takes as long as all the
// light of a film does: below so many lines drawn, those of 720 in the best quality, meshes are taken as they are, but
// for their largest triangles.
constexpr int kLinesOfMeshes = 1440;

// m; what tessellate() asks of a part.
float longestEdge(const SceneMesh& mesh, const MeshPart& part);

// outlines: edges that would be seen to be straight, or along which light would. largest: only those so long, a quarter
// of the picture and more, that texture and light, without perspective over a triangle, would break along them, and
// Mesa clip them wrongly (Viewpoint::overscan): floors of two triangles, a mesh right before the lens.
enum class Halved { outlines, largest };

// `out` is `mesh` with such edges halved where the picture, so many pixels high, shows them. An edge is judged by its
// own ends, so that both its triangles agree and no crack opens. Instruments are taken as they are. Returns false, and
// leaves `out` alone, where no edge can be so long.
bool tessellate(const SceneMesh& mesh, const Viewpoint& view, int pictureHeight, Halved halved, SceneMesh& out);

// Where a part is bent more sharply than it is made for. m.
struct FineSpot {
  std::size_t part = 0;
  glm::vec3 centre{0};
  float longestEdge = 0;
};

// `out` is `mesh` with the spots' parts cut finer there: edges are halved until none is longer than a spot's
// longestEdge and than a third of its middle's distance from the centre. The surface keeps its place. Returns false,
// and leaves `out` alone, without spots.
bool refine(const SceneMesh& mesh, const std::vector<FineSpot>& spots, SceneMesh& out);

}  // namespace medulla
