#include "render/post_process.h"

#include <algorithm>
#include <cmath>

#include "render/noise.h"
#include "render/viewpoint.h"

namespace medulla {
namespace {

// FXAA's settings: contrast that counts as an edge (of 255, and relative to the brightest neighbour), and the farthest
// a tap reaches, px.
constexpr int kEdgeThreshold = 9, kRelativeShift = 3;
constexpr float kReach = 8, kReduce = 1.f / 32, kReduceMinimum = 2;
constexpr int kMargin = 9;  // rows and columns without smoothing: no tap leaves the picture

struct Colour {
  float r, g, b;
};

Colour bilinear(const Image& image, float x, float y) {
  const int xi = int(x), yi = int(y);
  const float u = x - float(xi), v = y - float(yi);
  const std::uint8_t *p = &image.pixels[4ul * (std::size_t(yi) * image.width + xi)], *q = p + 4ul * image.width;
  const auto channel = [&](int c) {
    const float top = float(p[c]) + (float(p[c + 4]) - float(p[c])) * u;
    const float bottom = float(q[c]) + (float(q[c + 4]) - float(q[c])) * u;
    return top + (bottom - top) * v;
  };
  return {channel(0), channel(1), channel(2)};
}

Colour mean(Colour a, Colour b) {
  return {(a.r + b.r) / 2, (a.g + b.g) / 2, (a.b + b.b) / 2};
}

// Rec. 601 luma, 7 bits of fraction.
int luma(int r, int g, int b) {
  return (38 * r + 75 * g + 15 * b) >> 7;
}

}  // namespace

PostProcess::PostProcess(int width, int height)
    : width_(width), height_(height), luma_(std::size_t(width) * height), edge_(width) {
  const float h = float(height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float px = (float(x) + 0.5f - 0.5f * float(width)) / h, py = (float(y) + 0.5f - 0.5f * h) / h;
      const float r = std::sqrt(px * px + py * py);
      if (r <= kRimInner) continue;
      // The fade is meant in light; pixels are gamma coded.
      const float share = std::pow(smoothStep(kRimOuter, kRimInner, r), 1 / 2.2f);
      rim_.push_back({std::uint32_t(y * width + x), std::uint8_t(255 * share + 0.5f)});
    }
}

void PostProcess::fadeRim(Image& image) const {
  for (const RimPixel& r : rim_) {
    std::uint8_t* p = &image.pixels[4ul * r.index];
    for (int c = 0; c < 3; ++c) p[c] = std::uint8_t(p[c] * r.factor / 255);
  }
}

void PostProcess::computeLuma(const Image& image) {
  const std::uint8_t* p = image.pixels.data();
  std::uint8_t* out = luma_.data();
  const std::size_t n = luma_.size();
  for (std::size_t i = 0; i < n; ++i) out[i] = std::uint8_t(luma(p[4 * i], p[4 * i + 1], p[4 * i + 2]));
}

void PostProcess::smoothRow(const Image& image, int y) {
  const std::uint8_t *above = &luma_[std::size_t(y - 1) * width_], *here = above + width_, *below = here + width_;
  std::uint8_t* edge = edge_.data();
  const int end = width_ - kMargin;
  for (int x = kMargin; x < end; ++x) {
    const std::uint8_t a = above[x - 1], b = above[x + 1], c = below[x - 1], d = below[x + 1], m = here[x];
    const std::uint8_t low = std::min(std::min(std::min(a, b), std::min(c, d)), m);
    const std::uint8_t high = std::max(std::max(std::max(a, b), std::max(c, d)), m);
    const std::uint8_t limit = std::max<std::uint8_t>(kEdgeThreshold, high >> kRelativeShift);
    edge[x] = std::uint8_t(high - low) > limit;
  }
  for (int x = kMargin; x < end; ++x) {
    if (!edge[x]) continue;
    const float nw = above[x - 1], ne = above[x + 1], sw = below[x - 1], se = below[x + 1];
    float dx = (sw + se) - (nw + ne), dy = (nw + sw) - (ne + se);
    const float reduce = std::max((nw + ne + sw + se) * kReduce, kReduceMinimum);
    const float scale = 1 / (std::min(std::abs(dx), std::abs(dy)) + reduce);
    dx = std::clamp(dx * scale, -kReach, kReach);
    dy = std::clamp(dy * scale, -kReach, kReach);
    const auto tap = [&](float t) { return bilinear(image, float(x) + dx * t, float(y) + dy * t); };
    const Colour narrow = mean(tap(-1.f / 6), tap(1.f / 6)), wide = mean(narrow, mean(tap(-0.5f), tap(0.5f)));
    const float low = std::min({nw, ne, sw, se, float(here[x])}), high = std::max({nw, ne, sw, se, float(here[x])});
    const auto wideLuma = float(luma(int(wide.r), int(wide.g), int(wide.b)));
    const Colour& best = wideLuma < low || wideLuma > high ? narrow : wide;
    const auto byte = [](float v) { return std::uint8_t(v + 0.5f); };
    smoothed_.push_back({std::uint32_t(y * width_ + x), {byte(best.r), byte(best.g), byte(best.b)}});
  }
}

void PostProcess::smoothEdges(Image& image) {
  computeLuma(image);
  smoothed_.clear();
  for (int y = kMargin; y < height_ - kMargin; ++y) smoothRow(image, y);
  for (const Smoothed& s : smoothed_) std::copy(s.rgb, s.rgb + 3, &image.pixels[4ul * s.index]);
}

}  // namespace medulla
