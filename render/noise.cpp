#include "render/noise.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace medulla {

// 0..1
static float latticeHash(std::int32_t x, std::int32_t y, std::int32_t z) {
  std::uint32_t h = std::uint32_t(x) * 374761393u + std::uint32_t(y) * 668265263u + std::uint32_t(z) * 2147483647u;
  h = (h ^ (h >> 13)) * 1274126177u;
  h ^= h >> 16;
  return float(h & 0xffffff) / float(0xffffff);
}

float valueNoise(glm::vec3 p) {
  const glm::vec3 cell = glm::floor(p);
  glm::vec3 t = p - cell;
  t = t * t * (3.f - 2.f * t);
  const auto x = std::int32_t(cell.x), y = std::int32_t(cell.y), z = std::int32_t(cell.z);
  const auto alongX = [&](int dy, int dz) {
    return glm::mix(latticeHash(x, y + dy, z + dz), latticeHash(x + 1, y + dy, z + dz), t.x);
  };
  return glm::mix(glm::mix(alongX(0, 0), alongX(1, 0), t.y), glm::mix(alongX(0, 1), alongX(1, 1), t.y), t.z);
}

float fractalNoise(glm::vec3 p) {
  float sum = 0, amplitude = 0.5f;
  for (int octave = 0; octave < 4; ++octave, amplitude *= 0.5f, p *= 2.03f)
    sum += amplitude * valueNoise(p + glm::vec3(17.f * float(octave)));
  return sum / 0.9375f;
}

// Lattice points lie at most two cells outside the tile: cheaper than two divisions.
static int wrap(int v, int period) {
  return v < 0 ? v + period : v >= period ? v - period : v;
}

float tiledNoise(float x, float y, int period, int seed) {
  const int xi = int(std::floor(x)), yi = int(std::floor(y));
  float tx = x - float(xi), ty = y - float(yi);
  tx = tx * tx * (3 - 2 * tx);
  ty = ty * ty * (3 - 2 * ty);
  const auto at = [&](int a, int b) { return latticeHash(wrap(a, period), wrap(b, period), seed); };
  return glm::mix(glm::mix(at(xi, yi), at(xi + 1, yi), tx), glm::mix(at(xi, yi + 1), at(xi + 1, yi + 1), tx), ty);
}

float tiledCells(float x, float y, int period, int seed) {
  const int xi = int(std::floor(x)), yi = int(std::floor(y));
  float nearest = 9, second = 9;
  for (int j = yi - 1; j <= yi + 1; ++j)
    for (int i = xi - 1; i <= xi + 1; ++i) {
      const int cx = wrap(i, period), cy = wrap(j, period);
      const float px = float(i) + latticeHash(cx, cy, seed), py = float(j) + latticeHash(cx, cy, seed + 1);
      const float d = std::sqrt((px - x) * (px - x) + (py - y) * (py - y));
      second = std::min(second, std::max(nearest, d));
      nearest = std::min(nearest, d);
    }
  return second - nearest;
}

}  // namespace medulla
