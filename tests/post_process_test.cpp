#include "render/post_process.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace medulla {
namespace {

constexpr int kWidth = 61, kHeight = 43;  // no multiples of eight

// Black over white along y = from + slope x, not smoothed; or the same with x and y exchanged.
Image stepped(float from, float slope, bool upright) {
  Image image{kWidth, kHeight, std::vector<std::uint8_t>(4ul * kWidth * kHeight, 255)};
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const int along = upright ? y : x, across = upright ? x : y;
      if (float(across) < from + slope * float(along))
        std::fill_n(&image.pixels[4ul * (std::size_t(y) * kWidth + x)], 3, std::uint8_t(0));
    }
  return image;
}

int valueAt(const Image& image, int x, int y) {
  return image.pixels[4ul * (std::size_t(y) * image.width + x)];
}

constexpr float kFrom = 14.3f, kSlope = 0.2f;  // a step every five pixels

// What the brightness across the edge says of where it is, less where it is; in pixels, for each pixel along it.
std::vector<float> errorsAlong(const Image& image, bool upright) {
  std::vector<float> errors;
  for (int along = 0; along < (upright ? kHeight : kWidth); ++along) {
    float black = 0;
    for (int across = 0; across < (upright ? kWidth : kHeight); ++across)
      black += 1 - float(upright ? valueAt(image, across, along) : valueAt(image, along, across)) / 255;
    // Pixels are black by their corner: half a pixel too many on average.
    errors.push_back(black - 0.5f - (kFrom + kSlope * float(along)));
  }
  return errors;
}

float worstOf(const std::vector<float>& errors, std::size_t leftOut) {
  float worst = 0;
  for (std::size_t k = leftOut; k + leftOut < errors.size(); ++k) worst = std::max(worst, std::abs(errors[k]));
  return worst;
}

// Only the outermost step has an end that nobody sees.
TEST(PostProcessTest, EdgeIsSmoothedUpToThePicturesBorder) {
  for (const bool upright : {false, true}) {
    const Image raw = stepped(kFrom, kSlope, upright);
    Image smooth = raw;
    PostProcess(kWidth, kHeight).smoothEdges(smooth);
    EXPECT_GT(worstOf(errorsAlong(raw, upright), 5), 0.39f) << upright;
    EXPECT_LT(worstOf(errorsAlong(smooth, upright), 5), 0.1f) << upright;
    EXPECT_NE(errorsAlong(smooth, upright).front(), errorsAlong(raw, upright).front()) << upright;
    EXPECT_NE(errorsAlong(smooth, upright).back(), errorsAlong(raw, upright).back()) << upright;
  }
}

TEST(PostProcessTest, EdgeBesideTheBorderIsSmoothed) {
  for (const bool upright : {false, true})
    for (const float from : {1.3f, float(upright ? kWidth : kHeight) - 4}) {
      Image smooth = stepped(from, 0.03f, upright);
      const Image raw = smooth;
      PostProcess(kWidth, kHeight).smoothEdges(smooth);
      EXPECT_NE(smooth.pixels, raw.pixels) << upright << " " << from;
    }
}

TEST(PostProcessTest, SmallestPicturesAreLeftWhole) {
  for (const auto& [width, height] : {std::pair(1, 1), std::pair(3, 40), std::pair(40, 3)}) {
    Image image{width, height, std::vector<std::uint8_t>(4ul * width * height, 100)};
    const Image raw = image;
    PostProcess(width, height).smoothEdges(image);
    EXPECT_EQ(image.pixels, raw.pixels);
  }
}

}  // namespace
}  // namespace medulla
