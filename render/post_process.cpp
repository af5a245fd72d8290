#include "render/post_process.h"

#include <immintrin.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "render/noise.h"
#include "render/viewpoint.h"

namespace medulla {
namespace {

// Contrast that counts as an edge: of 255, and relative to the brightest neighbour (an eighth).
constexpr int kEdgeThreshold = 9, kRelativeShift = 3;
constexpr int kSearch = 14;           // px along an edge to either side
constexpr float kSubpixel = 0.5f;     // how strongly single pixels that stick out are softened
constexpr int kMargin = kSearch + 2;  // of repeated pixels around the picture: no step leaves them

// Glare: pixels brighter than this (of 255) spread over a few cells of kCell^2 pixels.
constexpr int kCell = 8, kGlareFrom = 205;
constexpr float kGlareAmount = 0.34f, kGlareTint[3] = {1.f, 0.93f, 0.88f};

constexpr float kRound = 0.5f;  // the values are positive

// Rec. 601 luma, 7 bits of fraction.
int luma(int r, int g, int b) {
  return (38 * r + 75 * g + 15 * b) >> 7;
}

struct Blend {
  int dx, dy;   // px, of the neighbour from here
  float share;  // 0..0.5 of its colour
};

// Steps along the edge until the mean of the two rows beside it changes: that is where the edge jumps a row.
struct EdgeEnd {
  int distance;
  bool above;  // the mean rose
};
EdgeEnd followEdge(const std::uint8_t* here, std::ptrdiff_t across, std::ptrdiff_t along, int twiceMean, int limit) {
  for (int k = 1; k < kSearch; ++k) {
    const std::ptrdiff_t at = k * along;
    const int d = here[at] + here[at + across] - twiceMean;
    if (std::abs(d) >= limit) return {k, d > 0};
  }
  return {kSearch, here[kSearch * along] + here[kSearch * along + across] > twiceMean};
}

// The same in both directions of a row, all steps at once.
struct EdgeEnds {
  EdgeEnd left, right;
};
EdgeEnds followRow(const std::uint8_t* here, std::ptrdiff_t across, int twiceMean, int limit) {
  static_assert(kSearch < 16);
  const auto rise = [=](std::ptrdiff_t from) {  // of 16 pixels
    const auto load = [](const std::uint8_t* p) {
      return _mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
    };
    return _mm256_sub_epi16(_mm256_add_epi16(load(here + from), load(here + from + across)),
                            _mm256_set1_epi16(short(twiceMean)));
  };
  const auto bits = [](__m256i flags) {  // two for each pixel, made one
    const __m256i packed = _mm256_permute4x64_epi64(_mm256_packs_epi16(flags, flags), 0x08);
    return unsigned(_mm_movemask_epi8(_mm256_castsi256_si128(packed)));
  };
  const __m256i below = _mm256_set1_epi16(short(limit - 1)), zero = _mm256_setzero_si256();
  const __m256i before = rise(-16), after = rise(1);  // pixels -16..-1 and 1..16
  constexpr unsigned kLast = 1u << (kSearch - 1), kSteps = 2 * kLast - 1;
  // The last step ends the search whatever it finds.
  const unsigned leftEnds = (bits(_mm256_cmpgt_epi16(_mm256_abs_epi16(before), below)) | 1u << (16 - kSearch));
  const unsigned rightEnds = (bits(_mm256_cmpgt_epi16(_mm256_abs_epi16(after), below)) & kSteps) | kLast;
  const int left = std::countl_zero(std::uint16_t(leftEnds)), right = std::countr_zero(rightEnds);
  const unsigned leftRises = bits(_mm256_cmpgt_epi16(before, zero)), rightRises = bits(_mm256_cmpgt_epi16(after, zero));
  return {{left + 1, (leftRises >> (15 - left) & 1) != 0}, {right + 1, (rightRises >> right & 1) != 0}};
}

// FXAA 3.11 (Lottes 2011): which neighbour the edge runs beside, and how much of it a straight edge between the two
// jumps would let into this pixel.
Blend findBlend(const std::uint8_t* m, std::ptrdiff_t stride) {
  const int n = m[-stride], s = m[stride], w = m[-1], e = m[1], here = m[0];
  const int nw = m[-stride - 1], ne = m[-stride + 1], sw = m[stride - 1], se = m[stride + 1];
  const int horizontal = std::abs(nw + sw - 2 * w) + 2 * std::abs(n + s - 2 * here) + std::abs(ne + se - 2 * e);
  const int vertical = std::abs(nw + ne - 2 * n) + 2 * std::abs(w + e - 2 * here) + std::abs(sw + se - 2 * s);
  const bool level = horizontal >= vertical;
  const int before = level ? n : w, after = level ? s : e;
  const std::ptrdiff_t step = level ? stride : 1, along = level ? 1 : stride;
  const bool towardsBefore = std::abs(before - here) >= std::abs(after - here);
  const std::ptrdiff_t across = towardsBefore ? -step : step;
  const int other = towardsBefore ? before : after, contrast = std::abs(other - here);

  const int twiceMean = here + other, limit = std::max(contrast / 2, 1);
  const auto [left, right] =
      level ? followRow(m, across, twiceMean, limit)
            : EdgeEnds{followEdge(m, across, -along, twiceMean, limit), followEdge(m, across, along, twiceMean, limit)};
  const EdgeEnd nearest = left.distance < right.distance ? left : right;
  const bool darker = 2 * here < twiceMean;
  const float span = float(left.distance + right.distance);
  const float straight = darker == nearest.above ? 0.5f - float(nearest.distance) / span : 0.f;

  const int low = std::min({n, s, w, e, here}), high = std::max({n, s, w, e, here});
  const float mean = float(2 * (n + s + w + e) + nw + ne + sw + se) / 12;
  const float alone = std::min(std::abs(mean - float(here)) / float(std::max(high - low, 1)), 1.f);
  const float soft = alone * alone * (3 - 2 * alone);
  const int side = towardsBefore ? -1 : 1;
  return {level ? 0 : side, level ? side : 0, std::max(straight, soft * soft * kSubpixel)};
}

}  // namespace

PostProcess::PostProcess(int width, int height)
    : width_(width),
      height_(height),
      lumaStride_(width + 2 * kMargin),
      luma_(std::size_t(lumaStride_) * (height + 2 * kMargin)),
      edge_(width + 7),
      black_(4ul * width),
      cellsX_(width / kCell + 3),
      cellsY_(height / kCell + 3),
      glare_(std::size_t(cellsX_) * cellsY_),
      blurred_(glare_.size()) {
  for (std::size_t k = 3; k < black_.size(); k += 4) black_[k] = 255;
}

// For the first picture that is round: most never are.
void PostProcess::findRim() {
  const int width = width_, height = height_;
  const float h = float(height), inner = rimInner(float(width) / h), outer = rimOuter(float(width) / h);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float px = (float(x) + 0.5f - 0.5f * float(width)) / h, py = (float(y) + 0.5f - 0.5f * h) / h;
      const float r = std::sqrt(px * px + py * py);
      if (r <= inner) continue;
      // The fade is meant in light; pixels are gamma coded.
      const float share = std::pow(smoothStep(outer, inner, r), 1 / 2.2f);
      const auto at = std::uint32_t(y * width + x);
      if (const auto factor = std::uint8_t(255 * share + kRound); factor > 0)
        rim_.push_back({at, factor});
      else if (!outside_.empty() && outside_.back().first + outside_.back().count == at && x > 0)
        ++outside_.back().count;
      else
        outside_.push_back({at, 1});
    }
}

