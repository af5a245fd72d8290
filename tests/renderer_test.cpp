#include "render/renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/haze.h"
#include "tests/complaint.h"

namespace medulla {
namespace {

using glm::vec3;

RendererSettings settingsOf(int width, int height) {
  RendererSettings s;
  s.width = width;
  s.height = height;
  s.antialias = false;
  return s;
}

// Square of `cells`^2 quads in the plane z = 0, facing +z.
SurfaceShape plane(const std::string& look, float halfSide, int cells, vec3 centre = {}) {
  SurfaceShape s;
  s.look = look;
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= cells; ++i)
      s.restPositions.push_back(
          centre + halfSide * vec3(2.f * float(i) / float(cells) - 1, 2.f * float(j) / float(cells) - 1, 0));
  const auto n = std::uint32_t(cells + 1);
  for (std::uint32_t j = 0; j + 1 < n; ++j)
    for (std::uint32_t i = 0; i + 1 < n; ++i) {
      const std::uint32_t a = j * n + i;
      s.triangles.push_back({a, a + 1, a + n + 1});
      s.triangles.push_back({a, a + n + 1, a + n});
    }
  return s;
}

SurfaceShape sphere(const std::string& look, vec3 centre, float radius, std::uint32_t rings = 32) {
  SurfaceShape s;
  s.look = look;
  const std::uint32_t around = 2 * rings;
  for (std::uint32_t j = 0; j <= rings; ++j)
    for (std::uint32_t i = 0; i <= around; ++i) {
      const float theta = std::numbers::pi_v<float> * float(j) / float(rings),
                  phi = 2 * std::numbers::pi_v<float> * float(i) / float(around);
      s.restPositions.push_back(
          centre + radius * vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)));
    }
  for (std::uint32_t j = 0; j < rings; ++j)
    for (std::uint32_t i = 0; i < around; ++i) {
      const std::uint32_t a = j * (around + 1) + i, b = a + around + 1;
      s.triangles.push_back({a, b, b + 1});
      s.triangles.push_back({a, b + 1, a + 1});
    }
  return s;
}

Picture viewFromFront(float distance) {
  Picture p;
  p.camera.position = {0, 0, distance};
  p.camera.fovDegrees = 40;
  p.light.offset = vec3(0);
  p.endoscopeMask = false;
  return p;
}

int red(const Image& image, int x, int y) {
  return image.pixels[4ul * (std::size_t(y) * image.width + x)];
}

// The ACES curve (Narkowicz 2015), then the sRGB transfer (IEC 61966-2-1).
double displayed(double light) {
  const double x = light * (2.51 * light + 0.03) / (light * (2.43 * light + 0.59) + 0.14), c = std::clamp(x, 0.0, 1.0);
  return 255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055);
}

// Light on a matte surface as renderer.h promises it: 1.3 * albedo * cosine * softened inverse square.
double matteLight(const Light& light, double distance, double cosine) {
  const double r2 = light.referenceDistance * light.referenceDistance;
  return 1.3 * 0.5 * cosine * light.intensity * 1.14 * r2 / (distance * distance + 0.14 * r2);
}

TEST(Renderer, MattePlaneFollowsInverseSquareAndToneCurve) {
  Renderer renderer(settingsOf(64, 64));
  renderer.addSurface(plane("matte", 0.3f, 100));
  Image image;
  for (const float distance : {0.08f, 0.15f, 0.25f, 0.4f})
    for (const float intensity : {0.5f, 1.f}) {
      Picture p = viewFromFront(distance);
      p.light.intensity = intensity;
      renderer.render(p, image);
      EXPECT_NEAR(red(image, 32, 32), displayed(matteLight(p.light, distance, 1)), 2) << distance << " " << intensity;
    }
}

