#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "render/depth_map.h"
#include "render/scene_mesh.h"

namespace medulla {

// Perspective seen from the light, renewed each picture.
struct LightView {
  glm::vec3 position{0}, direction{0, 0, -1};
  float nearDistance = 0.03f, farDistance = 1;  // m
  float tangent = 1;                            // half opening of the square view
  glm::mat4 clipFromWorld{1};
};

// Texels along the map's side: kShadowSide up to a picture of 720 lines, above it so many more that a texel covers no
// more pixels than there, or texels would show as teeth along every edge.
constexpr int kShadowSide = 1024, kShadowSideMost = 4096;
int shadowSideFor(int pictureHeight);

struct ShadowMap {
  explicit ShadowMap(int side = kShadowSide);                               // a multiple of kBlockSide
  float fineness() const { return float(map.width) / float(kShadowSide); }  // texels per one of the coarsest map's

  DepthMap map;                  // its stride is no power of two: rows would share cache sets
  std::vector<glm::vec3> texel;  // every vertex of the mesh: texels and depth; x = y = -1e9 when behind the light
  std::vector<float> nearest, farthest;  // of blocks of kBlockSide^2 texels: whole triangles are judged by them
  static constexpr int kBlockSide = 8;
  int blocks;  // along the side
};

void renderShadowMap(const SceneMesh& mesh, const LightView& light, ShadowMap& shadow);

// What a receiving triangle (corners as in ShadowMap::texel) can be: wholly lit, wholly dark, or crossed by an edge.
enum class Shade : std::uint8_t { lit, edge, dark };
Shade shadeOfTriangle(const ShadowMap& shadow, glm::vec3 a, glm::vec3 b, glm::vec3 c);

}  // namespace medulla
