#include "render/stroke_text.h"

#include <algorithm>
#include <cmath>

#include "render/glyphs.h"

namespace medulla {

using glm::vec2;

Ink::Ink(Image& image, vec2 low, vec2 high)
    : image_(image),
      low_(glm::max(glm::ivec2(low), 0)),
      size_(glm::max(glm::min(glm::ivec2(glm::ceil(high)), {image.width, image.height}) - low_, 0)),
      cover_(std::size_t(size_.x) * size_.y, 0.f) {}

template <class Share>
void Ink::cover(vec2 low, vec2 high, const Share& shareAt) {
  const glm::ivec2 from = glm::max(glm::ivec2(low) - low_, 0), end = glm::min(glm::ivec2(high) - low_, size_);
  for (int y = from.y; y < end.y; ++y)
    for (int x = from.x; x < end.x; ++x) {
      const float share = shareAt(low_.x + x, low_.y + y);
      if (share <= 0) continue;
      const std::size_t i = std::size_t(y) * size_.x + x;
      if (cover_[i] == 0) touched_.push_back(i);
      cover_[i] = std::max(cover_[i], share);
    }
}

void Ink::stroke(vec2 a, vec2 b, float radius) {
  const vec2 along = b - a;
  const float length2 = glm::dot(along, along);
  cover(glm::min(a, b) - radius - 1.f, glm::max(a, b) + radius + 2.f, [&](int x, int y) {
    const vec2 p = vec2(float(x) + 0.5f, float(y) + 0.5f) - a;
    const float u = length2 > 0 ? glm::clamp(glm::dot(p, along) / length2, 0.f, 1.f) : 0.f;
    return glm::clamp(radius + 0.5f - glm::length(p - u * along), 0.f, 1.f);
  });
}

void Ink::fill(vec2 low, vec2 high) {
  cover(low, high, [](int, int) { return 1.f; });
}

void Ink::apply(glm::vec3 colour, float opacity) {
  glm::vec3 shown;
  for (int c = 0; c < 3; ++c) shown[c] = 255 * float(srgbFromLight(colour[c]));
  for (const std::size_t i : touched_) {
    const float share = opacity * cover_[i];
    const std::size_t x = low_.x + i % size_.x, y = low_.y + i / size_.x;
    std::uint8_t* pixel = &image_.pixels[4 * (y * image_.width + x)];
    for (int c = 0; c < 3; ++c)
      pixel[c] = std::uint8_t(std::lround(float(pixel[c]) + share * (shown[c] - float(pixel[c]))));
    cover_[i] = 0;
  }
  touched_.clear();
}

namespace {

constexpr float kGlyphHeight = 6;  // grid units of a capital

// Turns of up to 66 degrees are of arcs: a quarter circle on the grid is two of 45. Bezier curves take their place.
void appendCorner(vec2 before, vec2 corner, vec2 after, float unit, std::vector<vec2>& path) {
  constexpr int kPieces = 6;
  constexpr float kLongest = 0.75f;  // grid units of a stroke that the curve may take; half of it where it is short
  const vec2 in = corner - before, out = after - corner;
  const float inLength = glm::length(in), outLength = glm::length(out);
  if (glm::dot(in, out) < 0.4f * inLength * outLength) {
    path.push_back(corner);
    return;
  }
  const vec2 from = corner - std::min(0.5f, kLongest * unit / inLength) * in,
             to = corner + std::min(0.5f, kLongest * unit / outLength) * out;
  for (int k = 0; k <= kPieces; ++k) {
    const float t = float(k) / kPieces;
    path.push_back(glm::mix(glm::mix(from, corner, t), glm::mix(corner, to, t), t));
  }
}

// A polyline of the grid, at least two points, with its arcs made round.
void strokeLine(const std::vector<vec2>& points, float unit, float radius, Ink& ink) {
  std::vector<vec2> path;
  const std::size_t last = points.size() - 1;
  const bool isClosed = last > 1 && points[0] == points[last];
  if (!isClosed) path.push_back(points[0]);
  for (std::size_t k = 1; k < last; ++k) appendCorner(points[k - 1], points[k], points[k + 1], unit, path);
  if (isClosed) {
    appendCorner(points[last - 1], points[0], points[1], unit, path);
    path.push_back(path[0]);
  } else {
    path.push_back(points[last]);
  }
  for (std::size_t k = 1; k < path.size(); ++k) ink.stroke(path[k - 1], path[k], radius);
}

void strokeAll(const char* strokes, vec2 corner, float unit, float radius, Ink& ink) {
  for (const char* at = strokes; *at;) {
    std::vector<vec2> points;
    for (; *at && *at != ' '; at += 2) points.push_back(corner + unit * vec2(float(at[0] - '0'), float(at[1] - '0')));
    strokeLine(points, unit, radius, ink);
    if (*at) ++at;
  }
}

}  // namespace

float textWidth(const std::string& text, float height) {
  float width = 0;
  for (const Letter& letter : lettersOf(text)) width += letter.glyph->advance;
  return width * height / kGlyphHeight;
}

void writeText(const std::string& text, vec2 corner, float height, Ink& ink) {
  const float unit = height / kGlyphHeight, radius = 0.085f * height;
  for (const Letter& letter : lettersOf(text)) {
    strokeAll(letter.glyph->strokes, corner, unit, radius, ink);
    strokeAll(letter.mark, corner + unit * letter.markAt, letter.markStep * unit, radius, ink);
    corner.x += letter.glyph->advance * unit;
  }
}

}  // namespace medulla
