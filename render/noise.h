#pragma once

#include <glm/glm.hpp>

// Deterministic noise for colours and textures: integer hashes, no tables, no state.
namespace medulla {

float valueNoise(glm::vec3 p);    // 0..1, one lattice cell per unit, C1
float fractalNoise(glm::vec3 p);  // 0..1, four octaves of valueNoise

// Tileable; x and y within a cell of [0, period], period > 2; `seed` picks the pattern.
float tiledNoise(float x, float y, int period, int seed);  // 0..1
float tiledCells(float x, float y, int period, int seed);  // Worley F2 - F1: 0 on cell borders

inline float smoothStep(float from, float to, float x) {
  const float t = glm::clamp((x - from) / (to - from), 0.f, 1.f);
  return t * t * (3 - 2 * t);
}

}  // namespace medulla