TEST(Renderer, MattePlaneDarkensWithTheCosine) {
  Renderer renderer(settingsOf(64, 64));
  renderer.addSurface(plane("matte", 0.3f, 100));
  Image image;
  for (const float degrees : {20.f, 40.f, 60.f}) {
    Picture p = viewFromFront(0.2f);
    p.camera.position = 0.2f * vec3(std::sin(glm::radians(degrees)), 0, std::cos(glm::radians(degrees)));
    renderer.render(p, image);
    EXPECT_NEAR(red(image, 32, 32), displayed(matteLight(p.light, 0.2, std::cos(glm::radians(degrees)))), 2) << degrees;
  }
}

TEST(Renderer, BallInTheModelViewCoversItsProjectedCircle) {
  Renderer renderer(settingsOf(400, 400));
  Image image, empty;
  Picture p = viewFromFront(0.2f);
  p.view = ViewKind::model;
  renderer.render(p, empty);
  for (const float radius : {0.004f, 0.02f, 0.05f}) {
    p.model.balls = {{vec3(0), radius, glm::vec4(0.8f, 0, 0, 1)}};
    renderer.render(p, image);
    long covered = 0;
    for (std::size_t i = 0; i < image.pixels.size(); i += 4)
      covered += std::abs(image.pixels[i + 1] - empty.pixels[i + 1]) > 20;
    // The cone that touches the ball: tan = r / sqrt(d^2 - r^2).
    const double tangent = radius / std::sqrt(0.2 * 0.2 - double(radius) * radius);
    const double pixels = tangent / std::tan(glm::radians(20.0)) * 200;
    EXPECT_NEAR(double(covered), std::numbers::pi * pixels * pixels, 0.01 * std::numbers::pi * pixels * pixels + 4)
        << radius;
  }
}

TEST(Renderer, PictureIsUprightAndNotMirrored) {
  Renderer renderer(settingsOf(64, 64));
  Picture p = viewFromFront(0.2f);
  p.view = ViewKind::model;
  p.model.balls = {{vec3(0.03f, 0.02f, 0), 0.008f, glm::vec4(0, 0, 0, 1)}};  // right and up
  Image image;
  renderer.render(p, image);
  const auto dark = [&](int x, int y) { return red(image, x, y) < 140; };
  const int dx = int(0.03 / 0.2 / std::tan(glm::radians(20.0)) * 32),
            dy = int(0.02 / 0.2 / std::tan(glm::radians(20.0)) * 32);
  EXPECT_TRUE(dark(32 + dx, 32 - dy));
  EXPECT_FALSE(dark(32 - dx, 32 - dy));
  EXPECT_FALSE(dark(32 + dx, 32 + dy));
}

// A ball between light and plane: dark where its shadow must fall, as without shadows elsewhere.
TEST(Renderer, ShadowFallsWhereTheRayIsBlocked) {
  RendererSettings on = settingsOf(128, 128), off = on;
  off.shadows = false;
  Image lit, shaded;
  Picture p = viewFromFront(0.25f);
  p.light.offset = {0.08f, 0, 0};
  for (const bool shadows : {true, false}) {
    Renderer renderer(shadows ? on : off);
    renderer.addSurface(plane("matte", 0.2f, 80));
    renderer.addSurface(sphere("matte", {0.02f, 0, 0.08f}, 0.015f));
    renderer.render(p, shadows ? shaded : lit);
  }
  // From (0.08, 0, 0.25) through the ball's centre to z = 0.
  const double t = 0.25 / (0.25 - 0.08), x = 0.08 + t * (0.02 - 0.08);
  const int pixel = 64 + int(x / 0.25 / std::tan(glm::radians(20.0)) * 64);
  EXPECT_GT(red(lit, pixel, 64), 100);
  EXPECT_LT(red(shaded, pixel, 64), 60);
  EXPECT_EQ(red(shaded, 110, 64), red(lit, 110, 64));
}

// A lamp in the world lights by its own distance and angle, wherever the camera stands.
TEST(Renderer, LampInTheWorldStaysWhereItHangs) {
  Renderer renderer(settingsOf(64, 64));
  renderer.addSurface(plane("matte", 0.12f, 100));
  Image image;
  for (const float x : {0.f, 0.2f})
    for (const float distance : {0.1f, 0.3f}) {
      Picture p = viewFromFront(distance);
      p.light.position = vec3(x, 0, 0.4f);
      renderer.render(p, image);
      const double away = std::hypot(x, 0.4);
      EXPECT_NEAR(red(image, 32, 32), displayed(matteLight(p.light, away, 0.4 / away)), 2) << x << " " << distance;
    }
}

