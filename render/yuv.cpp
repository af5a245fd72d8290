#include "render/yuv.h"

#include <cassert>
#include <cstring>

namespace medulla {
namespace {

// Kr and Kb of ITU-R BT.709 and BT.601. Luma scaled by 219/255, chroma by 224/255; 16 fractional bits.
constexpr double kLuma = 65536 * 219 / 255.0, kChroma = 65536 * 224 / 255.0;
constexpr int fixed(double v) {
  return static_cast<int>(v < 0 ? v - 0.5 : v + 0.5);
}
struct Weights {
  int yr, yg, yb, ur, ug, ub, vr, vg, vb;
};
constexpr Weights weightsOf(double r, double b) {
  Weights w{};
  w.yr = fixed(kLuma * r), w.yg = fixed(kLuma * (1 - r - b)), w.yb = fixed(kLuma * b);
  w.ur = fixed(-kChroma * r / (2 * (1 - b))), w.ub = fixed(kChroma * 0.5), w.ug = -w.ur - w.ub;
  w.vb = fixed(-kChroma * b / (2 * (1 - r))), w.vr = fixed(kChroma * 0.5), w.vg = -w.vb - w.vr;
  return w;
}
constexpr Weights kBt709 = weightsOf(0.2126, 0.0722), kBt601 = weightsOf(0.299, 0.114);
constexpr int kHalf = 1 << 15;

template <const Weights& weights>
void lumaRow(const std::uint8_t* rgba, int width, std::uint8_t* y) {
  for (int x = 0; x < width; ++x) {
    std::uint32_t p;  // a whole pixel at a time: so the compiler takes eight
    std::memcpy(&p, rgba + 4 * x, sizeof p);
    const int r = p & 255, g = (p >> 8) & 255, b = (p >> 16) & 255;
    y[x] = static_cast<std::uint8_t>(((weights.yr * r + weights.yg * g + weights.yb * b + kHalf) >> 16) + 16);
  }
}

template <const Weights& weights>
void chromaRow(const std::uint8_t* upper, const std::uint8_t* lower, int width, std::uint8_t* u, std::uint8_t* v) {
  for (int x = 0; x < width / 2; ++x) {
    const std::uint8_t *a = upper + 8 * x, *b = lower + 8 * x;
    const int r = a[0] + a[4] + b[0] + b[4], g = a[1] + a[5] + b[1] + b[5], k = a[2] + a[6] + b[2] + b[6];
    u[x] = static_cast<std::uint8_t>(((weights.ur * r + weights.ug * g + weights.ub * k + 4 * kHalf) >> 18) + 128);
    v[x] = static_cast<std::uint8_t>(((weights.vr * r + weights.vg * g + weights.vb * k + 4 * kHalf) >> 18) + 128);
  }
}

template <const Weights& weights>
void convert(const Image& image, std::uint8_t* y) {
  const int w = image.width, h = image.height;
  std::uint8_t *u = y + w * h, *v = u + w * h / 4;
  for (int row = 0; row < h; row += 2) {
    const std::uint8_t* upper = image.pixels.data() + 4ul * w * row;
    lumaRow<weights>(upper, w, y + w * row);
    lumaRow<weights>(upper + 4ul * w, w, y + w * (row + 1));
    chromaRow<weights>(upper, upper + 4ul * w, w, u + w / 2 * (row / 2), v + w / 2 * (row / 2));
  }
}

}  // namespace

void rgbaToI420(const Image& image, YuvMatrix matrix, std::vector<std::uint8_t>& out) {
  assert(image.width % 2 == 0 && image.height % 2 == 0);
  out.resize(image.width * image.height * 3ul / 2);
  matrix == YuvMatrix::bt709 ? convert<kBt709>(image, out.data()) : convert<kBt601>(image, out.data());
}

}  // namespace medulla
