#include "render/flip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

// The perceptual metric against what its formulas give in closed form.
namespace medulla {
namespace {

Image picture(int width, int height, const std::function<std::array<int, 3>(int x, int y)>& colour) {
  Image image{width, height, std::vector<std::uint8_t>(4ul * width * height, 255)};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c) image.pixels[4 * (std::size_t(y) * width + x) + c] = std::uint8_t(colour(x, y)[c]);
  return image;
}
Image ofColour(int r, int g, int b) {
  return picture(48, 32, [&](int, int) { return std::array{r, g, b}; });
}
Image noise(unsigned seed) {
  return picture(48, 32, [&](int, int) {
    std::array<int, 3> c{};
    for (int& v : c) v = int((seed = seed * 1664525u + 1013904223u) >> 24);
    return c;
  });
}
// A disc of one grey on another, its centre `shift` px to the right.
Image disc(float shift, int inside = 180) {
  return picture(96, 64, [&](int x, int y) {
    const int v = std::hypot(float(x) - 48 - shift, float(y) - 32) < 16 ? inside : 60;
    return std::array{v, v, v};
  });
}

TEST(Flip, EqualPicturesDifferByNothing) {
  const Image image = noise(7);
  for (const float e : flipErrors(image, image)) EXPECT_EQ(e, 0);
}

TEST(Flip, OrderDoesNotMatterAndEveryErrorIsAShare) {
  const std::vector<float> there = flipErrors(noise(1), noise(2)), back = flipErrors(noise(2), noise(1));
  EXPECT_EQ(there, back);
  EXPECT_GE(*std::min_element(there.begin(), there.end()), 0);
  EXPECT_LE(*std::max_element(there.begin(), there.end()), 1);
  EXPECT_GT(flipMean(noise(1), noise(2)), 0.1);
}

// Nothing but colour differs between fields without an edge. Green and blue are the two corners of the cube that are
// farthest apart, by which all is scaled.
TEST(Flip, GreenAgainstBlueIsTheMaximum) {
  for (const float e : flipErrors(ofColour(0, 255, 0), ofColour(0, 0, 255))) EXPECT_NEAR(e, 1, 1e-5);
}

// L* is 0 and 100, chroma none: 100^0.7 against the bent range of the largest difference, the paper's constants.
TEST(Flip, BlackAgainstWhiteFollowsFromLightnessAlone) {
  // L*a*b* of the primaries (D65): (87.73, -86.18, 83.18) and (32.30, 79.19, -107.86); chroma times L* / 100.
  const double chroma = std::hypot(-86.18 * 0.8773 - 79.19 * 0.3230, 83.18 * 0.8773 + 107.86 * 0.3230);
  const double largest = std::pow(87.73 - 32.30 + chroma, 0.7), bend = 0.4 * largest, difference = std::pow(100, 0.7);
  const double expected = 0.95 + 0.05 * (difference - bend) / (largest - bend);
  EXPECT_NEAR(flipMean(ofColour(0, 0, 0), ofColour(255, 255, 255)), expected, 1e-4);
}

// Two greys of small difference lie below the bend: 0.95 / 0.4 of their share.
TEST(Flip, SmallDifferencesFollowTheirPower) {
  const double once = flipMean(ofColour(119, 119, 119), ofColour(124, 124, 124)),
               twice = flipMean(ofColour(119, 119, 119), ofColour(129, 129, 129));
  const auto lightness = [](double v) { return 116 * std::cbrt(std::pow((v / 255 + 0.055) / 1.055, 2.4)) - 16; };
  const double ratio = (lightness(129) - lightness(119)) / (lightness(124) - lightness(119));
  EXPECT_NEAR(twice / once, std::pow(ratio, 0.7), 1e-3);
}

// A pattern too fine for the eye differs less than its mean shade would; an edge differs more than a field.
TEST(Flip, FinePatternsFadeAndEdgesStandOut) {
  const auto chequer = [](int phase) {
    return picture(48, 32, [phase](int x, int y) {
      const int v = (x + y + phase) % 2 ? 140 : 110;
      return std::array{v, v, v};
    });
  };
  EXPECT_LT(flipMean(chequer(0), chequer(1)), 0.25 * flipMean(ofColour(110, 110, 110), ofColour(140, 140, 140)));
  const double half = flipMean(disc(0), disc(0.5f)), one = flipMean(disc(0), disc(1)),
               three = flipMean(disc(0), disc(3));
  EXPECT_GT(half, 0);
  EXPECT_LT(half, one);
  EXPECT_LT(one, three);
}

// Seen from twice as far, the same difference is finer and counts less.
TEST(Flip, DistanceHelps) {
  EXPECT_LT(flipMean(noise(1), noise(2), 2 * kFlipPixelsPerDegree), flipMean(noise(1), noise(2)));
}

}  // namespace
}  // namespace medulla
