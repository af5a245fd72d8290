#pragma once

#include <glm/glm.hpp>

#include "render/renderer.h"
#include "render/shadow_map.h"

namespace medulla {

// Radius of the endoscope's round picture, in picture heights from the centre; its rim fades between the two.
inline float rimInner(float aspect) {
  return 0.79f / widening(aspect);
}
inline float rimOuter(float aspect) {
  return 0.815f / widening(aspect);
}

// The camera of one picture with what follows from it.
struct Viewpoint {
  glm::vec3 position{0}, right{1, 0, 0}, up{0, 1, 0}, back{0, 0, 1};  // m; unit axes
  float tangent = 1;                                                  // of half the vertical field of view
  float aspect = 1;                                                   // width / height
  bool round = true;                                                  // the picture is cut to a circle
  float widening = 1, rim = 0.815f;                                   // medulla::widening(), rimOuter()
  // Clip space reaches this many picture widths and heights. Mesa 22 spoils noperspective values where it clips a
  // triangle against two sides at once: beyond the picture nobody sees it, nor behind the round picture's mask.
  float overscan = 1;
  float nearPlane = 0.0006f;   // m
  glm::mat4 clipFromWorld{1};  // y points down, so that the first row read back is the top one
};

// The endoscope's lamp lights no less than what this half field of view sees: it sits beside the lens, and the narrow
// cone of a camera that zooms in would miss what is nearer than its target.
constexpr float kLampTangent = 0.38f;  // of 42 degrees

// x, y in picture heights from the centre (y up), z = depth in m.
inline glm::vec3 pictureFromWorld(const Viewpoint& v, glm::vec3 p) {
  const glm::vec3 d = p - v.position;
  const float depth = -glm::dot(v.back, d);
  const float scale = 0.5f / (glm::max(depth, v.nearPlane) * v.tangent);
  return {glm::dot(v.right, d) * scale, glm::dot(v.up, d) * scale, depth};
}

// The endoscope's picture fades towards its rim: factor on light, p in picture heights from the centre.
float vignetteAt(const Viewpoint& v, glm::vec2 p);

// `mostOverscan`: >= 1, what OpenGL allows.
Viewpoint makeViewpoint(const Camera& camera, float aspect, bool round, float mostOverscan = 2);
// A lamp beside the lens sees what the camera sees, one in the world the casters of `mesh`.
LightView makeLightView(const Light& light, const Viewpoint& viewpoint, const Camera& camera, const SceneMesh& mesh);

}  // namespace medulla
