#include "app/model_drawing.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "app/scene_view.h"
#include "render/caption.h"
#include "render/glyphs.h"
#include "render/stroke_text.h"
#include "tests/program_run.h"
#include "tests/temporary_folder.h"

namespace medulla {
namespace {

const std::string kShown = std::string(MEDULLA_SOURCE_DIR) + "/scenes/gallbladder.xml";

// The gallbladder of a moment with everything that belongs to it.
struct Moment {
  LoadedScene loaded;
  PictureState state;

  explicit Moment(const std::string& links)
      : Moment(kShown, {{"clock.duration", "3"}, {"output.golden", "0"}, {"body.gallbladder.links", links}}) {}
  Moment(const std::string& scene, const std::vector<SceneOverride>& overrides)
      : loaded(loadScene(readScene(scene, overrides))) {
    Simulation simulation(loaded);
    while (!simulation.finished()) simulation.advanceFrame();
    stateAt(simulation.record(), simulation.record().start, state);
  }
  const SoftBodyModel& model() const { return *loaded.scene.bodies[0].model; }
  const BodyFrame& frame() const { return state.frame.bodies[0]; }
  Drawing draw(const std::vector<std::string>& parts) const {
    Drawing out;
    drawBodyModel(loaded.scene.bodies[0], frame(), readShown(parts), 0.1f, out);
    return out;
  }
};

float distance(glm::vec3 a, const Eigen::Vector3d& b) {
  return glm::distance(a, toGlm(b));
}

}  // namespace

TEST(ModelDrawing, TheSpringsEndsAreAtProxyAndDevice) {
  ToolSettings tool;
  ToolState state;
  for (const double length : {1e-5, 1e-3, 0.02}) {
    state.proxy = {0.01, 0.02, 0.03};
    state.device = state.proxy + length * Eigen::Vector3d(0.6, -0.8, 0);
    Drawing out;
    drawProxy(tool, state, out);
    ASSERT_GT(out.segments.size(), 50u);
    EXPECT_EQ(out.segments.front().a, toGlm(state.device));
    EXPECT_EQ(out.segments.back().b, toGlm(state.proxy));
    ASSERT_EQ(out.balls.size(), 2u);
    EXPECT_EQ(out.balls[0].centre, toGlm(state.proxy));
    EXPECT_EQ(out.balls[0].radius, float(tool.radius));
    EXPECT_EQ(out.balls[1].centre, toGlm(state.device));
    float widest = 0;
    for (std::size_t k = 0; k < out.segments.size(); ++k) {
      ASSERT_EQ(out.segments[k].a, k > 0 ? out.segments[k - 1].b : toGlm(state.device));
      const Eigen::Vector3d point = Eigen::Vector3d(out.segments[k].b.x, out.segments[k].b.y, out.segments[k].b.z);
      const Eigen::Vector3d axis = (state.proxy - state.device).normalized();
      widest = std::max(widest, float((point - state.device).cross(axis).norm()));
    }
    EXPECT_LE(widest, tool.radius);
    EXPECT_GT(widest, 0.3 * std::min(tool.radius, length));
  }
  state.device = state.proxy;
  Drawing none;
  drawProxy(tool, state, none);
  EXPECT_TRUE(none.segments.empty());
}

TEST(ModelDrawing, PartsStandWhereTheModelHasThem) {
  for (const char* links : {"springs", "beam"}) {
    const Moment moment(links);
    const SoftBodyModel& model = moment.model();
    const BodyFrame& frame = moment.frame();

    const Drawing spheres = moment.draw({"spheres"});
    ASSERT_EQ(spheres.balls.size(), model.spheres.size());
    EXPECT_TRUE(spheres.segments.empty() && spheres.arrows.empty());
    EXPECT_EQ(spheres.balls[3].radius, float(model.spheres[3].radius));

    const Drawing attachments = moment.draw({"attachments"});
    ASSERT_EQ(attachments.segments.size(), model.restNodes.size());
    for (std::size_t n = 0; n < model.attachments.size(); ++n) {
      const Attachment& a = model.attachments[n];
      EXPECT_LT(distance(attachments.segments[n].b, frame.nodes[n]), 1e-7f);
      EXPECT_TRUE(a.onLink || distance(attachments.segments[n].a, frame.spheres[a.host].position) < 1e-7f);
      // As long as at rest, but for the surface's own give.
      EXPECT_NEAR(glm::distance(attachments.segments[n].a, attachments.segments[n].b), a.restOffset.norm(), 0.008);
    }

    // The frames at a link's ends are right-handed, and t leads from one to the other.
    const Drawing frames = moment.draw({"frames"});
    ASSERT_EQ(frames.arrows.size(), 6 * model.links.size());
    for (std::size_t l = 0; l < model.links.size(); ++l) {
      const Arrow* at = &frames.arrows[6 * l];
      const auto along = [](const Arrow& arrow) { return glm::normalize(arrow.to - arrow.from); };
      EXPECT_NEAR(glm::dot(glm::cross(along(at[0]), along(at[1])), along(at[2])), 1, 1e-4);
      EXPECT_GT(glm::dot(along(at[0]), glm::normalize(at[3].from - at[0].from)), 0.7f);
    }

    const Drawing buckets = moment.draw({"buckets"});
    std::size_t drawn = 0;
    for (const std::vector<int>& bucket : model.buckets) {
      if (bucket.empty()) continue;
      const DrawnBall& ball = buckets.balls.at(drawn++);
      for (const int t : bucket)
        for (const int n : model.triangles[t]) EXPECT_LE(distance(ball.centre, frame.nodes[n]), 1.0001f * ball.radius);
    }
    EXPECT_EQ(drawn, buckets.balls.size());
    EXPECT_EQ(moment.draw({"mesh"}).segments.size(), model.edges.size());
    EXPECT_EQ(moment.draw({"skeleton"}).segments.size(), model.skeleton.links.size());
    EXPECT_EQ(moment.draw({"links"}).segments.size(), (std::string(links) == "beam" ? 8 : 1) * model.links.size());
  }
}

// A state cache keeps nodes in single precision.
TEST(ModelDrawing, IsTheSameOfNodesInSinglePrecision) {
  const Moment moment("beam");
  BodyFrame kept = moment.frame();
  for (Eigen::Vector3d& node : kept.nodes) {
    const glm::vec3 single = toGlm(node);
    node = {single.x, single.y, single.z};
  }
  for (const char* part : {"mesh", "skeleton", "spheres", "buckets", "links", "frames", "attachments"}) {
    const Drawing expected = moment.draw({part});
    Drawing found;
    drawBodyModel(moment.loaded.scene.bodies[0], kept, readShown({part}), 0.1f, found);
    ASSERT_EQ(found.balls.size(), expected.balls.size()) << part;
    ASSERT_EQ(found.segments.size(), expected.segments.size()) << part;
    EXPECT_GT(found.balls.size() + found.segments.size() + found.arrows.size(), 0u) << part;
    int differing = 0;
    for (std::size_t k = 0; k < found.balls.size(); ++k)
      differing +=
          found.balls[k].centre != expected.balls[k].centre || found.balls[k].radius != expected.balls[k].radius;
    for (std::size_t k = 0; k < found.segments.size(); ++k)
      differing += found.segments[k].a != expected.segments[k].a || found.segments[k].b != expected.segments[k].b;
    EXPECT_EQ(differing, 0) << part;
  }
}

// What moves is drawn: links between cells, and to what holds them; a node hangs on one of its frames.
TEST(ModelDrawing, IdentifiedLinksAreDrawnToWhatHoldsThem) {
  const Moment moment(std::string(MEDULLA_SOURCE_DIR) + "/scenes/liver.xml",
                      {{"clock.duration", "0.1"}, {"output.golden", "0"}});
  const SoftBodyModel& model = moment.model();
  const std::vector<IdentifiedLink>& links = model.identified->links;
  const std::vector<Segment> drawn = moment.draw({"links"}).segments;
  ASSERT_EQ(drawn.size(), links.size());
  const int spheres = static_cast<int>(model.spheres.size());
  int held = 0;
  for (std::size_t k = 0; k < links.size(); ++k) {
    EXPECT_LT(distance(drawn[k].a, links[k].restPoint0), 1e-3);
    EXPECT_LT(distance(drawn[k].b, links[k].restPoint1), links[k].frame1 < spheres ? 1e-3 : 1e-7);
    held += links[k].frame1 >= spheres ? 1 : 0;
  }
  EXPECT_GT(held, 0);
  EXPECT_EQ(moment.draw({"attachments"}).segments.size(), model.restNodes.size());
}

TEST(ModelDrawing, AnUnknownPartIsRefusedWithTheNearest) {
  try {
    readShown({"spheres", "atachments"});
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("did you mean \"attachments\"?"), std::string::npos);
  }
  EXPECT_EQ(namesOf(readShown({"force"})), "mesh,spheres,links,force");
  EXPECT_EQ(namesOf(readShown({"proxy", "frames"})), "frames,proxy");
}

