#include "render/tissue_pass.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <numbers>

#include "render/detail_texture.h"
#include "render/gl_functions.h"
#include "render/shaders.h"

namespace medulla {
namespace {

constexpr int kMaskSegments = 96;

unsigned makeTexture(int filter) {
  unsigned texture = 0;
  glGenTextures(1, &texture);
  glBindTexture(GL_TEXTURE_2D, texture);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
  return texture;
}

// The levels of a mipmap as textures of their own: DrawRun::level says which.
std::vector<unsigned> makeDetail(const Look& look, int seed) {
  std::vector<std::uint8_t> texels = makeDetailTexture(look.detail, seed);
  const auto upload = [&texels](int side) {
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, side, side, 0, GL_RGBA, GL_UNSIGNED_BYTE, texels.data());
  };
  const unsigned whole = makeTexture(GL_LINEAR);
  std::vector<unsigned> levels{whole};
  upload(look.detail.side);
  glGenerateMipmap(GL_TEXTURE_2D);
  for (int side = look.detail.side / 2; side > 0; side /= 2) {
    glBindTexture(GL_TEXTURE_2D, whole);
    glGetTexImage(GL_TEXTURE_2D, int(levels.size()), GL_RGBA, GL_UNSIGNED_BYTE, texels.data());
    levels.push_back(makeTexture(GL_LINEAR));
    upload(side);
  }
  return levels;
}

unsigned makeShadowTexture(int side) {
  const unsigned texture = makeTexture(GL_NEAREST);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R32F, side + DepthMap::kPadding, side, 0, GL_RED, GL_FLOAT, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return texture;
}

// A corner of each square of taps, widest first, for a soft edge of radius 1: each with the same share of the disc,
// turned on by the golden section of a quarter. Squares that stand alike put their taps' steps one upon the other, as
// teeth along the edge. In a finer map an edge is more texels wide, and takes more squares; where four pixels become
// one, fewer.
std::vector<glm::vec2> shadowSquares(int shadowSide, bool supersampled) {
  const int n = ((supersampled ? 3 : 4) * shadowSide + kShadowSide / 2) / kShadowSide;
  std::vector<glm::vec2> squares;
  for (int k = 0; k < n; ++k) {
    const float angle = 0.618f * 0.5f * std::numbers::pi_v<float> * float(k);
    squares.push_back(0.9f * std::sqrt((float(n - k) - 0.5f) / float(n)) * glm::vec2(std::cos(angle), std::sin(angle)));
  }
  return squares;
}

// Of the map's size, and the squares as a choice by k.
std::string shadowDefines(int shadowSide, const std::vector<glm::vec2>& squares) {
  std::string square;
  for (std::size_t k = 0; k < squares.size(); ++k)
    square += fmt::format("{}vec2({:.4f}, {:.4f})", k ? fmt::format(" : k == {} ? ", k) : "k == 0 ? ", squares[k].x,
                          squares[k].y);
  return fmt::format("#define SHADOW_WIDTH {}.\n#define SHADOW_HEIGHT {}.\n#define WIDEST {}\n#define SQUARE {}\n",
                     shadowSide + DepthMap::kPadding, shadowSide, squares.size() / 3, square + " : vec2(0)");
}

}  // namespace

TissuePass::Program TissuePass::makeProgram(Variant v, int shadowSide, bool supersampled) {
  const bool dull = v == Variant::litDull || v == Variant::edgeDull;
  const int shade = v == Variant::dark ? 2 : v == Variant::edge || v == Variant::edgeDull ? 1 : 0;
  const std::vector<glm::vec2> squares = shadowSquares(shadowSide, supersampled);
  Program p;
  p.id = buildProgram("#define SHADE " + std::to_string(shade) + "\n" + (dull ? "#define DULL\n" : "") +
                          (supersampled ? "#define SUPERSAMPLED\n" : "") + "#define FILM_PEAK " +
                          std::to_string(kFilmPeak) + "\n" + shadowDefines(shadowSide, squares),
                      kTissueVertexShader, kTissueFragmentShader);
  const auto uniform = [&p](const char* name) { return glGetUniformLocation(p.id, name); };
  p.clipFromWorld = uniform("clipFromWorld");
  p.shadowFromWorld = uniform("shadowFromWorld");
  p.surface = uniform("surface");
  p.lobes = uniform("lobes");
  p.tint = uniform("tint");
  p.opacity = uniform("opacity");
  glUseProgram(p.id);
  glUniform1i(uniform("detail"), 0);
  glUniform1i(uniform("shadowMap"), 1);
  glUniform1i(uniform("squares"), int(squares.size()));
  return p;
}

TissuePass::TissuePass(int shadowSide, bool supersampled) {
  for (int v = 0; v < kVariants; ++v) programs_[v] = makeProgram(static_cast<Variant>(v), shadowSide, supersampled);
  maskProgram_ = buildProgram("", kMaskVertexShader, kMaskFragmentShader);
  shadowTexture_ = makeShadowTexture(shadowSide);

  glGenVertexArrays(1, &vertexArray_);
  glGenBuffers(1, &vertices_);
  glGenBuffers(1, &indices_);
  glBindVertexArray(vertexArray_);
  glBindBuffer(GL_ARRAY_BUFFER, vertices_);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_);
  readAttribute(0, 3, sizeof(LitVertex), offsetof(LitVertex, position));
  readAttribute(1, 4, sizeof(LitVertex), offsetof(LitVertex, direct));   // and gloss
  readAttribute(2, 4, sizeof(LitVertex), offsetof(LitVertex, ambient));  // and shadowRadius
  readAttribute(3, 4, sizeof(LitVertex), offsetof(LitVertex, halfway));  // and shadowBias
  readAttribute(4, 4, sizeof(LitVertex), offsetof(LitVertex, uv));       // and detail, seam

  glGenVertexArrays(1, &maskArray_);
  glGenBuffers(1, &maskBuffer_);
}

