#include "render/depth_map.h"

#include <algorithm>
#include <cmath>

namespace medulla {
namespace {

constexpr int kBlock = 8;  // texels handled together; one AVX2 register of floats

// Value along a row of texels: at + step * k.
struct Ramp {
  float at, step;
};

void rasterizeRow(float* row, int count, Ramp e0, Ramp e1, Ramp e2, Ramp z) {
  for (int start = 0; start < count; start += kBlock) {
    for (int k = 0; k < kBlock; ++k) {
      const float i = float(start + k);
      const float inside = std::min(std::min(e0.at + e0.step * i, e1.at + e1.step * i), e2.at + e2.step * i);
      const float nearer = std::min(row[start + k], z.at + z.step * i);
      row[start + k] = inside >= 0 ? nearer : row[start + k];
    }
  }
}

}  // namespace

DepthMap::DepthMap(int sideInTexels)
    : side(sideInTexels), stride(sideInTexels + kBlock), depth(std::size_t(stride) * side, 1.f) {}

void DepthMap::clear() {
  std::fill(depth.begin(), depth.end(), 1.f);
}

void DepthMap::rasterize(glm::vec3 a, glm::vec3 b, glm::vec3 c) {
  const float area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  if (!(area > 0)) return;
  const float last = float(side - 1);
  const int x0 = int(std::max(0.f, std::ceil(std::min({a.x, b.x, c.x}) - 0.5f)));
  const int x1 = int(std::min(last, std::floor(std::max({a.x, b.x, c.x}) - 0.5f)));
  const int y0 = int(std::max(0.f, std::ceil(std::min({a.y, b.y, c.y}) - 0.5f)));
  const int y1 = int(std::min(last, std::floor(std::max({a.y, b.y, c.y}) - 0.5f)));
  if (x0 > x1 || y0 > y1) return;  // most triangles of a fine mesh fall between texel centres
  const float dzdx = ((b.z - a.z) * (c.y - a.y) - (c.z - a.z) * (b.y - a.y)) / area;
  const float dzdy = ((c.z - a.z) * (b.x - a.x) - (b.z - a.z) * (c.x - a.x)) / area;
  const float px = float(x0) + 0.5f;
  for (int y = y0; y <= y1; ++y) {
    const float py = float(y) + 0.5f;
    const auto edge = [px, py](glm::vec3 from, glm::vec3 to) {
      return Ramp{(to.x - from.x) * (py - from.y) - (to.y - from.y) * (px - from.x), from.y - to.y};
    };
    rasterizeRow(&depth[std::size_t(y) * stride + x0], x1 - x0 + 1, edge(a, b), edge(b, c), edge(c, a),
                 {a.z + dzdx * (px - a.x) + dzdy * (py - a.y), dzdx});
  }
}

}  // namespace medulla
