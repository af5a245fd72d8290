#include "render/shadow_map.h"

#include <algorithm>
#include <cassert>

namespace medulla {
namespace {

constexpr float kBehind = -1e9f, kFarAway = 1e6f;
// Of the near plane, which only says how depths are spread: a shaft beside the lens casts its shadow from before it.
constexpr float kNearest = 0.1f;

void projectVertices(const SceneMesh& mesh, const LightView& light, ShadowMap& s) {
  std::vector<glm::vec3>& texel = s.texel;
  texel.resize(mesh.position.size());
  const float half = 0.5f * float(s.map.side);
  for (std::size_t i = 0; i < texel.size(); ++i) {
    const glm::vec4 clip = light.clipFromWorld * glm::vec4(mesh.position[i], 1);
    const float inverse = 1 / std::max(clip.w, 1e-6f);
    texel[i] = {(clip.x * inverse + 1) * half, (clip.y * inverse + 1) * half, clip.z * inverse * 0.5f + 0.5f};
    // Bounded, so that texels convert to integers whatever the picture holds.
    texel[i] = glm::clamp(texel[i], glm::vec3(-kFarAway), glm::vec3(kFarAway));
    if (clip.w < kNearest * light.nearDistance) texel[i] = glm::vec3(kBehind, kBehind, 0);
  }
}

void buildBlocks(ShadowMap& s) {
  constexpr int b = ShadowMap::kBlockSide;
  const int blocks = s.blocks;
  s.nearest.resize(std::size_t(blocks) * blocks);
  s.farthest.resize(std::size_t(blocks) * blocks);
  for (int j = 0; j < blocks; ++j)
    for (int i = 0; i < blocks; ++i) {
      float low[b], high[b];
      std::fill(low, low + b, 1.f);
      std::fill(high, high + b, 0.f);
      for (int y = 0; y < b; ++y) {
        const float* row = &s.map.depth[std::size_t(j * b + y) * s.map.stride + i * b];
        for (int x = 0; x < b; ++x) {
          low[x] = std::min(low[x], row[x]);
          high[x] = std::max(high[x], row[x]);
        }
      }
      s.nearest[j * blocks + i] = *std::min_element(low, low + b);
      s.farthest[j * blocks + i] = *std::max_element(high, high + b);
    }
}

}  // namespace

int shadowSideFor(int pictureHeight) {
  constexpr int kLines = 720, b = ShadowMap::kBlockSide;
  const int side = (kShadowSide * pictureHeight / kLines + b - 1) / b * b;
  return std::clamp(side, kShadowSide, kShadowSideMost);
}

ShadowMap::ShadowMap(int side) : map(side), blocks(side / kBlockSide) {
  assert(side % kBlockSide == 0);
}

void renderShadowMap(const SceneMesh& mesh, const LightView& light, ShadowMap& s) {
  projectVertices(mesh, light, s);
  s.map.clear();
  for (const MeshPart& part : mesh.parts) {
    if (!part.look->castsShadow) continue;
    for (std::uint32_t k = part.firstIndex; k < part.firstIndex + part.indexCount; k += 3) {
      const glm::vec3 a = s.texel[mesh.index[k]], b = s.texel[mesh.index[k + 1]], c = s.texel[mesh.index[k + 2]];
      if (std::min({a.x, b.x, c.x}) > 0.5f * kBehind) s.map.rasterize(a, b, c);
    }
  }
  buildBlocks(s);
}

Shade shadeOfTriangle(const ShadowMap& s, glm::vec3 a, glm::vec3 b, glm::vec3 c) {
  const float margin = 6 * s.fineness();  // texels: the widest reach of the soft edge's taps
  constexpr int side = ShadowMap::kBlockSide;
  const int last = s.blocks - 1;
  const auto block = [&](float texel) { return std::clamp(int(std::clamp(texel, -1e6f, 1e6f)) / side, 0, last); };
  const int x0 = block(std::min({a.x, b.x, c.x}) - margin), x1 = block(std::max({a.x, b.x, c.x}) + margin);
  const int y0 = block(std::min({a.y, b.y, c.y}) - margin), y1 = block(std::max({a.y, b.y, c.y}) + margin);
  float low = 1, high = 0;
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      low = std::min(low, s.nearest[y * s.blocks + x]);
      high = std::max(high, s.farthest[y * s.blocks + x]);
    }
  const float zLow = std::min({a.z, b.z, c.z}), zHigh = std::max({a.z, b.z, c.z});
  return zHigh <= low + 0.0005f ? Shade::lit : zLow > high + 0.002f ? Shade::dark : Shade::edge;
}

}  // namespace medulla