TissuePass::~TissuePass() {
  for (const Program& p : programs_) glDeleteProgram(p.id);
  glDeleteProgram(maskProgram_);
  for (const auto& [look, levels] : textures_) glDeleteTextures(int(levels.size()), levels.data());
  glDeleteTextures(1, &shadowTexture_);
  for (const unsigned b : {vertices_, indices_, maskBuffer_}) glDeleteBuffers(1, &b);
  for (const unsigned a : {vertexArray_, maskArray_}) glDeleteVertexArrays(1, &a);
}

void TissuePass::addLook(const Look& look) {
  if (textures_.contains(look.name)) return;
  // The seed is the look's place in the table, not the order of use: a scene's pictures do not depend on its order.
  const int seed = int(&look - looks().data());
  textures_[look.name] = makeDetail(look, seed);
}

void TissuePass::drawMask(const Viewpoint& view) {
  std::vector<glm::vec2> strip;
  for (int k = 0; k <= kMaskSegments; ++k) {
    const float a = 2 * std::numbers::pi_v<float> * float(k) / kMaskSegments;
    const glm::vec2 d(std::cos(a), std::sin(a));
    // A little outside the rim, which the post-process draws; the polygon's sides cut the corners by 0.05 %.
    strip.push_back(2.004f * view.rim * d / glm::vec2(view.aspect, 1));
    strip.push_back(3.f * d);
  }
  glUseProgram(maskProgram_);
  glBindVertexArray(maskArray_);
  glBindBuffer(GL_ARRAY_BUFFER, maskBuffer_);
  glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(strip.size() * sizeof(glm::vec2)), strip.data(), GL_STREAM_DRAW);
  readAttribute(0, 2, sizeof(glm::vec2), 0);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, int(strip.size()));
}

void TissuePass::upload(const VertexLight& lit, const DrawLists& lists, const ShadowMap* shadow) {
  glBindVertexArray(vertexArray_);
  glBindBuffer(GL_ARRAY_BUFFER, vertices_);
  glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(lit.vertices.size() * sizeof(LitVertex)), lit.vertices.data(),
               GL_STREAM_DRAW);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, GLsizeiptr(lists.index.size() * sizeof(std::uint32_t)), lists.index.data(),
               GL_STREAM_DRAW);
  if (!shadow) return;
  glActiveTexture(GL_TEXTURE1);
  glBindTexture(GL_TEXTURE_2D, shadowTexture_);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, shadow->map.stride, shadow->map.height, GL_RED, GL_FLOAT,
                  shadow->map.depth.data());
  glActiveTexture(GL_TEXTURE0);
}

void TissuePass::draw(const SceneMesh& mesh, const DrawLists& lists, const std::vector<char>& wanted,
                      const Viewpoint& view, const LightView& lightView, float opacity) {
  if (opacity >= 1) {
    drawRuns(mesh, lists, wanted, view, lightView, opacity);
    return;
  }
  // Depth first: only the nearest layer blends. In one pass as many would as the triangles' order lets through, and the
  // runs' outlines would show.
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  drawRuns(mesh, lists, wanted, view, lightView, opacity);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDepthFunc(GL_LEQUAL);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
  drawRuns(mesh, lists, wanted, view, lightView, opacity);
  glDisable(GL_BLEND);
  glDepthFunc(GL_LESS);
}

void TissuePass::drawRuns(const SceneMesh& mesh, const DrawLists& lists, const std::vector<char>& wanted,
                          const Viewpoint& view, const LightView& lightView, float opacity) {
  glBindVertexArray(vertexArray_);
  const DrawRun* last = nullptr;  // its program and uniforms serve the other levels, too
  for (const DrawRun& run : lists.runs) {
    if (!wanted[run.part]) continue;
    const Look& look = *mesh.parts[run.part].look;
    if (!last || last->part != run.part || last->variant != run.variant) {
      const Program& p = programs_[static_cast<std::size_t>(run.variant)];
      const GlossLobes lobes = glossLobes(look);
      const float bleed = std::clamp(2 * (look.wrap.r - look.wrap.b), 0.f, 1.f);
      glUseProgram(p.id);
      glUniformMatrix4fv(p.clipFromWorld, 1, GL_FALSE, glm::value_ptr(view.clipFromWorld));
      glUniformMatrix4fv(p.shadowFromWorld, 1, GL_FALSE, glm::value_ptr(lightView.clipFromWorld));
      glUniform4f(p.surface, look.mottle, look.vessels, look.bump, bleed);
      glUniform4f(p.lobes, lobes.a1 - 1, lobes.c1, lobes.a2 - 1, lobes.c2);
      glUniform3f(p.tint, look.vesselTint.x, look.vesselTint.y, look.vesselTint.z);
      glUniform1f(p.opacity, opacity);
    }
    last = &run;
    const std::vector<unsigned>& levels = textures_.at(look.name);
    glBindTexture(GL_TEXTURE_2D, levels[std::min(std::size_t(run.level), levels.size() - 1)]);
    glDrawElements(GL_TRIANGLES, int(run.indexCount), GL_UNSIGNED_INT,
                   bufferOffset(run.firstIndex * sizeof(std::uint32_t)));
  }
}

}  // namespace medulla
