#pragma once

#include "physics/model/soft_body_model.h"
#include "physics/model/triangle_mesh.h"

namespace medulla {

// Subdivisions that draw a mesh of so many triangles smoothly: two, or as many as leave kDrawnTriangles or fewer.
constexpr int kDrawnTriangles = 200000;
constexpr int renderLevelsFor(std::size_t triangles) {
  return 16 * triangles <= kDrawnTriangles ? 2 : 4 * triangles <= kDrawnTriangles ? 1 : 0;
}

// The surface to draw: `levels` Loop subdivisions of a closed physics mesh (each has four times the triangles), every
// vertex moved to its Loop limit and expressed by the physics nodes. The limit surface is smooth (C2, C1 at irregular
// nodes), hence no facets in the silhouette; vertices are shared, hence no cracks. With a `fine` shape each vertex also
// gets its offset to it: the nearer hit along the limit normal, else the closest point, within a bound of one and a
// half mean edges of the physics mesh; where nothing lies within it, none. Throws std::runtime_error where that is so
// of more than half of the vertices: it is another shape. levels 0..4.
RenderSurface makeRenderSurface(const TriangleMesh& mesh, int levels, const TriangleMesh* fine);

}  // namespace medulla
