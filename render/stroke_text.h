#pragma once

#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "render/image.h"

// Lines and letters over a finished picture, on the CPU: the same values give the same bytes in every OpenGL.
namespace medulla {

// What is drawn with one colour: how much of each pixel it covers. Strokes that cross cover a pixel once.
class Ink {
 public:
  Ink(Image& image, glm::vec2 low, glm::vec2 high);     // px; what lies outside of these corners is cut off
  void stroke(glm::vec2 a, glm::vec2 b, float radius);  // px; with round ends, a dot where both ends are one
  void fill(glm::vec2 low, glm::vec2 high);             // px
  void apply(glm::vec3 colour, float opacity);          // linear RGB; puts it on the picture and starts anew

 private:
  // Calls `shareAt(x, y)` for the pixels of this box that lie in the ink's.
  template <class Share>
  void cover(glm::vec2 low, glm::vec2 high, const Share& shareAt);

  Image& image_;
  glm::ivec2 low_, size_;     // px
  std::vector<float> cover_;  // 0..1 per pixel
  std::vector<std::size_t> touched_;
};

// What letters and curves lie on, and the least height of letters that can be read.
inline constexpr glm::vec3 kPaper{0.004f, 0.005f, 0.007f};
inline constexpr float kPaperOpacity = 0.72f;
inline constexpr float kLegible = 5;  // px

// Letters of strokes, `height` px high from the line that they stand on to the top of capitals; a third of it more
// below, as much above accents. Characters that glyphs.h does not know are empty boxes.
float textWidth(const std::string& text, float height);                             // px
void writeText(const std::string& text, glm::vec2 corner, float height, Ink& ink);  // corner: upper left

}  // namespace medulla
