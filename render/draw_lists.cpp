#include "render/draw_lists.h"

#include <algorithm>
#include <cmath>

namespace medulla {
namespace {

// t: corners of a triangle in VertexLight::vertices.
Shade shadeOf(const Look& look, const VisibleTriangles& seen, const VertexLight& lit, const ShadowMap& shadow,
              const std::uint32_t* t) {
  // Coarse backdrops are judged by whole blocks of the map: an edge could pass between their vertices.
  const auto texel = [&](int corner) { return shadow.texel[seen.vertices[t[corner]]]; };
  if (!look.castsShadow) return shadeOfTriangle(shadow, texel(0), texel(1), texel(2));
  const Shade s = lit.shade[t[0]];
  return s == lit.shade[t[1]] && s == lit.shade[t[2]] ? s : Shade::edge;
}

Variant variantOf(Shade shade, bool glinting) {
  if (shade == Shade::dark) return Variant::dark;
  if (shade == Shade::edge) return glinting ? Variant::edge : Variant::edgeDull;
  return glinting ? Variant::lit : Variant::litDull;
}

// The level with about one texel a pixel along the direction that crosses most. Texture coordinates are interpolated
// linearly in the picture, so their slope is constant over a triangle: computed once here; for each 2x2 pixels, as
// OpenGL does, it would take a tenth of their time.
int detailLevel(const VisibleTriangles& seen, const VertexLight& lit, const std::uint32_t* t, float texelsPerUnit,
                float pixelsPerUnit) {
  const auto picture = [&](int corner) { return glm::vec2(seen.picture[seen.vertices[t[corner]]]) * pixelsPerUnit; };
  const auto texels = [&](int corner) { return lit.vertices[t[corner]].uv * texelsPerUnit; };
  const glm::vec2 b = picture(1) - picture(0), c = picture(2) - picture(0);
  const glm::vec2 ub = texels(1) - texels(0), uc = texels(2) - texels(0);
  const float area = b.x * c.y - b.y * c.x;
  const glm::vec2 alongX = ub * c.y - uc * b.y, alongY = uc * b.x - ub * c.x;
  const float most = std::max(glm::dot(alongX, alongX), glm::dot(alongY, alongY)) / std::max(area * area, 1e-12f);
  if (!(most > 0.5f)) return 0;
  return std::min((std::ilogb(std::min(most, 1e9f)) + 1) / 2, kDetailLevels - 1);
}

}  // namespace

void sortByVariant(const SceneMesh& mesh, const VisibleTriangles& seen, const VertexLight& lit, const ShadowMap* shadow,
                   int pictureHeight, DrawLists& out) {
  out.index.clear();
  out.runs.clear();
  for (const VisiblePart& visible : seen.parts) {
    const MeshPart& part = mesh.parts[visible.part];
    const auto side = float(part.look->detail.side);
    for (auto& levels : out.byVariant)
      for (auto& list : levels) list.clear();
    for (std::uint32_t k = visible.firstIndex; k < visible.endIndex(); k += 3) {
      const std::uint32_t* t = &seen.index[k];
      const Shade shade = shadow && !part.instrument ? shadeOf(*part.look, seen, lit, *shadow, t) : Shade::lit;
      const bool glinting = lit.glinting[t[0]] || lit.glinting[t[1]] || lit.glinting[t[2]];
      auto& list = out.byVariant[static_cast<std::size_t>(variantOf(shade, glinting))]
                                [detailLevel(seen, lit, t, side, float(pictureHeight))];
      list.insert(list.end(), t, t + 3);
    }
    for (int v = 0; v < kVariants; ++v)
      for (int level = 0; level < kDetailLevels; ++level) {
        const auto& list = out.byVariant[v][level];
        if (list.empty()) continue;
        out.runs.push_back({visible.part, static_cast<Variant>(v), level, std::uint32_t(out.index.size()),
                            std::uint32_t(list.size())});
        out.index.insert(out.index.end(), list.begin(), list.end());
      }
  }
}

}  // namespace medulla
