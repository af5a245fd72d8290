#include "render/shadow_map.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace medulla {
namespace {

constexpr float kBehind = -1e9f, kFarAway = 1e6f;
// Of the near plane, which only says how depths are spread: a shaft beside the lens casts its shadow from before it.
constexpr float kNearest = 0.1f;

glm::vec3 texelOf(const glm::vec4& clip, const ShadowMap& s) {
  const float half = 0.5f * float(s.map.width), inverse = 1 / std::max(clip.w, 1e-6f);
  const glm::vec3 texel((clip.x * inverse + 1) * half, (clip.y * inverse + 1) * half,
                        std::min(clip.z * inverse * 0.5f + 0.5f, 1.f));  // nothing stands before what is too far
  // Bounded, so that texels convert to integers whatever the picture holds.
  return glm::clamp(texel, glm::vec3(-kFarAway), glm::vec3(kFarAway));
}

void projectVertices(const SceneMesh& mesh, const LightView& light, ShadowMap& s) {
  s.texel.resize(mesh.position.size());
  for (std::size_t i = 0; i < s.texel.size(); ++i) {
    const glm::vec4 clip = light.clipFromWorld * glm::vec4(mesh.position[i], 1);
    s.texel[i] = clip.w < kNearest * light.nearDistance ? glm::vec3(kBehind, kBehind, 0) : texelOf(clip, s);
  }
}

// A triangle that is partly too near to the lamp, cut there. Dropped whole, the long triangles of a shaft would tear
// holes into its shadow.
void rasterizeCut(const std::array<glm::vec3, 3>& corners, const LightView& light, ShadowMap& s) {
  const float nearest = kNearest * light.nearDistance;
  glm::vec4 clip[3];
  for (int k = 0; k < 3; ++k) clip[k] = light.clipFromWorld * glm::vec4(corners[k], 1);
  glm::vec3 rest[4];
  int count = 0;
  for (int k = 0; k < 3; ++k) {
    const glm::vec4 &from = clip[k], &to = clip[(k + 1) % 3];
    if (from.w >= nearest) rest[count++] = texelOf(from, s);
    if ((from.w >= nearest) != (to.w >= nearest))
      rest[count++] = texelOf(from + (to - from) * ((nearest - from.w) / (to.w - from.w)), s);
  }
  for (int k = 2; k < count; ++k) s.map.rasterize(rest[0], rest[k - 1], rest[k]);
}

bool isBehind(const glm::vec3& texel) {
  return texel.x < 0.5f * kBehind;
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

ShadowMap::ShadowMap(int side) : map(side, side), blocks(side / kBlockSide) {
  assert(side % kBlockSide == 0);
}

void renderShadowMap(const SceneMesh& mesh, const LightView& light, ShadowMap& s) {
  projectVertices(mesh, light, s);
  s.map.clear();
  for (const MeshPart& part : mesh.parts) {
    if (!part.look->castsShadow) continue;
    for (std::uint32_t k = part.firstIndex; k < part.endIndex(); k += 3) {
      const glm::vec3 a = s.texel[mesh.index[k]], b = s.texel[mesh.index[k + 1]], c = s.texel[mesh.index[k + 2]];
      const int behind = isBehind(a) + isBehind(b) + isBehind(c);
      if (behind == 0) s.map.rasterize(a, b, c);
      if (behind == 1 || behind == 2)
        rasterizeCut({mesh.position[mesh.index[k]], mesh.position[mesh.index[k + 1]], mesh.position[mesh.index[k + 2]]},
                     light, s);
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
