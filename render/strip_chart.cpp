#include "render/strip_chart.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "render/stroke_text.h"

namespace medulla {
namespace {

using glm::vec2;

constexpr glm::vec3 kGrid{0.12f, 0.13f, 0.15f}, kGrey{0.50f, 0.52f, 0.55f};

constexpr float kReadable = 6.5f;  // px, the least height of the letters of forces

// Corners and sizes in pixels.
struct Layout {
  vec2 low, high;          // of the paper
  vec2 plotLow, plotHigh;  // of the curves
  float text = 0;          // height of letters; 0: too small to be read
  float small = 0;         // of those beside them
  float thin = 0;          // radius of lines

  explicit Layout(const Image& image) {
    const float bottom = float(image.height), h = std::min(bottom, float(image.width)), margin = std::round(0.03f * h);
    const float width = std::round(std::min(0.52f * h, 0.45f * float(image.width)));
    low = {margin, bottom - margin - std::round(0.2f * h)};
    high = {margin + width, bottom - margin};
    text = image.height < 120 ? 0 : std::max(0.026f * h, kReadable);
    small = std::max(0.62f * text, kLegible);
    plotLow = low + vec2(0.016f * h, text > 0 ? 0.008f * h + 2 * text : 0.016f * h);
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

// Of the range's label, below the upper line.
vec2 rangeCorner(const Layout& layout) {
  return layout.at(0, 1) + vec2(0.5f, 0.6f) * layout.small;
}

// Is there room for that label above the lower line, where the curves of no force lie?
bool hasRange(const Layout& layout) {
  return layout.text > 0 && rangeCorner(layout).y + 1.3f * layout.small < layout.at(0, 0).y;
}

void drawGrid(const StripChart& chart, const Layout& layout, Ink& ink) {
  // No line goes through the label.
  const vec2 label = rangeCorner(layout) + vec2(textWidth(chart.rangeLabel, layout.small) + 1, 1.6f * layout.small);
  const bool labelled = hasRange(layout);
  for (const float v : {0.f, 0.5f, 1.f}) {
    vec2 left = layout.at(0, v);
    if (labelled && v == 0.5f && left.y < label.y) left.x = label.x;
    ink.stroke(onPixel(left), onPixel(layout.at(1, v)), layout.thin);
  }
  for (int t = int(chart.now); float(t) > chart.now - chart.seconds; --t) {
    const float u = 1 - (chart.now - float(t)) / chart.seconds;
    vec2 top = layout.at(u, 1);
    if (labelled && top.x < label.x) top.y = std::clamp(label.y, top.y, layout.at(u, 0).y);
    ink.stroke(onPixel(layout.at(u, 0)), onPixel(top), layout.thin);
  }
  ink.apply(kGrid, 1);
}

void drawCurve(const StripChart& chart, const StripCurve& curve, const Layout& layout, Ink& ink) {
  const std::size_t count = curve.values.size();
  const auto point = [&](std::size_t k) {
    return layout.at(float(k) / float(count - 1), glm::clamp(curve.values[k] / chart.range, 0.f, 1.f));
  };
  // A tick after the other they would be sixteen strokes to a pixel and more.
  constexpr float kShortest = 0.25f;  // px
  const vec2 last = point(count - 1);
  vec2 from = point(0);
  for (std::size_t k = 1; k < count; ++k) {
    const vec2 to = point(k);
    if (k + 1 < count && glm::distance(from, to) < kShortest) continue;
    ink.stroke(from, to, 2.2f * layout.thin);
    from = to;
  }
  ink.stroke(last, last, 6 * layout.thin);
  ink.apply(glm::vec3(curve.colour), 1);
}

// In the order of their labels: as they stand in the chart or, where not all of these fit, by the largest force that
// the window shows, which seldom changes.
std::vector<const StripCurve*> inOrder(const StripChart& chart, bool allFit) {
  std::vector<const StripCurve*> out;
  for (const StripCurve& curve : chart.curves) out.push_back(&curve);
  const auto most = [](const StripCurve* c) { return *std::max_element(c->values.begin(), c->values.end()); };
  const auto larger = [&](const StripCurve* a, const StripCurve* b) { return most(a) > most(b); };
  if (!allFit) std::stable_sort(out.begin(), out.end(), larger);
  return out;
}

// Of many tools smaller letters, and then none that do not fit; the window's length only where there is room for it.
void writeLabels(const StripChart& chart, const Layout& layout, Ink& ink) {
  const float header = layout.low.y + 0.75f * layout.text, small = layout.small;
  const float windowAt = layout.plotHigh.x - textWidth(chart.windowLabel, small);
  float wide = 0;
  for (const StripCurve& curve : chart.curves) wide += textWidth(curve.label + "   ", layout.text);
  const float text = std::max(layout.text * std::min(1.f, (windowAt - layout.plotLow.x) / wide), kLegible);
  vec2 corner(layout.plotLow.x, header + layout.text - text);
  const float room = layout.plotHigh.x - corner.x + textWidth("   ", text);
  const bool allFit = wide * text <= room * layout.text;
  for (const StripCurve* curve : inOrder(chart, allFit)) {
    if (corner.x + textWidth(curve->label, text) > layout.plotHigh.x) break;
    writeText(curve->label, corner, text, ink);
    ink.apply(glm::vec3(curve->colour), 1);
    corner.x += textWidth(curve->label + "   ", text);
  }
  if (corner.x <= windowAt) writeText(chart.windowLabel, {windowAt, header + layout.text - small}, small, ink);
  if (hasRange(layout)) writeText(chart.rangeLabel, rangeCorner(layout), small, ink);
  ink.apply(kGrey, 1);
}

}  // namespace

void drawStripChart(const StripChart& chart, Image& image) {
  if (chart.curves.empty()) return;
  const Layout layout(image);
  Ink ink(image, layout.low, layout.high);
  ink.fill(layout.low, layout.high);
  ink.apply(kPaper, kPaperOpacity);
  drawGrid(chart, layout, ink);
  if (layout.text > 0) writeLabels(chart, layout, ink);
  for (const StripCurve& curve : chart.curves) drawCurve(chart, curve, layout, ink);
}

}  // namespace medulla