TEST(Renderer, LampInTheWorldThrowsShadows) {
  Renderer renderer(settingsOf(128, 128));
  renderer.addSurface(plane("matte", 0.2f, 80));
  renderer.addSurface(sphere("matte", {-0.02f, 0, 0.05f}, 0.012f));
  Picture p = viewFromFront(0.3f);
  p.light.position = vec3(-0.1f, 0, 0.2f);
  p.light.referenceDistance = 0.2f;
  Image image;
  renderer.render(p, image);
  // From the lamp through the ball's centre to z = 0.
  const double x = -0.1 + 0.2 / (0.2 - 0.05) * (-0.02 + 0.1), scale = 64 / 0.3 / std::tan(glm::radians(20.0));
  EXPECT_LT(red(image, 64 + int(x * scale), 64), 40);
  EXPECT_GT(red(image, 64 + int((x + 0.05) * scale), 64), 80);
  EXPECT_GT(red(image, 64 + int(x * scale), 64 + int(0.05 * scale)), 80);
}

TEST(Renderer, HazeFillsTheBackgroundAndTakesWhatIsFar) {
  Renderer renderer(settingsOf(64, 64));
  renderer.addSurface(sphere("bowl", {0, 0, 0}, 0.5f));
  Picture p = viewFromFront(5);
  p.light.haze = Haze{vec3(0.30f, 0.20f, 0.10f), 0.5f};
  Image image;
  renderer.render(p, image);
  // Level with the eye; the ball, ten of the haze's distances away, cannot be told from what is behind it.
  EXPECT_NEAR(red(image, 32, 32), displayed(0.30), 2);
  EXPECT_NEAR(red(image, 60, 32), displayed(0.30), 2);
  EXPECT_GT(red(image, 60, 2), red(image, 60, 32) + 10);
  EXPECT_LT(red(image, 60, 62), red(image, 60, 32) - 10);
  p.light.haze->distance = 500;
  renderer.render(p, image);
  EXPECT_GT(std::abs(red(image, 32, 32) - displayed(0.30)), 10);
}

TEST(Haze, CausticsKeepTheMeanOfTheLight) {
  const int n = 200;
  for (const float time : {0.f, 0.4f}) {
    double sum = 0;
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const float c = causticAt(0.1f * vec3(i, 0, j), {0, 1, 0}, 1, time);
        ASSERT_GE(c, 0);
        sum += c;
        EXPECT_EQ(causticAt(0.1f * vec3(i, 0, j), {0, 1, 0}, 0, time), 1);
      }
    EXPECT_NEAR(sum / (n * n), 1, 0.1);
  }
  // The ripples are carried along the light: the same above and below.
  const vec3 toLight = glm::normalize(vec3(0.3f, 1, -0.2f)), p(0.4f, 1, 2.2f);
  EXPECT_NEAR(causticAt(p, toLight, 1, 2), causticAt(p - 1.5f * toLight, toLight, 1, 2), 1e-3);
}

TEST(Renderer, SamePictureTwiceIsTheSameToTheByte) {
  Image first, second, other;
  Picture p = viewFromFront(0.2f);
  p.endoscopeMask = true;
  p.instruments.push_back({});
  p.instruments[0].touching = true;
  for (Image* out : {&first, &second}) {
    RendererSettings s = settingsOf(160, 120);
    s.antialias = true;
    Renderer renderer(s);
    renderer.addSurface(sphere("liver", {-0.03f, 0, -0.04f}, 0.04f));
    renderer.addSurface(sphere("gallbladder", {0.03f, 0, -0.04f}, 0.03f));
    // What was drawn before must not matter.
    if (out == &second) {
      Picture before = p;
      before.view = ViewKind::both;
      before.camera.position.x = 0.1f;
      before.surfaces.resize(2);
      before.surfaces[0].positions = sphere("liver", {0.05f, 0, 0}, 0.02f).restPositions;
      renderer.render(before, other);
      EXPECT_FALSE(compareImages(first, other).equal);
    }
    renderer.render(p, *out);
  }
  EXPECT_TRUE(compareImages(first, second).equal);
}

