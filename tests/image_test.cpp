#include "render/image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "tests/complaint.h"
#include "tests/program_run.h"
#include "tests/temporary_folder.h"

namespace medulla {
namespace {

namespace fs = std::filesystem;

class ImageTest : public FolderTest {};

Image pattern(int width, int height) {
  Image image{width, height, std::vector<std::uint8_t>(4ul * width * height)};
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = std::uint8_t(i * 2654435761u >> 13);
  return image;
}

Image evenImage(int width, int height, std::uint8_t value) {
  return {width, height, std::vector<std::uint8_t>(4ul * width * height, value)};
}

TEST_F(ImageTest, PngRoundTripKeepsEveryByteAndText) {
  const Image image = pattern(37, 23);
  writePng(path("a.png"), image, {{"scene", "gallbladder"}, {"hash", "00ff"}});
  std::vector<PngText> texts;
  const Image back = readPng(path("a.png"), &texts);
  EXPECT_EQ(back.width, 37);
  EXPECT_EQ(back.height, 23);
  EXPECT_EQ(back.pixels, image.pixels);
  ASSERT_EQ(texts.size(), 2u);
  EXPECT_EQ(texts[0].keyword, "scene");
  EXPECT_EQ(texts[0].text, "gallbladder");
  EXPECT_EQ(texts[1].text, "00ff");
  EXPECT_EQ(filesInFolder(), 1u);
}

TEST_F(ImageTest, WhatIsNoPngIsRefusedWithItsPath) {
  EXPECT_THROW(readPng(path("missing.png")), std::runtime_error);
  folder_.write("text.png", "this is text and long enough to hold a header, but it is no picture");
  EXPECT_NE(complaintOf([&] { readPng(path("text.png")); }).find("text.png"), std::string::npos);
}

TEST_F(ImageTest, TruncatedPngIsRefused) {
  writePng(path("whole.png"), pattern(64, 64));
  const std::string bytes = readFile(path("whole.png"));
  for (const std::size_t keep : {std::size_t(10), std::size_t(40), bytes.size() / 2}) {
    folder_.write("half.png", bytes.substr(0, keep));
    EXPECT_THROW(readPng(path("half.png")), std::runtime_error) << keep;
  }
}

TEST_F(ImageTest, MissingFoldersAreMadeWithTheFile) {
  writePng(path("new/deep/a.png"), pattern(4, 4));
  EXPECT_EQ(readPng(path("new/deep/a.png")).width, 4);
}

TEST_F(ImageTest, FailedWriteLeavesNothingAndHarmsNothing) {
  fs::create_directories(path("a.png"));
  EXPECT_THROW(writePng(path("a.png"), pattern(4, 4)), std::runtime_error);
  EXPECT_TRUE(fs::is_directory(path("a.png")));
  folder_.write("file", "here");
  EXPECT_THROW(writePng(path("file/a.png"), pattern(4, 4)), std::runtime_error);
  EXPECT_EQ(readFile(path("file")), "here");
  EXPECT_EQ(filesInFolder(), 2u);
}

TEST_F(ImageTest, EqualPicturesHaveInfinitePsnr) {
  const ImageDifference d = compareImages(pattern(20, 10), pattern(20, 10));
  EXPECT_TRUE(d.equal);
  EXPECT_TRUE(std::isinf(d.psnr));
  EXPECT_EQ(d.overFourPercent, 0);
  EXPECT_EQ(d.overSixteen, 0);
  EXPECT_TRUE(withinTolerance(d));
}

TEST_F(ImageTest, DifferencesAreCountedPerPixelByTheWorstChannel) {
  const Image a = evenImage(100, 100, 100);
  Image b = a;
  b.pixels[0] += 4;       // not over 4
  b.pixels[4] += 5;       // over 4
  b.pixels[5] += 17;      // the same pixel, over 16
  b.pixels[8 + 2] -= 16;  // over 4, not over 16
  const ImageDifference d = compareImages(a, b);
  EXPECT_FALSE(d.equal);
  EXPECT_DOUBLE_EQ(d.overFourPercent, 100.0 * 2 / 10000);
  EXPECT_EQ(d.overSixteen, 1);
  const double meanSquare = (16.0 + 25 + 289 + 256) / 30000;
  EXPECT_NEAR(d.psnr, 10 * std::log10(255 * 255 / meanSquare), 1e-9);
}

TEST_F(ImageTest, ToleranceHasThreeBounds) {
  const ImageDifference good{0.05, 5, 50, false};
  EXPECT_TRUE(withinTolerance(good));
  ImageDifference d = good;
  d.overFourPercent = 0.051;
  EXPECT_FALSE(withinTolerance(d));
  d = good;
  d.overSixteen = 6;
  EXPECT_FALSE(withinTolerance(d));
  d = good;
  d.psnr = 49.9;
  EXPECT_FALSE(withinTolerance(d));
}

TEST_F(ImageTest, AmplifiedDifferenceIsOpaqueAndSaturates) {
  const Image a = evenImage(2, 1, 10);
  Image b = a;
  b.pixels[0] = 13;
  b.pixels[1] = 200;
  const Image d = amplifiedDifference(a, b, 16);
  EXPECT_EQ(d.pixels, (std::vector<std::uint8_t>{48, 255, 0, 255, 0, 0, 0, 255}));
}

}  // namespace
}  // namespace medulla
