#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "render/depth_map.h"
#include "render/scene_mesh.h"
#include "render/viewpoint.h"

namespace medulla {

// What can be seen of one part, as a range of VisibleTriangles::vertices and ::index.
struct VisiblePart : MeshRange {
  std::size_t part = 0;
};

// Two of three triangles never reach OpenGL, and their vertices are never lit.
struct VisibleTriangles {
  VisibleTriangles(int pictureWidth, int pictureHeight);  // pixels

  std::vector<VisiblePart> parts;       // front to back: hidden pixels are never shaded
  std::vector<std::uint32_t> vertices;  // of the mesh, those that triangles use
  std::vector<std::uint32_t> index;     // of `vertices`, three per triangle
  std::vector<glm::vec3> picture;       // pictureFromWorld of every vertex of the mesh
  std::vector<std::uint32_t> placeOf;   // of every used vertex of the mesh in `vertices`; kUnused otherwise
  static constexpr std::uint32_t kUnused = ~0u;
  std::vector<glm::vec3> texel;  // of every vertex of the mesh in `nearest`
  DepthMap nearest;              // the picture's depth, 1 - near plane / depth
};

// Drops what faces away, lies outside the picture or behind the rim and, where everything is `opaque`, what lies behind
// something else.
void findVisibleTriangles(const SceneMesh& mesh, const Viewpoint& viewpoint, bool opaque, VisibleTriangles& out);

}  // namespace medulla
