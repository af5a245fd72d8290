#include "render/touch.h"

#include <algorithm>
#include <cmath>

namespace medulla {

void applyTouch(const Instrument& instrument, SceneMesh& mesh) {
  // m: widths of the Gaussians and depth of the dimple. The simulation moves nodes a centimetre apart; this is what
  // happens between them.
  constexpr float kDimpleWidth = 0.0055f, kBlanchWidth = 0.0050f, kDepth = 0.0012f, kFarthest = 0.02f;
  const glm::vec3 push = instrument.worldFromTool * glm::vec3(0, 0, -1);
  for (const MeshPart& part : mesh.parts) {
    if (part.instrument) continue;
    for (std::size_t i = part.firstVertex; i < part.firstVertex + part.vertexCount; ++i) {
      const glm::vec3 d = mesh.position[i] - instrument.tip;
      const float q = glm::dot(d, d);
      if (q > kFarthest * kFarthest) continue;
      const float w = kDepth * std::exp(-q / (kDimpleWidth * kDimpleWidth));
      // Under x -> x + push w(x) a normal turns to n - grad w (push . n), up to length (inverse transpose, first
      // order).
      const glm::vec3 gradient = d * (-2 * w / (kDimpleWidth * kDimpleWidth));
      glm::vec3& n = mesh.normal[i];
      n = glm::normalize(n - gradient * glm::dot(push, n));
      mesh.position[i] += push * w;
      mesh.blanch[i] = std::max(mesh.blanch[i], std::exp(-q / (kBlanchWidth * kBlanchWidth)));
    }
  }
}

void shadeAround(const Instrument& instrument, SceneMesh& mesh) {
  constexpr float kLength = 0.42f, kRadius = 0.0026f, kFarthest = 0.05f;  // m
  const glm::vec3 axis = instrument.worldFromTool * glm::vec3(0, 0, 1), start = instrument.tip + kRadius * axis;
  for (const MeshPart& part : mesh.parts) {
    if (part.instrument) continue;
    for (std::size_t i = part.firstVertex; i < part.firstVertex + part.vertexCount; ++i) {
      const glm::vec3 d = mesh.position[i] - start;
      const float along = glm::clamp(glm::dot(d, axis), 0.f, kLength);
      const glm::vec3 away = d - along * axis;
      const float q = glm::dot(away, away);
      if (q > kFarthest * kFarthest) continue;
      const float distance = std::max(std::sqrt(q), kRadius);
      const float facing = std::max(-glm::dot(mesh.normal[i], away) / distance, 0.f);
      const float fade = 1 - q / (kFarthest * kFarthest);
      mesh.openness[i] *= 1 - fade * facing * kRadius / distance;
    }
  }
}

}  // namespace medulla
