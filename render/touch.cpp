#include "render/touch.h"

#include <algorithm>
#include <cmath>

namespace medulla {

void applyStrain(const SceneMesh& rest, SceneMesh& mesh, const MeshPart& part) {
  // Full effect of stretch at this share of area gained, or lost; of a fold per slope.
  constexpr float kStretch = 1.8f, kSqueeze = 0.8f, kFold = 1.6f, kDarkest = 0.55f;
  for (std::uint32_t i = part.firstVertex; i < part.firstVertex + part.vertexCount; ++i) {
    const float gained = mesh.area[i] / std::max(rest.area[i], 1e-16f) - 1;
    mesh.blanch[i] = glm::clamp(gained / (gained > 0 ? kStretch : kSqueeze), -1.f, 0.4f);
    const float deeper = mesh.hollow[i] - rest.hollow[i];
    mesh.openness[i] *= 1 - glm::clamp(kFold * deeper, 0.f, kDarkest);
  }
}

namespace {

// x -> x + offset exp(-(x - centre)^2 / width^2), m. A normal turns to n - grad w (offset . n), up to length (inverse
// transpose, first order). What lies next to the centre loses its blood, over `blanched` metres.
void displace(const MeshPart& part, glm::vec3 centre, glm::vec3 offset, float width, float blanched, SceneMesh& mesh) {
  constexpr float kShade = 1.8f;  // share of the cavity's light lost, per slope
  for (std::size_t i = part.firstVertex; i < part.firstVertex + part.vertexCount; ++i) {
    const glm::vec3 d = mesh.position[i] - centre;
    const float q = glm::dot(d, d) / (width * width);
    if (q > 9) continue;
    mesh.blanch[i] = glm::mix(mesh.blanch[i], 1.f, std::exp(-glm::dot(d, d) / (blanched * blanched)));
    const float w = std::exp(-q);
    const glm::vec3 gradient = d * (-2 * w / (width * width));
    const float along = glm::dot(offset, mesh.normal[i]);
    mesh.normal[i] = glm::normalize(mesh.normal[i] - gradient * along);
    mesh.position[i] += offset * w;
    if (along < 0) mesh.openness[i] *= std::max(1 + kShade * along * glm::length(gradient), 0.3f);
  }
}

// The vertex of a moving part that is nearest to p, at most `reach` away; nullptr as part where there is none.
struct Nearest {
  const MeshPart* part = nullptr;
  glm::vec3 position{0};
};
Nearest nearestMoving(const SceneMesh& mesh, glm::vec3 p, float reach) {
  Nearest nearest;
  float best = reach * reach;
  for (const MeshPart& part : mesh.parts) {
    if (!part.moving) continue;
    for (std::size_t i = part.firstVertex; i < part.firstVertex + part.vertexCount; ++i) {
      const glm::vec3 d = mesh.position[i] - p;
      if (const float q = glm::dot(d, d); q < best) {
        best = q;
        nearest = {&part, mesh.position[i]};
      }
    }
  }
  return nearest;
}

}  // namespace

// The simulation moves nodes a centimetre apart; this is what happens between them.
void applyTouch(const Instrument& instrument, SceneMesh& mesh) {
  constexpr float kWidth = 0.0055f, kPressed = 0.0014f, kBlanchWidth = 0.0050f;  // m, at scale 1, as all here
  // A smooth surface stays behind the held nodes that it hangs on, up to kReach; the jaws bite kBite of it.
  constexpr float kReach = 0.014f, kBite = 0.0035f;
  const glm::vec3 axis = instrument.worldFromTool * glm::vec3(0, 0, instrument.scale);
  const float width = instrument.scale * kWidth, blanched = instrument.scale * kBlanchWidth;
  if (instrument.holding) {
    const Nearest held = nearestMoving(mesh, instrument.tip, instrument.scale * kReach);
    if (!held.part) return;
    const glm::vec3 offset = instrument.tip + kBite * axis - held.position;
    displace(*held.part, held.position, offset, std::max(width, 1.3f * glm::length(offset)), blanched, mesh);
  } else {
    for (const MeshPart& part : mesh.parts)
      if (!part.instrument) displace(part, instrument.tip, -kPressed * axis, width, blanched, mesh);
  }
}

void shadeAround(const Instrument& instrument, SceneMesh& mesh) {
  const float length = 0.42f * instrument.scale, radius = 0.0026f * instrument.scale,
              farthest = 0.05f * instrument.scale;  // m
  const glm::vec3 axis = instrument.worldFromTool * glm::vec3(0, 0, 1), start = instrument.tip + radius * axis;
  for (const MeshPart& part : mesh.parts) {
    if (part.instrument) continue;
    for (std::size_t i = part.firstVertex; i < part.firstVertex + part.vertexCount; ++i) {
      const glm::vec3 d = mesh.position[i] - start;
      const float along = glm::clamp(glm::dot(d, axis), 0.f, length);
      const glm::vec3 away = d - along * axis;
      const float q = glm::dot(away, away);
      if (q > farthest * farthest) continue;
      const float distance = std::max(std::sqrt(q), radius);
      const float facing = std::max(-glm::dot(mesh.normal[i], away) / distance, 0.f);
      const float fade = 1 - q / (farthest * farthest);
      mesh.openness[i] *= 1 - fade * facing * radius / distance;
    }
  }
}

}  // namespace medulla
