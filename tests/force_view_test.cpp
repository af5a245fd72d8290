#include "app/force_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "app/scene_view.h"
#include "tests/program_run.h"
#include "tests/temporary_folder.h"

namespace medulla {
namespace {

Image greyImage(int width, int height) {
  return {width, height, std::vector<std::uint8_t>(4ul * width * height, 90)};
}

const std::uint8_t* pixelAt(const Image& image, int x, int y) {
  return &image.pixels[4ul * (std::size_t(y) * image.width + x)];
}

bool isYellow(const std::uint8_t* p) {
  return p[0] > 180 && p[1] > 180 && p[2] < 100;
}

struct Box {
  int left, right, top, bottom;
  bool operator==(const Box&) const = default;
};

// Where it is not grey any more.
Box drawnIn(const Image& image) {
  const Image before = greyImage(image.width, image.height);
  Box b{image.width, 0, image.height, 0};
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      if (std::equal(pixelAt(image, x, y), pixelAt(image, x, y) + 4, pixelAt(before, x, y))) continue;
      b.left = std::min(b.left, x);
      b.right = std::max(b.right, x);
      b.top = std::min(b.top, y);
      b.bottom = std::max(b.bottom, y);
    }
  return b;
}

StripChart ramp() {
  StripChart chart;
  chart.range = 2;
  chart.now = 7.5f;
  StripCurve curve{{1, 1, 0, 1}, {}, "1.00 N"};
  for (int k = 0; k <= 600; ++k) curve.values.push_back(float(k) / 600);
  chart.curves = {curve};
  return chart;
}

}  // namespace

TEST(StripChart, StaysInItsCornerAndShowsWhatItIsGiven) {
  Image image = greyImage(640, 360);
  drawStripChart(ramp(), image);
  const auto [left, right, top, bottom] = drawnIn(image);
  EXPECT_GE(left, 5);
  EXPECT_LE(right, 640 * 0.45);
  EXPECT_GE(top, 360 * 0.7);
  EXPECT_LE(bottom, 355);
  // From nothing to half the range: the curve ends in the middle of what lies below the letters.
  int lowest = 0, highest = 360;
  for (int y = 300; y < 355; ++y) {
    if (isYellow(pixelAt(image, left + 8, y))) lowest = std::max(lowest, y);
    if (isYellow(pixelAt(image, right - 7, y))) highest = std::min(highest, y);
  }
  EXPECT_NEAR(bottom - lowest, 6, 3);
  EXPECT_NEAR((lowest - highest) / double(lowest - (top + 0.06 * 360)), 0.5, 0.1);
}

// A line per whole second, as far from the end as that second is ago.
TEST(StripChart, HasALinePerSecond) {
  Image image = greyImage(640, 360);
  StripChart chart = ramp();
  chart.curves[0].values.assign(601, 0.f);
  drawStripChart(chart, image);
  const auto [left, right, top, bottom] = drawnIn(image);
  const int row = top + (bottom - top) * 6 / 10, paper = *pixelAt(image, left + 2, top + 2);
  std::vector<int> lines;
  for (int x = left; x <= right; ++x)
    if (*pixelAt(image, x, row) > paper + 3) lines.push_back(x);
  ASSERT_EQ(lines.size(), 5u);
  const double second = (lines[4] - lines[0]) / 4.0, margin = 0.016 * 360;
  EXPECT_NEAR(5 * second, right + 1 - left - 2 * margin, 2);
  EXPECT_NEAR(right + 1 - margin - lines[4], 0.5 * second, 2);  // it is 7.5 s
}

TEST(StripChart, OfManyToolsStaysInItsCorner) {
  for (const int width : {1280, 640, 240}) {
    Image one = greyImage(width, 9 * width / 16), many = one;
    StripChart chart = ramp();
    chart.windowLabel = "5 s";
    drawStripChart(chart, one);
    chart.curves.resize(6, chart.curves[0]);
    drawStripChart(chart, many);
    EXPECT_EQ(drawnIn(many), drawnIn(one)) << width;
  }
}

// In low pictures the middle line would, and in the lowest the lower one.
TEST(StripChart, NoLineGoesThroughTheRange) {
  for (int height = 90; height <= 360; height += 6) {
    Image without = greyImage(16 * height / 9, height), with = without;
    StripChart chart = ramp();
    drawStripChart(chart, without);
    chart.rangeLabel = "1";
    drawStripChart(chart, with);
    const Box paper = drawnIn(with);
    Box label{with.width, 0, height, 0};
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < with.width; ++x) {
        if (*pixelAt(with, x, y) <= *pixelAt(without, x, y) + 40) continue;
        label = {std::min(label.left, x), std::max(label.right, x), std::min(label.top, y), std::max(label.bottom, y)};
      }
    EXPECT_TRUE(label.left < label.right || height < 132) << height;
    for (int y = label.top; y <= label.bottom; ++y)
      EXPECT_LE(*pixelAt(with, label.left - 2, y), *pixelAt(with, paper.left, paper.top)) << height << " " << y;
  }
}

TEST(StripChart, IsDrawnIntoPicturesOfAnySize) {
  for (const auto& [width, height] : {std::pair(16, 16), std::pair(64, 48), std::pair(320, 240), std::pair(18, 400)}) {
    Image image = greyImage(width, height);
    StripChart chart = ramp();
    chart.curves[0].values.assign(2, 1e6f);  // far beyond the range
    drawStripChart(chart, image);
    EXPECT_NE(image.pixels, greyImage(width, height).pixels);
  }
}

