#include "render/caption.h"

#include <algorithm>
#include <cmath>

#include "render/stroke_text.h"

namespace medulla {

void drawCaption(const std::string& text, int width, Image& image) {
  constexpr float kReadable = 7, kLegible = 5;  // px
  constexpr glm::vec3 kPaper{0.004f, 0.005f, 0.007f}, kLetters{0.85f, 0.86f, 0.88f};
  const float margin = std::round(0.03f * float(image.height));
  const float pad = 0.9f;  // of the letters' height, on all sides
  const float whole = std::max(kReadable, 0.032f * float(image.height));
  const float widest = float(width) - 2 * margin;
  const float height = std::min(whole, whole * widest / (textWidth(text, whole) + 2 * pad * whole));
  if (text.empty() || height < kLegible) return;
  const glm::vec2 low(margin), corner = low + pad * height;
  Ink ink(image);
  ink.fill(low, low + glm::vec2(textWidth(text, height), height) + 2 * pad * height);
  ink.apply(kPaper, 0.72f);
  writeText(text, corner, height, ink);
  ink.apply(kLetters, 1);
}

}  // namespace medulla