void PostProcess::fadeRim(Image& image) {
  if (rim_.empty() && outside_.empty()) findRim();
  for (const Span& s : outside_) std::memcpy(&image.pixels[4ul * s.first], black_.data(), 4ul * s.count);
  for (const RimPixel& r : rim_) {
    std::uint8_t* p = &image.pixels[4ul * r.index];
    for (int c = 0; c < 3; ++c) p[c] = std::uint8_t(p[c] * r.factor / 255);
  }
}

void PostProcess::gatherHighlights(const Image& image) {
  std::fill(glare_.begin(), glare_.end(), 0.f);
  for (int cy = 0; cy < height_ / kCell; ++cy)
    for (int cx = 0; cx < width_ / kCell; ++cx) {
      int sum = 0;
      for (int y = 0; y < kCell; y += 2) {  // every fourth pixel tells enough
        const std::uint8_t* p = &image.pixels[4ul * (std::size_t(cy * kCell + y) * width_ + cx * kCell)];
        for (int x = 0; x < kCell; x += 2) sum += std::max(p[4 * x + 1] - kGlareFrom, 0);
      }
      glare_[std::size_t(cy + 1) * cellsX_ + cx + 1] = float(sum) * (4.f / (kCell * kCell));
    }
}

// Binomial blur, along x and y, three times: a halo of about three cells.
void PostProcess::blurGlare() {
  const std::size_t stride = cellsX_, n = glare_.size();
  for (int pass = 0; pass < 3; ++pass) {
    blurred_ = glare_;
    for (std::size_t i = 1; i + 1 < n; ++i) blurred_[i] = 0.25f * (glare_[i - 1] + 2 * glare_[i] + glare_[i + 1]);
    for (std::size_t i = stride; i + stride < n; ++i)
      glare_[i] = 0.25f * (blurred_[i - stride] + 2 * blurred_[i] + blurred_[i + stride]);
  }
}

