#include "render/caption.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "render/stroke_text.h"

namespace medulla {
namespace {

constexpr float kReadable = 7;                 // px
constexpr float kPad = 0.9f, kLeading = 1.6f;  // of the letters' height: on all sides; from line to line

float widestOf(const std::vector<std::string>& lines, float height) {
  float widest = 0;
  for (const std::string& line : lines) widest = std::max(widest, textWidth(line, height));
  return widest;
}

// Bytes of as many letters of a word as fit, at least one's.
std::size_t lettersThatFit(const std::string& word, float height, float width) {
  std::size_t end = 0;
  for (std::size_t next = 1; next <= word.size(); ++next) {
    if (next < word.size() && (word[next] & 0xC0) == 0x80) continue;  // within a letter of UTF-8
    if (end > 0 && textWidth(word.substr(0, next), height) > width) break;
    end = next;
  }
  return end;
}

// Between words, whose distances stay; within one that is wider than a line.
std::vector<std::string> wrapped(const std::string& text, float height, float width) {
  std::vector<std::string> lines;
  std::size_t end = 0;
  for (std::size_t begin = 0; (begin = text.find_first_not_of(' ', end)) != std::string::npos;) {
    const std::size_t from = end;
    end = std::min(text.find(' ', begin), text.size());
    const std::string longer = lines.empty() ? "" : lines.back() + text.substr(from, end - from);
    if (!lines.empty() && textWidth(longer, height) <= width) {
      lines.back() = longer;
      continue;
    }
    std::string word = text.substr(begin, end - begin);
    while (!word.empty()) {
      lines.push_back(word.substr(0, lettersThatFit(word, height, width)));
      word.erase(0, lines.back().size());
    }
  }
  return lines;
}

}  // namespace

bool drawCaption(const std::string& text, int width, Image& image) {
  constexpr float kLowest = 0.15f, kHighest = 0.3f;  // of the picture: where letters end that could be smaller; a box
  constexpr glm::vec3 kLetters{0.85f, 0.86f, 0.88f};
  const float margin = std::round(0.03f * float(image.height));
  const float whole = std::max(kReadable, 0.032f * float(image.height));
  const float widest = float(width) - 2 * margin;
  const glm::vec2 low(margin);
  // As large as every other: what is too wide goes on in the next line, as long as there is room for one.
  float height = whole;
  std::vector<std::string> lines;
  glm::vec2 high;
  const auto layOut = [&] {
    const float room = widest - 2 * kPad * height;
    lines = textWidth(text, height) <= room ? std::vector{text} : wrapped(text, height, room);
    high =
        low + glm::vec2(widestOf(lines, height), height * (1 + kLeading * float(lines.size() - 1))) + 2 * kPad * height;
    const float lowest = height > kReadable ? kLowest * float(image.height) + kPad * height
                                            : std::max(kHighest * float(image.height), low.y + 3 * height);
    return high.x <= float(width) && high.y <= lowest;
  };
  while (!layOut()) {
    if (height <= kReadable) return false;
    height = std::max(kReadable, 0.9f * height);
  }
  Ink ink(image, low, high);
  ink.fill(low, high);
  ink.apply(kPaper, kPaperOpacity);
  for (std::size_t k = 0; k < lines.size(); ++k)
    writeText(lines[k], low + kPad * height + glm::vec2(0, kLeading * height * float(k)), height, ink);
  ink.apply(kLetters, 1);
  return true;
}

}  // namespace medulla