// Also where the picture after it was begun before it was read back.
TEST(Renderer, PicturesBegunAheadAreThoseDrawnOneByOne) {
  for (const int supersample : {1, 2}) {
    RendererSettings settings = settingsOf(96, 64);
    settings.supersample = supersample;
    Renderer renderer(settings);
    renderer.addSurface(sphere("liver", {0, 0, 0}, 0.05f));
    std::vector<Picture> pictures(4);
    std::vector<Image> alone(4), ahead(4);
    for (std::size_t k = 0; k < 4; ++k) {
      pictures[k].camera.position = {0.01f * float(k), 0, 0.3f};
      pictures[k].endoscopeMask = k % 2 == 0;
      renderer.render(pictures[k], alone[k]);
    }
    renderer.begin(pictures[0]);
    for (std::size_t k = 0; k < 4; ++k) {
      if (k < 3) renderer.begin(pictures[k + 1]);
      renderer.take(ahead[k]);
      EXPECT_EQ(ahead[k].pixels, alone[k].pixels) << k;
    }
    EXPECT_NE(alone[0].pixels, alone[1].pixels);
  }
}

// Of two rods of one colour the farther is nearer to the backdrop's, and none is thinner than a pixel.
TEST(Renderer, FarAndThinThingsOfTheModelAreReadable) {
  RendererSettings settings = settingsOf(160, 120);
  Renderer renderer(settings);
  Picture picture;
  picture.view = ViewKind::model;
  picture.camera = {{0, 0, 0.3f}, {0, 0, 0}, {0, 1, 0}, 40};
  Image empty, image;
  renderer.render(picture, empty);
  picture.model.segments = {{{-0.05f, 0.02f, 0.1f}, {0.05f, 0.02f, 0.1f}, 1e-6f, {0, 0, 0, 1}},
                            {{-0.05f, -0.02f, -0.1f}, {0.05f, -0.02f, -0.1f}, 1e-6f, {0, 0, 0, 1}}};
  renderer.render(picture, image);
  // Per half the darkest pixel of every column.
  int darkest[2] = {255, 255}, columns[2] = {0, 0};
  for (int half = 0; half < 2; ++half)
    for (int x = 70; x < 90; ++x) {
      int column = 255;
      for (int y = 60 * half; y < 60 * half + 60; ++y) {
        const std::size_t at = 4 * (std::size_t(y) * 160 + x);
        if (image.pixels[at] + 8 < empty.pixels[at]) column = std::min<int>(column, image.pixels[at]);
      }
      columns[half] += column < 255;
      darkest[half] = std::min(darkest[half], column);
    }
  EXPECT_EQ(columns[0], 20);
  EXPECT_EQ(columns[1], 20);
  EXPECT_LT(darkest[0] + 20, darkest[1]);
}

TEST(Renderer, EglDrawsTheSameAsOsmesa) {
  Image images[2];
  const char* names[] = {"osmesa", "egl"};
  for (int k = 0; k < 2; ++k) {
    RendererSettings s = settingsOf(160, 120);
    s.context = names[k];
    try {
      Renderer renderer(s);
      renderer.addSurface(sphere("liver", {0, 0, -0.04f}, 0.05f));
      Picture p = viewFromFront(0.2f);
      p.instruments.push_back({});
      renderer.render(p, images[k]);
    } catch (const std::runtime_error& e) {
      GTEST_SKIP() << names[k] << " cannot start here: " << e.what();
    }
  }
  EXPECT_TRUE(withinTolerance(compareImages(images[0], images[1])));
}

