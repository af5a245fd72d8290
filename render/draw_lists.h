#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "render/vertex_light.h"

namespace medulla {

// Shader variants, cheapest that gives the right pixel: no highlight, no shadow edge.
enum class Variant : std::uint8_t { lit, edge, dark, litDull, edgeDull };
constexpr int kVariants = 5;

// Triangles drawn by one call.
struct DrawRun {
  std::size_t part = 0;
  Variant variant = Variant::lit;
  std::uint32_t firstIndex = 0, indexCount = 0;
};

struct DrawLists {
  std::vector<std::uint32_t> index;  // of VertexLight::vertices
  std::vector<DrawRun> runs;         // front to back
  std::array<std::vector<std::uint32_t>, kVariants> byVariant;
};

void sortByVariant(const SceneMesh& mesh, const VisibleTriangles& seen, const VertexLight& lit, const ShadowMap* shadow,
                   DrawLists& out);

}  // namespace medulla
