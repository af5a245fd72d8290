#include "render/image.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace medulla {
namespace {

// The gate of the second tier. SSE2 against AVX2 stays below all three; one picture later, a missing shadow or missing
// occlusion is beyond at least one.
constexpr int kNoticeable = 4, kGross = 16;
constexpr double kNoticeablePercentLimit = 0.05, kPsnrLimit = 50;
constexpr long kGrossLimit = 5;

void assertSameSize([[maybe_unused]] const Image& a, [[maybe_unused]] const Image& b) {
  assert(a.width == b.width && a.height == b.height);
  assert(a.pixels.size() == b.pixels.size() && a.pixels.size() == 4ul * a.width * a.height);
}

}  // namespace

Image blackImage(int width, int height) {
  Image image{width, height, std::vector<std::uint8_t>(4ul * width * height, 0)};
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) image.pixels[i] = 255;
  return image;
}

void copyInto(const Image& part, int x, Image& whole) {
  assert(part.height == whole.height && x >= 0 && x + part.width <= whole.width);
  const std::size_t row = 4ul * part.width;
  for (int y = 0; y < part.height; ++y)
    std::copy_n(&part.pixels[row * y], row, &whole.pixels[4 * (std::size_t(whole.width) * y + x)]);
}

ImageDifference compareImages(const Image& a, const Image& b) {
  assertSameSize(a, b);
  ImageDifference d;
  long overFour = 0;
  double squares = 0;
  for (std::size_t i = 0; i < a.pixels.size(); i += 4) {
    int worst = 0;
    for (std::size_t c = 0; c < 4; ++c) {
      const int e = std::abs(a.pixels[i + c] - b.pixels[i + c]);
      worst = std::max(worst, e);
      if (c < 3) squares += e * e;
    }
    overFour += worst > kNoticeable;
    d.overSixteen += worst > kGross;
  }
  const double pixels = 0.25 * static_cast<double>(a.pixels.size());
  d.equal = a.pixels == b.pixels;
  d.overFourPercent = pixels > 0 ? 100 * overFour / pixels : 0;
  d.psnr =
      squares > 0 ? 10 * std::log10(255.0 * 255.0 * 3 * pixels / squares) : std::numeric_limits<double>::infinity();
  return d;
}

bool withinTolerance(const ImageDifference& d) {
  return d.overFourPercent <= kNoticeablePercentLimit && d.overSixteen <= kGrossLimit && d.psnr >= kPsnrLimit;
}

Image amplifiedDifference(const Image& a, const Image& b, int gain) {
  assertSameSize(a, b);
  Image out{a.width, a.height, std::vector<std::uint8_t>(a.pixels.size(), 255)};
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    if (i % 4 != 3)
      out.pixels[i] = static_cast<std::uint8_t>(std::min(255, gain * std::abs(a.pixels[i] - b.pixels[i])));
  return out;
}

double lightFromSrgb(double shown) {
  return shown <= 0.04045 ? shown / 12.92 : std::pow((shown + 0.055) / 1.055, 2.4);
}

double srgbFromLight(double light) {
  return light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
}

}  // namespace medulla