TEST(SplitView, PanelsAreThePicturesOfTheirSize) {
  const TemporaryFolder folder;
  const auto render = [&](const std::string& name, const std::string& view, const std::string& size) {
    const ProgramResult r = runProgram({"render", kShown, "--still", "0.1", "-o", folder / name, "--quality",
                                        "standard", "--view", view, "--size", size, "--show", "proxy"});
    EXPECT_EQ(r.exitCode, 0) << r.err;
    return readPng(folder / name);
  };
  const Image tissue = render("t.png", "tissue", "64x48"), model = render("m.png", "model", "64x48");
  for (const int room : {0, 1}) {  // what is left of an odd width stays black
    const Image split = render("s.png", "tissue,model", std::to_string(128 + room) + "x48");
    Image expected = blackImage(128 + room, 48);
    copyInto(tissue, 0, expected);
    copyInto(model, 64 + room, expected);
    EXPECT_EQ(split.pixels, expected.pixels);
  }
  const ProgramResult narrow = runProgram(
      {"render", kShown, "--still", "0", "-o", folder / "n.png", "--view", "tissue,model", "--size", "30x48"});
  EXPECT_EQ(narrow.exitCode, 1);
  EXPECT_NE(narrow.err.find("expected a width of 32 at least"), std::string::npos) << narrow.err;
}