// Anti-aliasing may change a pixel only where its neighbourhood has contrast.
TEST(Renderer, AntialiasChangesOnlyEdges) {
  Image plain, smooth;
  Picture p = viewFromFront(0.2f);
  for (const bool antialias : {false, true}) {
    RendererSettings s = settingsOf(128, 128);
    s.antialias = antialias;
    Renderer renderer(s);
    renderer.addSurface(sphere("matte", {0, 0, -0.04f}, 0.04f));
    renderer.render(p, antialias ? smooth : plain);
  }
  int changed = 0;
  for (int y = 1; y < 127; ++y)
    for (int x = 1; x < 127; ++x) {
      if (red(plain, x, y) == red(smooth, x, y)) continue;
      ++changed;
      int low = 255, high = 0;
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) {
          low = std::min(low, red(plain, x + i, y + j));
          high = std::max(high, red(plain, x + i, y + j));
        }
      EXPECT_GT(high - low, 8) << x << " " << y;
      EXPECT_GE(red(smooth, x, y), low - 1);
      EXPECT_LE(red(smooth, x, y), high + 1);
    }
  EXPECT_GT(changed, 20);
}

TEST(Renderer, MaskIsBlackOutsideTheRim) {
  Renderer renderer(settingsOf(320, 180));
  renderer.addSurface(plane("matte", 0.6f, 100));
  Picture p = viewFromFront(0.1f);
  Image open, round;
  renderer.render(p, open);
  p.endoscopeMask = true;
  renderer.render(p, round);
  int black = 0;
  for (int y = 0; y < 180; ++y)
    for (int x = 0; x < 320; ++x) {
      const double r = std::hypot(x + 0.5 - 160, y + 0.5 - 90) / 180;
      if (r < 0.82) continue;
      ++black;
      EXPECT_EQ(red(round, x, y), 0);
    }
  EXPECT_GT(black, 1000);
  EXPECT_GT(red(open, 2, 2), red(round, 2, 2));
}

TEST(Renderer, MovedSurfaceIsDrawnWhereItIsAndStaticOneReturns) {
  Renderer renderer(settingsOf(128, 128));
  const SurfaceShape ball = sphere("matte", {0, 0, 0}, 0.01f);
  renderer.addSurface(ball);
  Picture p = viewFromFront(0.2f);
  Image atRest, moved, again;
  renderer.render(p, atRest);
  p.surfaces.resize(1);
  p.surfaces[0].positions = ball.restPositions;
  for (vec3& x : p.surfaces[0].positions) x.x += 0.04f;
  renderer.render(p, moved);
  const int shift = int(0.04 / 0.2 / std::tan(glm::radians(20.0)) * 64);
  EXPECT_GT(red(atRest, 64, 64), 60);
  EXPECT_LT(red(moved, 64, 64), 60);
  EXPECT_GT(red(moved, 64 + shift, 64), 60);
  p.surfaces[0].positions.clear();
  renderer.render(p, again);
  EXPECT_TRUE(compareImages(atRest, again).equal);
}

// Colour, texture and relief hang on the tissue: turned by half a turn together with the camera it is the same picture,
// seen from where it was it is another.
TEST(Renderer, TextureSticksToATurnedBody) {
  RendererSettings settings = settingsOf(160, 160);
  Renderer renderer(settings);
  SurfaceShape organ = sphere("stomach", {0, 0, 0}, 0.03f, 48);
  for (vec3& p : organ.restPositions) p.x *= 1.6f;
  renderer.addSurface(organ);
  Picture p = viewFromFront(0.2f);
  Image rest, turned, back;
  renderer.render(p, rest);
  p.surfaces.resize(1);
  p.surfaces[0].positions = organ.restPositions;
  for (vec3& x : p.surfaces[0].positions) x = vec3(-x.x, x.y, -x.z);
  renderer.render(p, back);
  p.camera.position.z *= -1;
  renderer.render(p, turned);
  EXPECT_TRUE(withinTolerance(compareImages(rest, turned)));
  EXPECT_FALSE(withinTolerance(compareImages(rest, back)));
}

