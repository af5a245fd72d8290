#include "render/yuv.h"

#include <cassert>
#include <cstring>

namespace medulla {
namespace {

// ITU-R BT.709: Kr = 0.2126, Kb = 0.0722. Luma scaled by 219/255, chroma by 224/255; 16 fractional bits.
constexpr double kR = 0.2126, kB = 0.0722, kG = 1 - kR - kB;
constexpr double kLuma = 65536 * 219 / 255.0, kChroma = 65536 * 224 / 255.0;
constexpr int fixed(double v) {
  return static_cast<int>(v < 0 ? v - 0.5 : v + 0.5);
}
constexpr int kYr = fixed(kLuma * kR), kYg = fixed(kLuma * kG), kYb = fixed(kLuma * kB);
constexpr int kUr = fixed(-kChroma * kR / (2 * (1 - kB))), kUb = fixed(kChroma * 0.5), kUg = -kUr - kUb;
constexpr int kVb = fixed(-kChroma * kB / (2 * (1 - kR))), kVr = fixed(kChroma * 0.5), kVg = -kVb - kVr;
constexpr int kHalf = 1 << 15;

void lumaRow(const std::uint8_t* rgba, int width, std::uint8_t* y) {
  for (int x = 0; x < width; ++x) {
    std::uint32_t p;  // a whole pixel at a time: so the compiler takes eight
    std::memcpy(&p, rgba + 4 * x, sizeof p);
    const int r = p & 255, g = (p >> 8) & 255, b = (p >> 16) & 255;
    y[x] = static_cast<std::uint8_t>(((kYr * r + kYg * g + kYb * b + kHalf) >> 16) + 16);
  }
}

void chromaRow(const std::uint8_t* upper, const std::uint8_t* lower, int width, std::uint8_t* u, std::uint8_t* v) {
  for (int x = 0; x < width / 2; ++x) {
    const std::uint8_t *a = upper + 8 * x, *b = lower + 8 * x;
    const int r = a[0] + a[4] + b[0] + b[4], g = a[1] + a[5] + b[1] + b[5], k = a[2] + a[6] + b[2] + b[6];
    u[x] = static_cast<std::uint8_t>(((kUr * r + kUg * g + kUb * k + 4 * kHalf) >> 18) + 128);
    v[x] = static_cast<std::uint8_t>(((kVr * r + kVg * g + kVb * k + 4 * kHalf) >> 18) + 128);
  }
}

}  // namespace

void rgbaToI420(const Image& image, std::vector<std::uint8_t>& out) {
  const int w = image.width, h = image.height;
  assert(w % 2 == 0 && h % 2 == 0);
  out.resize(w * h * 3ul / 2);
  std::uint8_t *y = out.data(), *u = y + w * h, *v = u + w * h / 4;
  for (int row = 0; row < h; row += 2) {
    const std::uint8_t* upper = image.pixels.data() + 4ul * w * row;
    lumaRow(upper, w, y + w * row);
    lumaRow(upper + 4ul * w, w, y + w * (row + 1));
    chromaRow(upper, upper + 4ul * w, w, u + w / 2 * (row / 2), v + w / 2 * (row / 2));
  }
}

}  // namespace medulla
