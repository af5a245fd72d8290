#include "render/viewpoint.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "render/noise.h"

namespace medulla {
namespace {

constexpr float kOverscan = 6;  // see Viewpoint::overscan: a floor seen from near has triangles larger than a picture
constexpr float kFarPlane = 2500;  // m, beyond what scenes may hold; the depth buffer is floating point
// The near plane, as a share of the way to what the camera looks at, within two distances (m). A shaft passes close to
// the lens; and at d the depth buffer tells apart 6e-8 d^2 / near: 4 um of .2 m, 3 mm of 160 m.
constexpr float kNearShare = 0.003f, kNearest = 0.0002f, kFarthestNear = 1;

glm::vec3 anyPerpendicular(glm::vec3 v) {
  return glm::normalize(glm::cross(v, std::abs(v.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0)));
}

glm::vec3 direction(glm::vec3 from, glm::vec3 to) {
  const glm::vec3 d = to - from;
  const float length = glm::length(d);
  return length > 0 ? d / length : glm::vec3(0, 0, -1);
}

void lookFromLamp(LightView& l, glm::vec3 up) {
  l.clipFromWorld = glm::perspective(2 * std::atan(l.tangent), 1.f, l.nearDistance, l.farDistance) *
                    glm::lookAt(l.position, l.position + l.direction, up);
}

// What a view is fitted to moves from picture to picture. Rounded, the view stays but for rare jumps: texels that
// shifted a little each time would make the edges of resting bodies' shadows crawl.
float roundUp(float x) {
  return std::exp2(std::ceil(4 * std::log2(x)) / 4);
}

glm::vec3 roundedMiddle(glm::vec3 low, glm::vec3 high) {
  const float step = roundUp(std::max(glm::length(high - low), 1e-6f)) / 8;
  return step * glm::round(0.5f / step * (low + high));
}

// Everything that casts a shadow lies inside, everything that receives one no farther than the far plane.
LightView makeLampView(glm::vec3 position, const SceneMesh& mesh) {
  constexpr float kMargin = 1.05f, kWidest = 3;
  glm::vec3 low(1e30f), high(-1e30f);
  for (const MeshPart& part : mesh.parts)
    for (std::uint32_t i = 0; part.look->castsShadow && i < part.vertexCount; ++i) {
      low = glm::min(low, mesh.position[part.firstVertex + i]);
      high = glm::max(high, mesh.position[part.firstVertex + i]);
    }
  LightView l;
  l.position = position;
  l.direction = low.x <= high.x ? direction(position, roundedMiddle(low, high)) : glm::vec3(0, -1, 0);
  float nearest = 1e30f, farthest = 0, tangent = 0;
  for (const MeshPart& part : mesh.parts)
    for (std::uint32_t i = 0; i < part.vertexCount; ++i) {
      const glm::vec3 d = mesh.position[part.firstVertex + i] - position;
      const float along = glm::dot(d, l.direction);
      farthest = std::max(farthest, along);
      if (!part.look->castsShadow || along <= 0) continue;
      nearest = std::min(nearest, along);
      tangent = std::max(tangent, glm::length(d - along * l.direction) / along);
    }
  l.tangent = std::min(roundUp(std::max(kMargin * tangent, 1e-3f)), kWidest);
  l.farDistance = roundUp(std::max(kMargin * farthest, 1e-3f));
  // Not all of the depth for thin scenes: the biases of the shadow map are shares of it.
  l.nearDistance = std::clamp(1 / roundUp(kMargin / nearest), 1e-3f * l.farDistance, 0.5f * l.farDistance);
  lookFromLamp(l, anyPerpendicular(l.direction));
  return l;
}

}  // namespace

float widening(float aspect) {
  return std::max(1.f, 0.75f * (16.f / 9) / aspect);
}

float vignetteAt(const Viewpoint& v, glm::vec2 p) {
  return v.round ? 1 - 0.55f * smoothStep(0.25f, 0.85f, v.widening * std::sqrt(p.x * p.x + p.y * p.y)) : 1.f;
}

Viewpoint makeViewpoint(const Camera& camera, float aspect, bool round, float mostOverscan) {
  Viewpoint v;
  v.position = camera.position;
  v.back = -direction(camera.position, camera.target);
  // Straight up or down, as a camera that looks along -z is tilted there.
  const glm::vec3 across = glm::cross(camera.up, v.back), side = glm::cross(camera.up, glm::vec3(0, 0, 1));
  v.right = glm::length(across) > 1e-6f ? glm::normalize(across)
            : glm::length(side) > 1e-6f ? glm::normalize(side)
                                        : anyPerpendicular(v.back);
  v.up = glm::cross(v.back, v.right);
  v.tangent = std::tan(glm::radians(camera.fovDegrees) / 2);
  v.aspect = aspect;
  v.round = round;
  v.widening = widening(aspect);
  v.rim = rimOuter(aspect);
  v.nearPlane = std::clamp(kNearShare * glm::length(camera.target - camera.position), kNearest, kFarthestNear);
  glm::mat4 clip = glm::perspective(glm::radians(camera.fovDegrees), aspect, v.nearPlane, kFarPlane);
  clip[1][1] = -clip[1][1];
  v.overscan = round ? 1.f : std::min(kOverscan, mostOverscan);
  clip[0][0] /= v.overscan;
  clip[1][1] /= v.overscan;
  v.clipFromWorld = clip * glm::lookAt(v.position, v.position - v.back, v.up);
  return v;
}

LightView makeLightView(const Light& light, const Viewpoint& v, const Camera& camera, const SceneMesh& mesh) {
  if (light.position) return makeLampView(*light.position, mesh);
  LightView l;
  l.position = v.position + v.right * light.offset.x + v.up * light.offset.y + v.back * light.offset.z;
  l.direction = direction(l.position, camera.target);
  // The view covers what the camera sees; the light sits beside it, hence the margin.
  const float corner = v.round ? 2 * v.rim : std::sqrt(1 + v.aspect * v.aspect);
  l.tangent = std::min(1.15f * corner * std::max(v.tangent, kLampTangent), 3.f);
  l.nearDistance = 0.2f * light.referenceDistance;
  l.farDistance = 20 * light.referenceDistance;
  lookFromLamp(l, std::abs(glm::dot(l.direction, v.up)) < 0.95f ? v.up : v.right);
  return l;
}

}  // namespace medulla
