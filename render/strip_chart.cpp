#include "render/strip_chart.h"

#include <algorithm>
#include <cmath>

namespace medulla {
namespace {

using glm::vec2;

constexpr glm::vec3 kPaper{0.004f, 0.005f, 0.007f}, kGrid{0.12f, 0.13f, 0.15f}, kGrey{0.50f, 0.52f, 0.55f};

// What is drawn with one colour: how much of each pixel it covers. Strokes that cross cover a pixel once.
class Ink {
 public:
  explicit Ink(Image& image) : image_(image), cover_(std::size_t(image.width) * image.height, 0.f) {}

  // A line with round ends; a dot where both ends are one.
  void stroke(vec2 a, vec2 b, float radius) {
    const vec2 low = glm::min(a, b) - radius - 1.f, high = glm::max(a, b) + radius + 1.f;
    const vec2 along = b - a;
    const float length2 = glm::dot(along, along);
    const int x0 = std::max(0, int(low.x)), x1 = std::min(image_.width - 1, int(high.x));
    const int y0 = std::max(0, int(low.y)), y1 = std::min(image_.height - 1, int(high.y));
    for (int y = y0; y <= y1; ++y)
      for (int x = x0; x <= x1; ++x) {
        const vec2 p = vec2(float(x) + 0.5f, float(y) + 0.5f) - a;
        const float u = length2 > 0 ? glm::clamp(glm::dot(p, along) / length2, 0.f, 1.f) : 0.f;
        add(x, y, glm::clamp(radius + 0.5f - glm::length(p - u * along), 0.f, 1.f));
      }
  }

  void fill(vec2 low, vec2 high) {
    for (int y = std::max(0, int(low.y)); y < std::min(image_.height, int(high.y)); ++y)
      for (int x = std::max(0, int(low.x)); x < std::min(image_.width, int(high.x)); ++x) add(x, y, 1);
  }

  // Puts it on the picture and starts anew.
  void apply(glm::vec3 colour, float opacity) {
    glm::vec3 shown;
    for (int c = 0; c < 3; ++c) shown[c] = 255 * float(srgbFromLight(colour[c]));
    for (const std::size_t i : touched_) {
      const float share = opacity * cover_[i];
      for (std::size_t c = 0; c < 3; ++c) {
        std::uint8_t& pixel = image_.pixels[4 * i + c];
        pixel = std::uint8_t(std::lround(float(pixel) + share * (shown[int(c)] - float(pixel))));
      }
      cover_[i] = 0;
    }
    touched_.clear();
  }

 private:
  void add(int x, int y, float share) {
    if (share <= 0) return;
    float& cover = cover_[std::size_t(y) * image_.width + x];
    if (cover == 0) touched_.push_back(std::size_t(y) * image_.width + x);
    cover = std::max(cover, share);
  }

  Image& image_;
  std::vector<float> cover_;  // 0..1 per pixel
  std::vector<std::size_t> touched_;
};

// Glyphs as strokes between points of a grid, x 0..4 to the right and y 0..6 downwards; a blank lifts the pen.
struct Glyph {
  char character;
  float advance;
  const char* strokes;
};
constexpr Glyph kGlyphs[] = {{'0', 6,
                              "1030414536160501"
                              "10"},
                             {'1', 5, "112026"},
                             {'2', 6, "01103041420646"},
                             {'3', 6, "004022324345361605"},
                             {'4', 6, "36300444"},
                             {'5', 6,
                              "4000023243453616"
                              "05"},
                             {'6', 6,
                              "3011030516364544"
                              "3303"},
                             {'7', 6, "004016"},
                             {'8', 6,
                              "1030414233130201"
                              "10 1304051636454433"},
                             {'9', 6,
                              "1635434130100102"
                              "1343"},
                             {'.', 3, "0606"},
                             {'-', 6, "1333"},
                             {'N', 6, "06004640"},
                             {'s', 6, "4212031434453606"},
                             {' ', 3, ""}};

const Glyph& glyphOf(char character) {
  for (const Glyph& g : kGlyphs)
    if (g.character == character) return g;
  return kGlyphs[std::size(kGlyphs) - 1];
}

float textWidth(const std::string& text, float height) {
  float width = 0;
  for (const char c : text) width += glyphOf(c).advance;
  return width * height / 6;
}

void write(const std::string& text, vec2 corner, float height, Ink& ink) {
  const float unit = height / 6;
  for (const char c : text) {
    const Glyph& glyph = glyphOf(c);
    const char* s = glyph.strokes;
    const auto point = [&](const char* at) { return corner + unit * vec2(float(at[0] - '0'), float(at[1] - '0')); };
    for (const char* at = s; *at; at += 2) {
      if (*at == ' ') ++at;
      if (at[2] && at[2] != ' ') ink.stroke(point(at), point(at + 2), 0.085f * height);
    }
    corner.x += glyph.advance * unit;
  }
}

// Corners and sizes in pixels.
struct Layout {
  vec2 low, high;          // of the paper
  vec2 plotLow, plotHigh;  // of the curves
  float text = 0;          // height of letters; 0: too small to be read
  float thin = 0;          // radius of lines

