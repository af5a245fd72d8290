#include "render/visible_triangles.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace medulla {
namespace {

// Front to back by the farthest vertex: the cavity's wall, which surrounds the camera, comes last.
std::vector<std::size_t> frontToBack(const SceneMesh& mesh, const VertexLight& lit) {
  std::vector<float> farthest(mesh.parts.size(), 0.f);
  for (std::size_t p = 0; p < mesh.parts.size(); ++p) {
    const MeshPart& part = mesh.parts[p];
    for (std::uint32_t i = part.firstVertex; i < part.firstVertex + part.vertexCount; ++i)
      farthest[p] = std::max(farthest[p], lit.picture[i].z);
  }
  std::vector<std::size_t> order(mesh.parts.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return farthest[a] < farthest[b]; });
  return order;
}

bool isVisible(glm::vec3 a, glm::vec3 b, glm::vec3 c, const Viewpoint& view) {
  if (a.z < kNearPlane && b.z < kNearPlane && c.z < kNearPlane) return false;
  if (a.z < kNearPlane || b.z < kNearPlane || c.z < kNearPlane) return true;  // OpenGL clips it
  if ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) <= 0) return false;
  const float x0 = std::min({a.x, b.x, c.x}), x1 = std::max({a.x, b.x, c.x});
  const float y0 = std::min({a.y, b.y, c.y}), y1 = std::max({a.y, b.y, c.y});
  const float halfWidth = 0.5f * view.aspect;
  if (x0 > halfWidth || x1 < -halfWidth || y0 > 0.5f || y1 < -0.5f) return false;
  const float x = std::max({0.f, x0, -x1}), y = std::max({0.f, y0, -y1});
  return !view.round || x * x + y * y < kRimOuter * kRimOuter;
}

Shade shadeOf(const Look& look, const VertexLight& lit, const ShadowMap& shadow, const std::uint32_t* t) {
  // Coarse backdrops are judged by whole blocks of the map: an edge could pass between their vertices.
  if (!look.castsShadow) return shadeOfTriangle(shadow, shadow.texel[t[0]], shadow.texel[t[1]], shadow.texel[t[2]]);
  const Shade s = lit.shade[t[0]];
  return s == lit.shade[t[1]] && s == lit.shade[t[2]] ? s : Shade::edge;
}

Variant variantOf(Shade shade, bool glinting) {
  if (shade == Shade::dark) return Variant::dark;
  if (shade == Shade::edge) return glinting ? Variant::edge : Variant::edgeDull;
  return glinting ? Variant::lit : Variant::litDull;
}

}  // namespace

void sortVisibleTriangles(const SceneMesh& mesh, const VertexLight& lit, const ShadowMap* shadow, const Viewpoint& view,
                          DrawLists& out) {
  out.index.clear();
  out.runs.clear();
  for (const std::size_t p : frontToBack(mesh, lit)) {
    const MeshPart& part = mesh.parts[p];
    for (auto& list : out.byVariant) list.clear();
    for (std::uint32_t k = part.firstIndex; k < part.firstIndex + part.indexCount; k += 3) {
      const std::uint32_t* t = &mesh.index[k];
      if (!isVisible(lit.picture[t[0]], lit.picture[t[1]], lit.picture[t[2]], view)) continue;
      const Shade shade = shadow && !part.instrument ? shadeOf(*part.look, lit, *shadow, t) : Shade::lit;
      const bool glinting = lit.glinting[t[0]] || lit.glinting[t[1]] || lit.glinting[t[2]];
      auto& list = out.byVariant[static_cast<std::size_t>(variantOf(shade, glinting))];
      list.insert(list.end(), t, t + 3);
    }
    for (int v = 0; v < kVariants; ++v) {
      const auto& list = out.byVariant[v];
      if (list.empty()) continue;
      out.runs.push_back({p, static_cast<Variant>(v), std::uint32_t(out.index.size()), std::uint32_t(list.size())});
      out.index.insert(out.index.end(), list.begin(), list.end());
    }
  }
}

}  // namespace medulla