void PostProcess::addGlare(Image& image) {
  gatherHighlights(image);
  blurGlare();
  // Between the centres of four cells the halo is interpolated; most of the picture has none.
  for (int cy = 0; cy + 1 < cellsY_; ++cy)
    for (int cx = 0; cx + 1 < cellsX_; ++cx) {
      const float* g = &glare_[std::size_t(cy) * cellsX_ + cx];
      const float a = g[0], b = g[1], c = g[cellsX_], d = g[cellsX_ + 1];
      if (kGlareAmount * std::max({a, b, c, d}) < kRound) continue;  // no level of difference
      const int x0 = cx * kCell - kCell / 2, y0 = cy * kCell - kCell / 2;
      for (int y = std::max(y0, 0); y < std::min(y0 + kCell, height_); ++y)
        for (int x = std::max(x0, 0); x < std::min(x0 + kCell, width_); ++x) {
          const float u = (float(x - x0) + 0.5f) / kCell, v = (float(y - y0) + 0.5f) / kCell;
          const float halo = kGlareAmount * ((a + (b - a) * u) * (1 - v) + (c + (d - c) * u) * v);
          std::uint8_t* p = &image.pixels[4ul * (std::size_t(y) * width_ + x)];
          for (int k = 0; k < 3; ++k) {  // screen: never beyond white
            const float now = p[k];
            p[k] = std::uint8_t(now + halo * kGlareTint[k] * (255 - now) * (1.f / 255) + kRound);
          }
        }
    }
}

void PostProcess::computeLuma(const Image& image) {
  const int width = width_;  // bytes written might be those of width_: no vectors then
  for (int y = 0; y < height_; ++y) {
    const std::uint8_t* p = &image.pixels[4ul * y * width];
    std::uint8_t* out = &luma_[lumaIndex(0, y)];
    for (int x = 0; x < width; ++x) out[x] = std::uint8_t(luma(p[4 * x], p[4 * x + 1], p[4 * x + 2]));
    std::fill_n(out - kMargin, kMargin, out[0]);
    std::fill_n(out + width, kMargin, out[width - 1]);
  }
  const auto repeat = [this](int from, int to) {
    std::memcpy(&luma_[lumaIndex(-kMargin, to)], &luma_[lumaIndex(-kMargin, from)], lumaStride_);
  };
  for (int k = 1; k <= kMargin; ++k) {
    repeat(0, -k);
    repeat(height_ - 1, height_ - 1 + k);
  }
}

std::size_t PostProcess::lumaIndex(int x, int y) const {
  return std::size_t(y + kMargin) * lumaStride_ + std::size_t(x + kMargin);
}

void PostProcess::smoothPixel(const Image& image, int x, int y) {
  const Blend blend = findBlend(&luma_[lumaIndex(x, y)], lumaStride_);
  const auto at = [this](int px, int py) { return std::size_t(py) * width_ + px; };
  const std::size_t neighbour = at(std::clamp(x + blend.dx, 0, width_ - 1), std::clamp(y + blend.dy, 0, height_ - 1));
  const std::uint8_t *p = &image.pixels[4 * at(x, y)], *q = &image.pixels[4 * neighbour];
  Smoothed s{std::uint32_t(at(x, y)), {}};
  for (int c = 0; c < 3; ++c) s.rgb[c] = std::uint8_t(float(p[c]) + (float(q[c]) - float(p[c])) * blend.share + kRound);
  smoothed_.push_back(s);
}

void PostProcess::smoothRow(const Image& image, int y) {
  const std::uint8_t *here = &luma_[lumaIndex(0, y)], *above = here - lumaStride_, *below = here + lumaStride_;
  std::uint8_t* edge = edge_.data();
  const int width = width_;  // as in computeLuma()
  for (int x = 0; x < width; ++x) {
    const std::uint8_t a = above[x - 1], b = above[x + 1], c = below[x - 1], d = below[x + 1], m = here[x];
    const std::uint8_t low = std::min(std::min(std::min(a, b), std::min(c, d)), m);
    const std::uint8_t high = std::max(std::max(std::max(a, b), std::max(c, d)), m);
    const std::uint8_t limit = std::max<std::uint8_t>(kEdgeThreshold, high >> kRelativeShift);
    edge[x] = std::uint8_t(high - low) > limit;
  }
  // Eight flags of 0 or 1 at a time: few are set.
  for (int x = 0; x < width; x += 8) {
    std::uint64_t flags = 0;
    std::memcpy(&flags, edge + x, sizeof flags);
    for (; flags != 0; flags &= flags - 1) smoothPixel(image, x + std::countr_zero(flags) / 8, y);
  }
}

void PostProcess::smoothEdges(Image& image) {
  computeLuma(image);
  smoothed_.clear();
  for (int y = 0; y < height_; ++y) smoothRow(image, y);
  for (const Smoothed& s : smoothed_) std::copy(s.rgb, s.rgb + 3, &image.pixels[4ul * s.index]);
}

}  // namespace medulla
