#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "render/renderer.h"
#include "render/shadow_map.h"

namespace medulla {
namespace {

using glm::vec3;

// Parallelogram of `cells`^2 quads at height z, facing +z: halfSide to either side of x, which grows by slant y.
SurfaceShape sheet(float halfSide, std::uint32_t cells, float x, float slant, float z) {
  SurfaceShape s;
  s.look = "matte";
  for (std::uint32_t j = 0; j <= cells; ++j)
    for (std::uint32_t i = 0; i <= cells; ++i) {
      const float y = halfSide * (2 * float(j) / float(cells) - 1);
      s.restPositions.push_back({x + slant * y + halfSide * (2 * float(i) / float(cells) - 1), y, z});
    }
  const std::uint32_t n = cells + 1;
  for (std::uint32_t j = 0; j < cells; ++j)
    for (std::uint32_t i = 0; i < cells; ++i) {
      const std::uint32_t a = j * n + i;
      s.triangles.push_back({a, a + 1, a + n + 1});
      s.triangles.push_back({a, a + n + 1, a + n});
    }
  return s;
}

// px: where row y, bright at x = 0, first falls to the mean of that and of x = `dark`.
double crossing(const Image& image, int y, int dark) {
  const auto at = [&](int x) { return double(image.pixels[4ul * (std::size_t(y) * image.width + x)]); };
  const double middle = 0.5 * (at(0) + at(dark));
  int x = 1;
  while (x < dark && at(x) > middle) ++x;
  return x - (middle - at(x)) / (at(x - 1) - at(x));
}

// px: by how much the points (k, x[k]) stray from the line through them, root of the mean square.
double strayFromLine(const std::vector<double>& x) {
  const auto n = double(x.size());
  double sum = 0, sumK = 0, stray = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    sum += x[k] / n;
    sumK += x[k] * (double(k) - 0.5 * (n - 1));
  }
  const double slope = 12 * sumK / (n * (n * n - 1));
  for (std::size_t k = 0; k < x.size(); ++k) stray += std::pow(x[k] - sum - slope * (double(k) - 0.5 * (n - 1)), 2) / n;
  return std::sqrt(stray);
}

// Means of coded values would darken edges.
TEST(LargePicture, PixelsThatBecomeOneAreAveragedInLight) {
  RendererSettings settings;
  settings.width = settings.height = 64;
  settings.antialias = settings.shadows = false;
  settings.supersample = 2;
  Renderer renderer(settings);
  const float distance = 0.3f, pixel = 2 * distance * std::tan(glm::radians(20.f)) / 64;
  renderer.addSurface(sheet(1, 40, -1 + 0.5f * pixel, 0, 0));  // up to the middle of the pixel beside the centre
  Picture picture;
  picture.endoscopeMask = false;
  picture.camera.position = {0, 0, distance};
  picture.camera.target = {0, 0, 0};
  picture.camera.fovDegrees = 40;
  picture.light.intensity = 0.3f;
  Image image;
  renderer.render(picture, image);
  const auto at = [&](int x) { return double(image.pixels[4ul * (32ul * 64 + std::size_t(x))]); };
  ASSERT_GT(at(31), 60);
  ASSERT_LT(at(31), 200);  // no glare
  ASSERT_LT(at(33), 0.3 * at(31));
  const double light = 0.5 * (lightFromSrgb(at(31) / 255) + lightFromSrgb(at(33) / 255));
  EXPECT_NEAR(at(32), 255 * srgbFromLight(light), 3);
}

// So that a sheet throws a shadow beside itself.
Picture litFromAside() {
  Picture p;
  p.camera.position = {0, 0, 0.25f};
  p.camera.fovDegrees = 40;
  p.light.offset = {0.1f, 0, 0};
  p.endoscopeMask = false;
  return p;
}

// A narrow strip of a high picture, along the edge of the shadow that a sheet throws beside itself.
TEST(LargePicture, StraightEdgeOfAShadowIsStraight) {
  RendererSettings settings;
  settings.width = 160;
  settings.height = 2160;
  settings.antialias = false;
  Renderer renderer(settings);
  renderer.addSurface(sheet(0.2f, 80, 0, 0, 0));
  renderer.addSurface(sheet(0.15f, 60, 0.15f, 0.01f, 0.01f));
  Picture p = litFromAside();
  Image image;
  renderer.render(p, image);
  // The lamp's ray past the sheet's edge ends 4.2 mm, 50 pixels, left of the middle.
  std::vector<double> edge;
  for (int y = 200; y < 1960; ++y) edge.push_back(crossing(image, y, 60));
  EXPECT_NEAR(edge[edge.size() / 2], 30, 5);
  EXPECT_LT(strayFromLine(edge), 0.4);
}

// By how much an edge, nine pixels wide, bends at most from one pixel to the next, as a share of what it falls.
TEST(Renderer, SoftEdgesOfShadowsHaveNoSteps) {
  RendererSettings settings;
  settings.width = 320;
  settings.height = 720;
  settings.antialias = false;
  Renderer renderer(settings);
  renderer.addSurface(sheet(0.3f, 80, 0, 0, 0));
  renderer.addSurface(sheet(0.15f, 60, 0.18f, 0, 0.07f));
  Picture p = litFromAside();
  p.surfaces.resize(2);
  for (const float slant : {0.05f, 0.1f, 0.2f, 0.3f, 0.4f, 0.6f, 0.8f}) {
    p.surfaces[1].positions = sheet(0.15f, 60, 0.18f, slant, 0.07f).restPositions;
    Image image;
    renderer.render(p, image);
    constexpr int kTop = 300, kBottom = 420, kBright = 100, kDark = 260;  // px, around the edge
    double mean = 0;
    for (int y = kTop; y < kBottom; ++y) {
      const auto at = [&](int x) { return double(image.pixels[4ul * (std::size_t(y) * image.width + x)]); };
      double most = 0;
      for (int x = kBright; x < kDark; ++x) most = std::max(most, std::abs(at(x + 1) - 2 * at(x) + at(x - 1)));
      mean += most / (at(kBright) - at(kDark)) / (kBottom - kTop);
    }
    EXPECT_LT(mean, 0.18) << slant;
  }
}

TEST(ShadowMap, IsAsFineAsThePicture) {
  EXPECT_EQ(shadowSideFor(480), kShadowSide);
  EXPECT_EQ(shadowSideFor(720), kShadowSide);
  EXPECT_EQ(shadowSideFor(2160), 3 * kShadowSide);
  EXPECT_EQ(shadowSideFor(kPictureSideMax), kShadowSideMost);
  for (int height = 700; height < 3000; height += 7)
    EXPECT_EQ(shadowSideFor(height) % ShadowMap::kBlockSide, 0) << height;
}

// Means over squares of eight pixels change by less from one to the next than a step of the eight bits.
TEST(Renderer, BackgroundsHaveNoStepsThatTheEyeSees) {
  for (const int supersample : {1, 2, 3}) {
    RendererSettings settings;
    settings.width = 32;
    settings.height = 2048;
    settings.supersample = supersample;
    Renderer renderer(settings);
    Picture picture;
    picture.endoscopeMask = false;
    picture.light.haze = Haze{vec3(0.002f, 0.008f, 0.010f), 10};
    Image image;
    renderer.render(picture, image);
    double last = 0, largest = 0, highest = 0, lowest = 255;
    for (int y = 0; y < image.height; y += 8) {
      double sum = 0;
      for (int row = y; row < y + 8; ++row)
        for (int x = 0; x < 8; ++x) sum += image.pixels[4ul * (std::size_t(row) * image.width + x) + 2];
      const double mean = sum / 64;
      if (y > 0) largest = std::max(largest, std::abs(mean - last));
      last = mean;
      highest = std::max(highest, mean);
      lowest = std::min(lowest, mean);
    }
    EXPECT_GT(highest - lowest, 20) << supersample;
    EXPECT_LT(largest, 0.5) << supersample;
  }
}

// px, of a floor of so many quads, seen from near with the camera over it.
Image floorOf(std::uint32_t cells) {
  RendererSettings settings;
  settings.width = 320;
  settings.height = 180;
  Renderer renderer(settings);
  renderer.addSurface(sheet(0.5f, cells, 0, 0, 0));
  Picture picture;
  picture.endoscopeMask = false;
  picture.camera.position = {0.1f, -0.45f, 0.12f};
  picture.camera.target = {0, 0, 0.03f};
  picture.camera.up = {0, 0, 1};
  picture.camera.fovDegrees = 55;
  picture.light.position = vec3(-0.6f, -0.6f, 1.2f);
  picture.light.referenceDistance = 1.4f;
  picture.light.haze = Haze{{0.3f, 0.31f, 0.33f}, 100};
  picture.surfaces.resize(1);
  Image out;
  renderer.render(picture, out);
  return out;
}

// Of two triangles that reach behind the camera, Mesa clips one into a black wedge, and light would not fall off.
TEST(LargePicture, AFloorOfTwoTrianglesLooksLikeAFineOne) {
  const Image coarse = floorOf(1), fine = floorOf(64);
  int most = 0, darkest = 255;
  for (std::size_t k = 0; k < coarse.pixels.size(); ++k) {
    most = std::max(most, std::abs(int(coarse.pixels[k]) - int(fine.pixels[k])));
    darkest = std::min(darkest, int(coarse.pixels[k]));
  }
  EXPECT_LE(most, 12);
  EXPECT_GT(darkest, 40);
}

// A table of 12 triangles, in the middle of its edges as flat as it is, however near the camera and however large the
// picture: a ball that lies on it is seen.
TEST(LargePicture, ATableOfTwelveTrianglesIsNoDome) {
  for (const int height : {180, 1440}) {
    RendererSettings settings;
    settings.width = height;
    settings.height = height;
    Renderer renderer(settings);
    const auto box = [](vec3 low, vec3 high, const char* look) {
      SurfaceShape s;
      s.look = look;
      for (int k = 0; k < 8; ++k)
        s.restPositions.push_back({k & 1 ? high.x : low.x, k & 2 ? high.y : low.y, k & 4 ? high.z : low.z});
      s.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                     {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
      return s;
    };
    renderer.addSurface(box({-0.3f, -0.2f, -0.1f}, {0.3f, 0.2f, 0}, "wood"));
    renderer.addSurface(box({-0.02f, -0.02f, 0}, {0.02f, 0.02f, 0.002f}, "candy_blue"));
    Picture p;
    p.endoscopeMask = false;
    p.camera.position = {0.02f, -0.25f, 0.25f};
    p.camera.up = {0, 0, 1};
    p.light.haze = Haze{{0.3f, 0.31f, 0.33f}, 100};
    p.surfaces.resize(2);
    Image image;
    renderer.render(p, image);
    const std::uint8_t* middle = &image.pixels[4ul * (std::size_t(height / 2) * height + height / 2)];
    EXPECT_GT(middle[2], middle[0] + 30) << height;  // blue
  }
}

}  // namespace
}  // namespace medulla
