#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "render/vertex_light.h"

namespace medulla {

// Shader variants, cheapest that gives the right pixel: no highlight, no shadow edge.
enum class Variant : std::uint8_t { lit, edge, dark, litDull, edgeDull };
constexpr int kVariants = 5;

// Levels of a detail texture, each half as fine as the one before: more than its side of at most 1024 texels has.
constexpr int kDetailLevels = 11;

// Triangles drawn by one call.
struct DrawRun {
  std::size_t part = 0;
  Variant variant = Variant::lit;
  int level = 0;  // of the detail texture
  std::uint32_t firstIndex = 0, indexCount = 0;
};

struct DrawLists {
  std::vector<std::uint32_t> index;  // of VertexLight::vertices
  std::vector<DrawRun> runs;         // front to back
  std::array<std::array<std::vector<std::uint32_t>, kDetailLevels>, kVariants> byVariant;
};

// pictureHeight: px.
void sortByVariant(const SceneMesh& mesh, const VisibleTriangles& seen, const VertexLight& lit, const ShadowMap* shadow,
                   int pictureHeight, DrawLists& out);

}  // namespace medulla
