#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "render/draw_lists.h"

namespace medulla {

// The OpenGL side of tissue and steel: programs, detail textures, buffers. Needs a current context.
class TissuePass {
 public:
  TissuePass(int shadowSide, bool supersampled);  // texels of ShadowMap; several pixels become one
  ~TissuePass();
  TissuePass(const TissuePass&) = delete;
  TissuePass& operator=(const TissuePass&) = delete;

  void addLook(const Look& look);  // makes its texture, once
  void drawMask(const Viewpoint& viewpoint);
  void upload(const VertexLight& lit, const DrawLists& lists, const ShadowMap* shadow);
  // Draws the runs of the parts for which `wanted` is set; opacity < 1 blends the nearest of them over what
  // is there.
  void draw(const SceneMesh& mesh, const DrawLists& lists, const std::vector<char>& wanted, const Viewpoint& viewpoint,
            const LightView& lightView, float opacity);

 private:
  struct Program {
    unsigned id = 0;
    int clipFromWorld, shadowFromWorld, surface, lobes, tint, opacity;
  };
  static Program makeProgram(Variant variant, int shadowSide, bool supersampled);
  void drawRuns(const SceneMesh& mesh, const DrawLists& lists, const std::vector<char>& wanted,
                const Viewpoint& viewpoint, const LightView& lightView, float opacity);

  std::array<Program, kVariants> programs_;
  std::map<std::string, std::vector<unsigned>> textures_;  // by look; one for each level
  unsigned maskProgram_ = 0, maskArray_ = 0, maskBuffer_ = 0;
  unsigned vertexArray_ = 0, vertices_ = 0, indices_ = 0, shadowTexture_ = 0;
};

}  // namespace medulla
