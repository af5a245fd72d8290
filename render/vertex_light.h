#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "render/haze.h"
#include "render/shadow_map.h"
#include "render/visible_triangles.h"

namespace medulla {

// What the shaders get per vertex: light is computed here on the CPU, once per vertex instead of once per pixel, which
// is what makes thirty pictures a second possible on two cores.
struct LitVertex {
  glm::vec3 position;  // m, world
  glm::vec3 direct;    // diffuse light of the endoscope, times albedo
  float gloss;         // strength of the highlights
  glm::vec3 ambient;   // everything that shadow does not touch, times albedo
  float shadowRadius;  // texels: half width of a soft shadow edge
  glm::vec3 halfway;   // between light and eye: along tangent, bitangent, normal
  float shadowBias;    // depth
  glm::vec2 uv;
  float detail;  // 0..1: share of the texture's colour; none where the blood is pressed out or the texture distorted
  float seam;    // of SceneMesh
};

// Highlight of a look: two lobes c / (1 + (a - 1) cos^2)^2 (GGX, Walter et al. 2007), the tissue's and the wet film's.
struct GlossLobes {
  float a1, c1, a2, c2;
};
GlossLobes glossLobes(const Look& look);
constexpr float kFilmPeak = 13.2f;  // of the film's lobe: beyond it only aliasing grows

struct VertexLight {
  std::vector<LitVertex> vertices;     // in the order of VisibleTriangles::vertices, as is all below
  std::vector<Shade> shade;            // by taps around the vertex
  std::vector<std::uint8_t> glinting;  // 0 where no highlight can be seen even with the relief's slopes
};

// haze: of picture.light.haze, or nullptr.
void lightVertices(const SceneMesh& mesh, const VisibleTriangles& seen, const Viewpoint& viewpoint,
                   const Picture& picture, const LightView& lightView, const HazeField* haze, const ShadowMap* shadow,
                   VertexLight& out);

}  // namespace medulla
