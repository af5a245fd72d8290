#include "render/surface_bake.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "render/across.h"
#include "render/depth_map.h"
#include "render/noise.h"

namespace medulla {
namespace {

using glm::vec3;

// Radius of the sphere with the part's ratio of volume to surface; negative for a cavity seen from inside. Tells the
// unrolling how far the surface curves.
float meanRadius(const SceneMesh& mesh, const MeshPart& part) {
  double volume = 0, area = 0;
  const vec3 origin = part.vertexCount ? mesh.position[part.firstVertex] : vec3(0);
  for (std::uint32_t k = part.firstIndex; k < part.endIndex(); k += 3) {
    const vec3 a = mesh.position[mesh.index[k]] - origin, b = mesh.position[mesh.index[k + 1]] - origin,
               c = mesh.position[mesh.index[k + 2]] - origin;
    volume += glm::dot(a, glm::cross(b, c)) / 6;
    area += glm::length(glm::cross(b - a, c - a)) / 2;
  }
  return area > 0 ? float(3 * volume / area) : 0.f;
}

// Planar projection along z, unrolled by the normal: exact arc length on a sphere of the given radius, continuous
// everywhere but where the normal points to -z, which the camera sees last. One fetch with such coordinates costs a
// quarter of a triplanar lookup and shows no seams.
glm::vec2 unroll(vec3 p, vec3 n, float radius) {
  const float angle = std::min(std::acos(glm::clamp(n.z, -1.f, 1.f)), 2.5f);
  const float sine = std::max(std::sin(angle), 1e-3f);
  const float excess = angle < 0.05f ? angle * angle / 6 : angle / sine - 1;
  return glm::vec2(p) + radius * excess * glm::vec2(n);
}

// Which way a flat part faces; nothing of any other.
std::optional<vec3> facingOf(const SceneMesh& mesh, const MeshPart& part) {
  vec3 sum(0);
  for (std::uint32_t i = 0; i < part.vertexCount; ++i) sum += mesh.normal[part.firstVertex + i];
  const float length = glm::length(sum);
  return length > 0.999f * float(part.vertexCount) ? std::optional(sum / length) : std::nullopt;
}

// By the smallest rotation that takes `facing` to +z.
vec3 turnedToZ(vec3 v, vec3 facing) {
  const vec3 both = facing + vec3(0, 0, 1);
  if (both.z < 1e-6f) return {v.x, -v.y, -v.z};
  return v - both * (glm::dot(both, v) / both.z) + vec3(0, 0, 2 * glm::dot(facing, v));
}

struct Bounds {
  vec3 low{1e30f}, high{-1e30f};
  void add(vec3 p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
};

Bounds boundsOf(const SceneMesh& mesh, const MeshPart& part) {
  Bounds b;
  for (std::uint32_t i = 0; i < part.vertexCount; ++i) b.add(mesh.position[part.firstVertex + i]);
  return b;
}

vec3 mixClamped(vec3 a, vec3 b, float t) {
  return glm::mix(a, b, glm::clamp(t, 0.f, 1.f));
}

constexpr int kDirections = 64, kMapSide = 512, kUnrollPasses = 12;

// Points of the golden spiral: even over the sphere for any count, no table.
vec3 spiralDirection(int k) {
  const float z = 1 - (2 * float(k) + 1) / float(kDirections);
  const float r = std::sqrt(1 - z * z), turn = 2.39996323f * float(k);
  return {r * std::cos(turn), r * std::sin(turn), z};
}

// Averages values, one per vertex from `firstVertex` on, over the edges of triangles `first` to `last` of the mesh's
// index, which name no other vertices.
template <class Value>
void smoothOverEdges(const SceneMesh& mesh, std::size_t first, std::size_t last, std::uint32_t firstVertex, int passes,
                     std::vector<Value>& value) {
  std::vector<Value> sum;
  std::vector<float> weight(value.size());
  for (int pass = 0; pass < passes; ++pass) {
    sum = value;
    std::fill(weight.begin(), weight.end(), 1.f);
    for (std::size_t k = first; k < last; k += 3)
      for (int e = 0; e < 3; ++e) {
        const std::uint32_t a = mesh.index[k + e] - firstVertex, b = mesh.index[k + (e + 1) % 3] - firstVertex;
        sum[a] += value[b];
        sum[b] += value[a];
        weight[a] += 1;
        weight[b] += 1;
      }
    for (std::size_t i = 0; i < sum.size(); ++i) value[i] = sum[i] / weight[i];
  }
}

template <class Value>
void smoothOverPart(const SceneMesh& mesh, const MeshPart& part, int passes, std::vector<Value>& value) {
  smoothOverEdges(mesh, part.firstIndex, part.endIndex(), part.firstVertex, passes, value);
}

bool occludes(const MeshPart& part) {
  return !part.look->encloses && !part.instrument;
}

// Cosine-weighted sums over directions, per vertex.
struct Gathered {
  std::vector<float> light, total;           // outside: unhindered, and all
  std::vector<float> through, totalThrough;  // inside: what comes through the tissue, and all
};

using Parts = std::vector<const MeshPart*>;

template <class Visit>
void visitVertices(const Parts& parts, const Visit& visit) {
  for (const MeshPart* part : parts)
    for (std::size_t i = part->firstVertex; i < part->endVertex(); ++i) visit(i, *part);
}

// Orthographic depth map of these parts seen against `direction`, and how much light each of their vertices gets along
// it: from outside past what is in the way, from inside through it (Barre-Brisebois and Bouchard 2011, local
// thickness).
void gatherDirection(const SceneMesh& mesh, const Parts& parts, vec3 centre, float radius, vec3 direction,
                     DepthMap& map, std::vector<vec3>& texel, Gathered& sum) {
  const vec3 right = across(direction), up = glm::cross(direction, right);
  const float scale = 0.5f / radius;
  visitVertices(parts, [&](std::size_t i, const MeshPart&) {
    const vec3 p = mesh.position[i] - centre;
    texel[i] = {(glm::dot(p, right) * scale + 0.5f) * kMapSide, (glm::dot(p, up) * scale + 0.5f) * kMapSide,
                0.5f - glm::dot(p, direction) * scale};
  });
  map.clear();
  for (const MeshPart* part : parts) {
    if (!occludes(*part)) continue;
    for (std::uint32_t k = part->firstIndex; k < part->endIndex(); k += 3)
      map.rasterize(texel[mesh.index[k]], texel[mesh.index[k + 1]], texel[mesh.index[k + 2]]);
  }
  const float bias = 2.5f / kMapSide;  // two and a half texels
  visitVertices(parts, [&](std::size_t i, const MeshPart& part) {
    const float cosine = glm::dot(mesh.normal[i], direction);
    if (cosine <= 0) {
      if (part.look->glow == vec3(0) || !occludes(part)) return;
      const int x = int(texel[i].x), y = int(texel[i].y);
      if (x < 0 || y < 0 || x >= kMapSide || y >= kMapSide) return;
      sum.totalThrough[i] -= cosine;
      const float perDepth = 2 * radius / part.look->glowDepth;  // of depths 0..1 of the map: how fast light fades
      sum.through[i] -= cosine * std::exp(-perDepth * std::max(texel[i].z - map.at(x, y), 0.f));
      return;
    }
    sum.total[i] += cosine;
    // Reading one texel along the normal keeps the surface from hiding itself at grazing angles.
    const int x = int(texel[i].x + 1.5f * glm::dot(mesh.normal[i], right)),
              y = int(texel[i].y + 1.5f * glm::dot(mesh.normal[i], up));
    const bool outside = x < 0 || y < 0 || x >= kMapSide || y >= kMapSide;
    if (outside || texel[i].z - bias <= map.at(x, y)) sum.light[i] += cosine;
  });
}

// `texel`: room for the whole mesh.
void gatherLight(const SceneMesh& mesh, const Parts& parts, std::vector<vec3>& texel, Gathered& sum) {
  Bounds bounds;
  for (const MeshPart* part : parts)
    if (occludes(*part)) {
      const Bounds b = boundsOf(mesh, *part);
      bounds.add(b.low);
      bounds.add(b.high);
    }
  if (bounds.low.x > bounds.high.x) return;
  const vec3 centre = 0.5f * (bounds.low + bounds.high);
  const float radius = std::max(0.5f * glm::length(bounds.high - bounds.low), 1e-6f);
  DepthMap map(kMapSide, kMapSide);
  for (int k = 0; k < kDirections; ++k)
    gatherDirection(mesh, parts, centre, radius, spiralDirection(k), map, texel, sum);
}

// Longest and shortest way on the texture per way on the triangle, over all directions.
glm::vec2 stretchOf(const SceneMesh& mesh, const std::uint32_t* t) {
  const vec3 p = mesh.position[t[1]] - mesh.position[t[0]], q = mesh.position[t[2]] - mesh.position[t[0]];
  const glm::vec2 u = mesh.uv[t[1]] - mesh.uv[t[0]], v = mesh.uv[t[2]] - mesh.uv[t[0]];
  // With an orthonormal frame in the triangle, p = (l, 0) and q = (m, h).
  const float l = std::max(glm::length(p), 1e-12f), m = glm::dot(p, q) / l,
              h = std::max(glm::length(glm::cross(p, q)) / l, 1e-12f);
  const glm::vec2 a = u / l, b = (v - a * m) / h;
  const float mean = 0.5f * (glm::dot(a, a) + glm::dot(b, b)), apart = 0.5f * (glm::dot(a, a) - glm::dot(b, b));
  const float spread = std::hypot(apart, glm::dot(a, b));
  return {std::sqrt(mean + spread), std::sqrt(std::max(mean - spread, 0.f))};
}

// Where a surface curves otherwise than a sphere of its mean radius does, and at the pole that the camera sees last,
// unrolled coordinates stretch the texture or squeeze it; vessels would show there as blots and hairs.
void bakeDetail(SceneMesh& mesh, const MeshPart& part) {
  std::vector<float> sum(part.vertexCount, 0.f), weight = sum;
  for (std::size_t k = part.firstIndex; k < part.endIndex(); k += 3) {
    const glm::vec2 stretch = stretchOf(mesh, &mesh.index[k]) / part.look->detailScale;
    if (!std::isfinite(stretch.x) || !std::isfinite(stretch.y)) continue;  // a triangle without area
    const float share = smoothStep(0.2f, 0.45f, stretch.y) * (1 - smoothStep(2.5f, 4.f, stretch.x));
    for (int corner = 0; corner < 3; ++corner) {
      sum[mesh.index[k + corner] - part.firstVertex] += share;
      weight[mesh.index[k + corner] - part.firstVertex] += 1;
    }
  }
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] = weight[i] > 0 ? sum[i] / weight[i] : 1.f;
  smoothOverPart(mesh, part, 2, sum);
  std::copy(sum.begin(), sum.end(), mesh.detail.begin() + part.firstVertex);
}

}  // namespace

// Textures repeat, and rasterisers count texels in fixed point: of bodies hundreds of metres away they ran out of it.
static void keepNearZero(SceneMesh& mesh, const MeshPart& part) {
  constexpr float kFar = 256;  // tiles
  const auto first = mesh.uv.begin() + std::ptrdiff_t(part.firstVertex),
             last = first + std::ptrdiff_t(part.vertexCount);
  const glm::vec2 sum = std::accumulate(first, last, glm::vec2(0)), tile = glm::floor(sum / float(part.vertexCount));
  if (!(glm::length(tile) > kFar)) return;
  for (auto uv = first; uv != last; ++uv) *uv -= tile;
}

void bakeTextureCoordinates(SceneMesh& mesh, const MeshPart& part) {
  const float c = std::cos(part.look->unrollTilt), s = std::sin(part.look->unrollTilt);
  const float radius = part.look->unrollRadius > 0 ? part.look->unrollRadius : meanRadius(mesh, part);
  // Where the texture does not follow the bumps, they must not fold it.
  const auto ofPart = mesh.normal.begin() + part.firstVertex;
  std::vector<vec3> normal(ofPart, ofPart + part.vertexCount);
  if (part.look->unrollRadius <= 0) smoothOverPart(mesh, part, kUnrollPasses, normal);
  // Unrolled around z; what is flat lies across that, whatever the look's tilt.
  const std::optional<vec3> facing = facingOf(mesh, part);
  const auto tilted = [&](vec3 v) {
    if (facing) return turnedToZ(v, *facing);
    return vec3(v.x, c * v.y - s * v.z, s * v.y + c * v.z);
  };
  for (std::uint32_t i = 0, vertex = part.firstVertex; i < part.vertexCount; ++i, ++vertex)
    mesh.uv[vertex] =
        unroll(tilted(mesh.position[vertex]), tilted(glm::normalize(normal[i])), radius) * part.look->detailScale;
  keepNearZero(mesh, part);
  if (occludes(part)) bakeDetail(mesh, part);
}

static vec3 shifted(vec3 p, float cells) {
  const vec3 q = 1.3f * p;
  return p + cells * (vec3(valueNoise(q + 17.f), valueNoise(q + 43.f), valueNoise(q + 71.f)) - 0.5f);
}

void bakeAlbedo(SceneMesh& mesh, const MeshPart& part) {
  const Look& look = *part.look;
  const Bounds bounds = boundsOf(mesh, part);
  const vec3 extent = glm::max(bounds.high - bounds.low, vec3(1e-6f));
  for (std::uint32_t i = part.firstVertex; i < part.endVertex(); ++i) {
    const vec3 p = mesh.position[i], inBox = (p - bounds.low) / extent;
    const float coarse = fractalNoise(p * look.mottleFrequency + 3.f);
    const float middle = fractalNoise(p * look.mottleFrequency * 3.f + 9.f);
    vec3 albedo = mixClamped(look.albedoLow, look.albedoHigh, 0.7f * coarse + 0.55f * (middle - 0.25f));
    for (const Patch& patch : look.patches) {
      if (patch.amount == 0) break;
      vec3 cell = p * patch.frequency + patch.seed;
      if (patch.warp > 0) cell = shifted(cell, patch.warp);
      const float at = patch.noiseWeight * fractalNoise(cell) + glm::dot(patch.gradient, inBox);
      albedo = glm::mix(albedo, patch.colour, patch.amount * smoothStep(patch.from, patch.to, at));
    }
    const vec3 fromSpot = (inBox - vec3(look.spot.place, inBox.z)) * extent;
    if (const float r = look.spot.radius; r > 0)
      albedo = glm::mix(look.spot.colour, albedo, smoothStep(0.5f * r, r, glm::length(fromSpot)));
    mesh.albedo[i] = albedo;
  }
}

// What stays where it is shades its neighbours; what travels would leave its shade behind.
void bakeOpenness(SceneMesh& mesh) {
  const std::size_t n = mesh.position.size();
  const std::vector<float> zero(n, 0.f);
  Gathered sum{zero, zero, zero, zero};
  Parts staying;
  std::vector<vec3> texel(n);
  for (const MeshPart& part : mesh.parts)
    if (part.travels)
      gatherLight(mesh, {&part}, texel, sum);
    else
      staying.push_back(&part);
  gatherLight(mesh, staying, texel, sum);
  for (std::size_t i = 0; i < n; ++i) {
    mesh.openness[i] = sum.total[i] > 0 ? sum.light[i] / sum.total[i] : 1.f;
    mesh.thinness[i] = sum.totalThrough[i] > 0 ? sum.through[i] / sum.totalThrough[i] : 0.f;
  }
  // 64 directions leave bands otherwise.
  smoothOverEdges(mesh, 0, mesh.index.size(), 0, 2, mesh.openness);
  smoothOverEdges(mesh, 0, mesh.index.size(), 0, 2, mesh.thinness);
}

}  // namespace medulla