TEST(Renderer, AnArrowIsSeenThroughWhatLiesBeforeIt) {
  RendererSettings settings;
  settings.width = 400;
  settings.height = 200;
  settings.antialias = false;
  Renderer renderer(settings);
  SurfaceShape wall{"wall", {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, false, {}};
  renderer.addSurface(wall);
  Picture picture;
  picture.endoscopeMask = false;
  picture.camera.position = {0, 0, 0.3f};
  Image without, with;
  renderer.render(picture, without);
  picture.overlay.arrows.push_back({{0, -0.08f, -0.1f}, {0, 0.08f, -0.1f}, 0.005f, {0.9f, 0.9f, 0, 1}});
  renderer.render(picture, with);
  EXPECT_FALSE(isYellow(pixelAt(without, 200, 100)));
  EXPECT_TRUE(isYellow(pixelAt(with, 200, 100)));
  // Thrice as wide at the foot of the head, above the middle of the picture.
  const auto widthAt = [&](int y) {
    int count = 0;
    for (int x = 0; x < 400; ++x)
      count += !std::equal(pixelAt(with, x, y), pixelAt(with, x, y) + 3, pixelAt(without, x, y));
    return count;
  };
  int widest = 0;
  for (int y = 0; y < 100; ++y) widest = std::max(widest, widthAt(y));
  EXPECT_NEAR(widest / double(widthAt(120)), 3, 0.8);
}

// Arrow and chart follow the tool: one range for both, which grows with the force and never shrinks.
TEST(ForceView, ArrowAndChartShareARange) {
  const LoadedScene loaded = loadScene(readScene(std::string(MEDULLA_SOURCE_DIR) + "/scenes/liver.xml",
                                                 {{"clock.duration", "1.7"}, {"output.golden", "0"}}));
  Simulation simulation(loaded);
  ForceView view(loaded);
  PictureState state;
  Picture picture;
  picture.camera = cameraAt(loaded.scene.camera, 0);
  double largest = 0, lastRange = 0;
  int changes = -1;  // of the range, after the first picture
  while (!simulation.finished()) {
    simulation.advanceFrame();
    view.afterFrame(simulation);
    const ServoRecord& record = simulation.record();
    for (const auto& tools : record.tools) largest = std::max(largest, tools[0].force.norm());
    stateAt(record, record.start + record.duration, state);
    const StripChart chart = view.chart(state);
    picture.overlay.clear();
    view.addArrows(state, picture);
    ASSERT_GE(chart.range, largest);
    ASSERT_GE(chart.range, lastRange);
    changes += chart.range != lastRange;
    lastRange = chart.range;
    ASSERT_EQ(chart.curves.size(), 1u);
    ASSERT_EQ(chart.curves[0].values.back(), float(state.tools[0].force.norm()));
    for (std::size_t back = 0; back < record.tools.size(); ++back)
      ASSERT_EQ(chart.curves[0].values.rbegin()[std::ptrdiff_t(back)],
                float(record.tools.rbegin()[std::ptrdiff_t(back)][0].force.norm()))
          << back << " ticks ago";
    if (state.tools[0].force.isZero(0)) {
      ASSERT_TRUE(picture.overlay.arrows.empty());
    }
    if (picture.overlay.arrows.empty()) continue;
    const Arrow& arrow = picture.overlay.arrows[0];
    const glm::vec3 along = arrow.to - arrow.from;
    const float height = 2 * glm::length(picture.camera.target - picture.camera.position) *
                         std::tan(0.5f * glm::radians(picture.camera.fovDegrees));
    ASSERT_NEAR(glm::length(along) / (0.2 * height), state.tools[0].force.norm() / chart.range, 1e-4);
  }
  EXPECT_GT(largest, 0.2);
  EXPECT_LE(lastRange, 2.6 * largest);  // steps of 2 and 2.5: small forces are not lost in a wide range
  EXPECT_LE(changes, 3);
  EXPECT_FALSE(picture.overlay.arrows.empty());
}

TEST(ForceView, IsDrawnOnlyWhenAskedForAndLeavesTheHashAlone) {
  const TemporaryFolder folder;
  const auto render = [&](const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> words = {"render",   std::string(MEDULLA_SOURCE_DIR) + "/scenes/gallbladder.xml",
                                      "-o",       folder / name,
                                      "--size",   "320x180",
                                      "--frames", "2:3",
                                      "--set",    "clock.duration=0.1",
                                      "--set",    "output.golden=0"};
    words.insert(words.end(), more.begin(), more.end());
    const ProgramResult r = runProgram(words);
    EXPECT_EQ(r.exitCode, 0) << r.err;
    return r.out.substr(r.out.find("hash "), 21);
  };
  const std::string hash = render("a", {});
  EXPECT_EQ(render("b", {"--show", "force"}), hash);
  EXPECT_EQ(render("c", {"--show", "force", "--context", "egl"}), hash);
  EXPECT_NE(readFile(folder / "a/00002.png"), readFile(folder / "b/00002.png"));
  EXPECT_EQ(readPng(folder / "b/00002.png").pixels, readPng(folder / "c/00002.png").pixels);
}

}  // namespace medulla
