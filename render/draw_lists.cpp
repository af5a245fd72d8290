#include "render/draw_lists.h"

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

}  // namespace

void sortByVariant(const SceneMesh& mesh, const VisibleTriangles& seen, const VertexLight& lit, const ShadowMap* shadow,
                   DrawLists& out) {
  out.index.clear();
  out.runs.clear();
  for (const VisiblePart& visible : seen.parts) {
    const MeshPart& part = mesh.parts[visible.part];
    for (auto& list : out.byVariant) list.clear();
    for (std::uint32_t k = visible.firstIndex; k < visible.firstIndex + visible.indexCount; k += 3) {
      const std::uint32_t* t = &seen.index[k];
      const Shade shade = shadow && !part.instrument ? shadeOf(*part.look, seen, lit, *shadow, t) : Shade::lit;
      const bool glinting = lit.glinting[t[0]] || lit.glinting[t[1]] || lit.glinting[t[2]];
      auto& list = out.byVariant[static_cast<std::size_t>(variantOf(shade, glinting))];
      list.insert(list.end(), t, t + 3);
    }
    for (int v = 0; v < kVariants; ++v) {
      const auto& list = out.byVariant[v];
      if (list.empty()) continue;
      out.runs.push_back(
          {visible.part, static_cast<Variant>(v), std::uint32_t(out.index.size()), std::uint32_t(list.size())});
      out.index.insert(out.index.end(), list.begin(), list.end());
    }
  }
}

}  // namespace medulla