TEST(Renderer, MovingSkinIsSeenThroughInBothAndStaticSkinIsNot) {
  Renderer renderer(settingsOf(64, 64));
  const SurfaceShape skin = sphere("matte", {0, 0, 0}, 0.03f);
  renderer.addSurface(skin);
  Picture p = viewFromFront(0.2f);
  p.model.balls = {{vec3(0), 0.02f, glm::vec4(0.9f, 0, 0, 1)}};
  const auto redness = [&] {
    Image image;
    renderer.render(p, image);
    const std::uint8_t* c = &image.pixels[4ul * (32 * 64 + 32)];
    return c[0] - c[1];
  };
  p.view = ViewKind::both;
  EXPECT_LT(redness(), 10);  // static: opaque
  p.surfaces = {{skin.restPositions, {}}};
  const int both = redness();
  p.view = ViewKind::model;
  const int model = redness();
  p.view = ViewKind::tissue;
  EXPECT_LT(redness(), 10);
  EXPECT_GT(both, 30);
  EXPECT_GT(model, both + 10);
}

// Occlusion: the inside corner of two organs is darker than the same organ alone.
TEST(Renderer, OrganBesideAnotherIsDarkerInTheCrease) {
  Image alone, together;
  Picture p = viewFromFront(0.25f);
  p.light.intensity = 0.6f;
  for (const bool both : {false, true}) {
    RendererSettings s = settingsOf(128, 128);
    s.shadows = false;
    Renderer renderer(s);
    renderer.addSurface(sphere("stomach", {-0.03f, 0, 0}, 0.03f));
    if (both) renderer.addSurface(sphere("stomach", {0.03f, 0, 0}, 0.03f));
    renderer.render(p, both ? together : alone);
  }
  const int nearContact = 64 - int(0.009 / 0.23 / std::tan(glm::radians(20.0)) * 64);
  EXPECT_LT(red(together, nearContact, 64), red(alone, nearContact, 64) - 8);
}

TEST(Renderer, EveryLookDraws) {
  Renderer renderer(settingsOf(64, 64));
  const std::vector<std::string> names = lookNames();
  for (const char* wanted : {"liver", "stomach", "gallbladder", "gut", "colon", "fat", "wall", "dolphin", "seabed",
                             "bowl", "candy_red", "candy_yellow", "candy_blue", "steel"})
    EXPECT_NE(std::find(names.begin(), names.end(), wanted), names.end()) << wanted;
  // On a grid of four by four.
  ASSERT_LE(names.size(), 16u);
  const auto place = [](std::size_t k) { return 0.03f * (vec3(k % 4, k / 4, 0) - vec3(1.5f, 1.5f, 0)); };
  for (std::size_t k = 0; k < names.size(); ++k) renderer.addSurface(sphere(names[k], place(k), 0.012f, 12));
  Image image;
  Picture p = viewFromFront(0.2f);
  renderer.render(p, image);
  for (std::size_t k = 0; k < names.size(); ++k) {
    const double scale = 32 / 0.2 / std::tan(glm::radians(20.0));
    const int x = 32 + int(place(k).x * scale), y = 32 - int(place(k).y * scale);
    // Whatever its hue: the brightest of the three channels.
    const std::uint8_t* rgb = &image.pixels[4ul * (std::size_t(y) * 64 + std::size_t(x))];
    EXPECT_GT(std::max({rgb[0], rgb[1], rgb[2]}), 40) << names[k];
  }
}

TEST(Renderer, BadSettingsAreRefused) {
  EXPECT_THROW(Renderer(settingsOf(15, 64)), std::runtime_error);
  EXPECT_THROW(Renderer(settingsOf(64, 9000)), std::runtime_error);
  RendererSettings s = settingsOf(64, 64);
  s.context = "glx";
  EXPECT_THROW(Renderer{s}, std::runtime_error);
  Renderer renderer(settingsOf(64, 64));
  EXPECT_NE(complaintOf([&] { renderer.addSurface(plane("livre", 1, 1)); }).find("gallbladder"), std::string::npos);
}

}  // namespace
}  // namespace medulla
