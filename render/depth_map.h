#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace medulla {

// Map of the smallest depth per texel, rasterised on the CPU: a shadow map of the casters takes under a
// millisecond here and several in software OpenGL.
struct DepthMap {
  static constexpr int kPadding = 8;  // texels past the right edge, where whole blocks of them are written

  DepthMap(int widthInTexels, int heightInTexels);
  void clear();  // to 1, the farthest
  // Corners in texels (x, y) and depth 0..1, counter-clockwise; other triangles face away and are dropped. Texels whose
  // centre lies inside take part.
  void rasterize(glm::vec3 a, glm::vec3 b, glm::vec3 c);
  float at(int x, int y) const { return depth[std::size_t(y) * stride + x]; }

  int width, height, stride;  // texels; stride: width + kPadding
  std::vector<float> depth;   // stride * height
};

}  // namespace medulla
