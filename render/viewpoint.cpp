#include "render/viewpoint.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

namespace medulla {
namespace {

constexpr float kFarPlane = 50;  // m; the depth buffer is floating point

glm::vec3 anyPerpendicular(glm::vec3 v) {
  return glm::normalize(glm::cross(v, std::abs(v.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0)));
}

glm::vec3 direction(glm::vec3 from, glm::vec3 to) {
  const glm::vec3 d = to - from;
  const float length = glm::length(d);
  return length > 0 ? d / length : glm::vec3(0, 0, -1);
}

}  // namespace

Viewpoint makeViewpoint(const Camera& camera, float aspect, bool round) {
  Viewpoint v;
  v.position = camera.position;
  v.back = -direction(camera.position, camera.target);
  const glm::vec3 side = glm::cross(camera.up, v.back);
  v.right = glm::length(side) > 1e-6f ? glm::normalize(side) : anyPerpendicular(v.back);
  v.up = glm::cross(v.back, v.right);
  v.tangent = std::tan(glm::radians(camera.fovDegrees) / 2);
  v.aspect = aspect;
  v.round = round;
  glm::mat4 clip = glm::perspective(glm::radians(camera.fovDegrees), aspect, kNearPlane, kFarPlane);
  clip[1][1] = -clip[1][1];
  v.clipFromWorld = clip * glm::lookAt(v.position, v.position - v.back, v.up);
  return v;
}

LightView makeLightView(const Light& light, const Viewpoint& v, const Camera& camera) {
  LightView l;
  l.position = v.position + v.right * light.offset.x + v.up * light.offset.y + v.back * light.offset.z;
  l.direction = direction(l.position, camera.target);
  // The view covers what the camera sees; the light sits beside it, hence the margin.
  const float corner = v.round ? 2 * kRimOuter : std::sqrt(1 + v.aspect * v.aspect);
  l.tangent = std::min(1.15f * corner * v.tangent, 3.f);
  l.nearDistance = 0.2f * light.referenceDistance;
  l.farDistance = 20 * light.referenceDistance;
  const glm::vec3 up = std::abs(glm::dot(l.direction, v.up)) < 0.95f ? v.up : v.right;
  l.clipFromWorld = glm::perspective(2 * std::atan(l.tangent), 1.f, l.nearDistance, l.farDistance) *
                    glm::lookAt(l.position, l.position + l.direction, up);
  return l;
}

}  // namespace medulla