// A film's captions come and go: what is longer goes on in the next line, in letters as large.
TEST(Caption, LettersAreAsLargeHoweverLongItIs) {
  Image brief = blackImage(640, 720), more = brief;
  EXPECT_TRUE(drawCaption("gallbladder   4.00 s", brief.width, brief));
  EXPECT_TRUE(drawCaption("gallbladder   4.00 s   slides along the body, still pressing", more.width, more));
  const int margin = 22, letters = 23, beyondName = 200;
  int lit = 0;
  for (int y = margin + letters; y < margin + 2 * letters; ++y)
    for (int x = margin + letters; x < beyondName; ++x) {
      const std::size_t at = 4ul * (std::size_t(y) * 640 + x);
      EXPECT_EQ(more.pixels[at], brief.pixels[at]) << x << " " << y;
      lit += brief.pixels[at] > 150 ? 1 : 0;
    }
  EXPECT_GT(lit, 100);
}

TEST(Caption, FitsIntoPicturesOfAnySize) {
  for (const auto& [width, height] : {std::pair(320, 240), std::pair(1280, 720), std::pair(200, 400)}) {
    const Image before = blackImage(width, height);
    Image image = before;
    EXPECT_TRUE(drawCaption("gallbladder   3.40 s   grabbed", image.width, image));
    int right = 0, bottom = 0;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        if (image.pixels[4ul * (std::size_t(y) * width + x) + 1] > 150) {
          right = std::max(right, x);
          bottom = std::max(bottom, y);
        }
    EXPECT_GT(right, 0) << width;
    EXPECT_LT(right, width - 3);
    EXPECT_LT(bottom, 0.15 * height);
  }
  Image narrow = blackImage(100, 240);  // than a word
  EXPECT_TRUE(drawCaption("cholecystectomy_rehearsal 3.40 s", narrow.width, narrow));
  EXPECT_NE(narrow.pixels, blackImage(100, 240).pixels);
  Image tiny = blackImage(16, 16);
  EXPECT_FALSE(drawCaption("not to be read", tiny.width, tiny));
  EXPECT_EQ(tiny.pixels, blackImage(16, 16).pixels);
}