  explicit Layout(const Image& image) {
    const float h = float(image.height), margin = std::round(0.03f * h);
    const float width = std::round(std::min(0.52f * h, 0.45f * float(image.width)));
    low = {margin, h - margin - std::round(0.2f * h)};
    high = {margin + width, h - margin};
    text = image.height < 120 ? 0 : 0.026f * h;
    plotLow = low + vec2(0.016f * h, text > 0 ? 0.060f * h : 0.016f * h);
    plotHigh = high - 0.016f * h;
    thin = 0.0007f * h;
  }
  // u over the window, v over the range, both 0..1.
  vec2 at(float u, float v) const {
    return {plotLow.x + u * (plotHigh.x - plotLow.x), plotHigh.y - v * (plotHigh.y - plotLow.y)};
  }
};

// Onto the middle of a pixel: lines across would be two pixels of half the strength.
vec2 onPixel(vec2 p) {
  return glm::floor(p) + 0.5f;
}

void drawGrid(const StripChart& chart, const Layout& layout, Ink& ink) {
  for (const float v : {0.f, 0.5f, 1.f}) ink.stroke(onPixel(layout.at(0, v)), onPixel(layout.at(1, v)), layout.thin);
  for (int t = int(chart.now); float(t) > chart.now - chart.seconds; --t) {
    const float u = 1 - (chart.now - float(t)) / chart.seconds;
    ink.stroke(onPixel(layout.at(u, 0)), onPixel(layout.at(u, 1)), layout.thin);
  }
  ink.apply(kGrid, 1);
}

void drawCurve(const StripChart& chart, const StripCurve& curve, const Layout& layout, Ink& ink) {
  const std::size_t count = curve.values.size();
  const auto point = [&](std::size_t k) {
    return layout.at(float(k) / float(count - 1), glm::clamp(curve.values[k] / chart.range, 0.f, 1.f));
  };
  for (std::size_t k = 1; k < count; ++k) ink.stroke(point(k - 1), point(k), 2.2f * layout.thin);
  ink.stroke(point(count - 1), point(count - 1), 6 * layout.thin);
  ink.apply(glm::vec3(curve.colour), 1);
}

void writeLabels(const StripChart& chart, const Layout& layout, Ink& ink) {
  const float header = layout.low.y + 0.75f * layout.text, small = 0.62f * layout.text;
  vec2 corner(layout.plotLow.x, header);
  for (const StripCurve& curve : chart.curves) {
    write(curve.label, corner, layout.text, ink);
    ink.apply(glm::vec3(curve.colour), 1);
    corner.x += textWidth(curve.label + "   ", layout.text);
  }
  write(chart.windowLabel, {layout.plotHigh.x - textWidth(chart.windowLabel, small), header + layout.text - small},
        small, ink);
  ink.apply(kGrey, 1);
  const vec2 range = layout.at(0, 1) + vec2(0.5f * small, 0.6f * small);
  ink.fill(range - 0.3f * small, range + vec2(textWidth(chart.rangeLabel, small), 1.3f * small));  // no line through it
  ink.apply(kPaper, 1);
  write(chart.rangeLabel, range, small, ink);
  ink.apply(kGrey, 1);
}

}  // namespace

void drawStripChart(const StripChart& chart, Image& image) {
  const Layout layout(image);
  Ink ink(image);
  ink.fill(layout.low, layout.high);
  ink.apply(kPaper, 0.72f);
  drawGrid(chart, layout, ink);
  if (layout.text > 0) writeLabels(chart, layout, ink);
  for (const StripCurve& curve : chart.curves) drawCurve(chart, curve, layout, ink);
}

}  // namespace medulla