// The characters of UTF-8, each by itself.
std::vector<std::string> charactersOf(const std::string& text) {
  std::vector<std::string> out;
  for (const char c : text)
    if ((c & 0xC0) == 0x80)
      out.back() += c;
    else
      out.emplace_back(1, c);
  return out;
}

TEST(StrokeText, EveryLetterDiffersFromTheOthersAndFromAMissingOne) {
  std::string letters;
  for (char c = '!'; c <= '~'; ++c) letters += c;
  letters += "°±²³µ·×÷ßÆæŒœÞþıȷ–—„…";
  letters += "ÀÁÂÃÄÅÇÈÉÊËÌÍÎÏÑÒÓÔÕÖØÙÚÛÜÝàáâãäåçèéêëìíîïñòóôõöøùúûüýÿ";
  letters += "ĀāĂăĄąĆćČčĎĐđĒēĖėĘęĚěĞğĪīĮįİŁłŃńŇňŌōŐőŔŕŘřŚśŞşŠšŢţŤŪūŮůŰűŲųŸŹźŻżŽž";
  letters += "«»ẞ€ĈĉĊċďĔĕĜĝĠġĢģĤĥĦħĨĩĬĭĴĵĶķĹĺĻļĽľŅņŊŋŎŏŖŗŜŝťŦŧŨũŬŭŴŵŶŷ";
  std::vector<std::vector<std::uint8_t>> seen;
  for (const std::string& letter : charactersOf(letters + "\x01")) {
    Image image = blackImage(70, 72);
    Ink ink(image, {0, 0}, {image.width, image.height});
    writeText(letter, {4, 16}, 36, ink);
    ink.apply({1, 1, 1}, 1);
    const auto same = std::find(seen.begin(), seen.end(), image.pixels);
    EXPECT_EQ(same, seen.end()) << letter << " as number " << same - seen.begin();
    seen.push_back(image.pixels);
    EXPECT_EQ(firstUndrawn(letter), letter == "\x01" ? letter : "");
  }
}

TEST(StrokeText, WhatNobodyDrawsIsABoxPerCharacter) {
  for (const char* digit : {"1", "2", "3", "4", "5", "6", "7", "8", "9"})
    EXPECT_EQ(textWidth(digit, 6), textWidth("0", 6));  // captions that count do not tremble
  const float box = textWidth("\x01", 6);
  EXPECT_EQ(textWidth("放す", 6), 2 * box);
  EXPECT_EQ(textWidth("\xe6\x94", 6), 2 * box) << "cut within a character";
  EXPECT_EQ(textWidth("\xff", 6), box);
  EXPECT_EQ(textWidth("\xc3"
                      "a",
                      6),
            box + textWidth("a", 6));
  EXPECT_EQ(textWidth("é", 6), textWidth("e", 6));
  EXPECT_EQ(firstUndrawn("é放す"), "放");
  EXPECT_EQ(firstUndrawn("a\xff!"), "\xff");
  EXPECT_EQ(firstUndrawn("Gallenblase “gelöst” – l’a lâché"), "");  // quotation marks are straight ones
}

}  // namespace medulla
