#include "app/files/state_cache.h"

#include <gtest/gtest.h>

#include "app/commands/commands.h"
#include "app/commands/run.h"
#include "app/interrupt.h"
#include "tests/complaint.h"
#include "tests/own_scene.h"

// The state cache: exact where it says so, read at any place, refused when it is not whole.
namespace medulla {
namespace {

CacheLayout layoutOf() {
  CacheLayout layout;
  layout.motionHash = 0x1234567890abcdefULL;
  layout.fps = 29.97;
  layout.bodies = {{"liver", 1, 2}, {"gut", 0, 1}};
  layout.tools = {"grasper"};
  return layout;
}

PictureState stateAtNumber(int number) {
  PictureState s;
  s.time = number / 29.97;
  s.frame.bodies.resize(2);
  s.frame.bodies[0].spheres.push_back({{0.1 * number, 1e-9, -3}, Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5)});
  s.frame.bodies[0].nodes = {{0.1, 0.2, 0.3 + number}, {1, 2, 3}};
  s.frame.bodies[1].nodes = {{-0.1, 0, 1e-3}};
  s.inputs.push_back({0.5, {1, 2, 3}, Eigen::Quaterniond(0.6, 0, 0.8, 0), 0.25});
  ToolState tool;
  tool.device = {0.1, 0.2, 0.3};
  tool.proxy = {0.1, 0.2, 0.4};
  tool.force = {0, 0, number + 0.1};
  tool.inContact = true;
  tool.clamped = number % 2 == 1;
  s.tools.push_back(tool);
  return s;
}

void writeCache(const std::string& path, int pictures) {
  CacheWriter writer(path, layoutOf());
  for (int n = 0; n < pictures; ++n) writer.write(stateAtNumber(n), 1000u + unsigned(n));
  writer.finish(77);
  writer.commit();
}

std::string readingComplaint(const std::string& path, int picture = -1) {
  return complaintOf([&] {
    CacheReader reader(path);
    PictureState state;
    if (picture >= 0) reader.read(picture, state);
  });
}

TEST(StateCache, KeepsEveryBitInAnyOrder) {
  const TemporaryFolder folder;
  writeCache(folder / "a", 5);
  CacheReader reader(folder / "a");
  EXPECT_EQ(reader.pictures(), 5);
  EXPECT_EQ(reader.finalHash(), 77u);
  EXPECT_EQ(reader.layout().motionHash, layoutOf().motionHash);
  EXPECT_EQ(reader.layout().fps, 29.97);
  EXPECT_EQ(reader.layout().bodies, layoutOf().bodies);
  EXPECT_EQ(reader.layout().tools, layoutOf().tools);
  PictureState state;
  for (const int n : {3, 0, 4, 3}) {
    EXPECT_EQ(reader.read(n, state), 1000u + unsigned(n));
    const PictureState expected = stateAtNumber(n);
    EXPECT_EQ(state.time, expected.time);
    EXPECT_EQ(state.frame.bodies[0].spheres[0].position, expected.frame.bodies[0].spheres[0].position);
    EXPECT_EQ(state.frame.bodies[0].spheres[0].worldFromSphere.coeffs(),
              expected.frame.bodies[0].spheres[0].worldFromSphere.coeffs());
    for (std::size_t b = 0; b < 2; ++b)
      for (std::size_t k = 0; k < expected.frame.bodies[b].nodes.size(); ++k)
        EXPECT_EQ(state.frame.bodies[b].nodes[k].cast<float>(), expected.frame.bodies[b].nodes[k].cast<float>());
    EXPECT_EQ(state.inputs[0].worldFromTool.coeffs(), expected.inputs[0].worldFromTool.coeffs());
    EXPECT_EQ(state.inputs[0].grip, 0.25);
    EXPECT_EQ(state.tools[0].force, expected.tools[0].force);
    EXPECT_TRUE(state.tools[0].inContact);
    EXPECT_FALSE(state.tools[0].holding);
    EXPECT_EQ(state.tools[0].clamped, n % 2 == 1);
  }
}

TEST(StateCache, WhatIsNotWholeIsRefused) {
  const TemporaryFolder folder;
  writeCache(folder / "a", 3);
  const std::string bytes = readFile(folder / "a");
  for (std::size_t size = 0; size < bytes.size(); size += size < 200 ? 1 : 61) {
    folder.write("cut", bytes.substr(0, size));
    EXPECT_NE(readingComplaint(folder / "cut"), "") << size;
  }
  folder.write("longer", bytes + "x");
  EXPECT_NE(readingComplaint(folder / "longer").find("cut off or broken"), std::string::npos);
  // A byte changed anywhere is noticed: in the head and the tail at once, in a picture when that is read.
  for (std::size_t at = 0; at < bytes.size(); at += 7) {
    std::string changed = bytes;
    changed[at] ^= 4;
    folder.write("changed", changed);
    std::string complaint;
    for (int n = 0; n < 3 && complaint.empty(); ++n) complaint = readingComplaint(folder / "changed", n);
    EXPECT_NE(complaint, "") << at;
  }
  EXPECT_NE(readingComplaint(folder / "none").find("none: cannot be opened"), std::string::npos);
  EXPECT_NE(readingComplaint(folder.path()), "");
  folder.write("log.csv", "t,x\n0,1\n");
  EXPECT_NE(readingComplaint(folder / "log.csv").find("this is no state cache"), std::string::npos);
}

TEST(StateCache, AppearsOnlyWhenWhole) {
  const TemporaryFolder folder;
  {
    CacheWriter writer(folder / "a", layoutOf());
    writer.write(stateAtNumber(0), 1);
  }
  EXPECT_TRUE(folder.contents().empty());
}

class CacheOfScene : public OwnScene {
 protected:
  void SetUp() override {
    OwnScene::SetUp();
    const ProgramResult r = run({"replay", "own/organ.xml", "--cache", "organ.cache"});
    ASSERT_EQ(r.exitCode, 0) << r.err;
    replayed = r.out;
  }
  ProgramResult render(const std::vector<std::string>& more) const {
    std::vector<std::string> words{"render", "own/organ.xml", "--cache", "organ.cache", "--size", "64x48"};
    words.insert(words.end(), more.begin(), more.end());
    return run(words);
  }
  std::string replayed;
};

TEST_F(CacheOfScene, SlicesEqualThoseOfTheWholeRun) {
  const std::vector<std::string> look{"--view", "both", "--show", "proxy"};
  const auto with = [&look](std::vector<std::string> words) {
    words.insert(words.end(), look.begin(), look.end());
    return words;
  };
  const ProgramResult whole = run(with({"render", "own/organ.xml", "--size", "64x48", "-o", "whole"}));
  ASSERT_EQ(whole.exitCode, 0) << whole.err;
  const ProgramResult slice = render(with({"--frames", "4:9", "-o", "slice"}));
  ASSERT_EQ(slice.exitCode, 0) << slice.err;
  EXPECT_NE(slice.out.find("pictures 5\n"), std::string::npos) << slice.out;
  EXPECT_NE(slice.out.find(whole.out.substr(whole.out.find("hash "))), std::string::npos) << slice.out;
  EXPECT_NE(replayed.find(whole.out.substr(whole.out.find("hash "))), std::string::npos) << replayed;
  ASSERT_EQ(run(with({"render", "own/organ.xml", "--size", "64x48", "--frames", "4:9", "-o", "simulated"})).exitCode,
            0);
  for (int n = 0; n < 12; ++n) {
    const std::string name = fmt::format("/{:05d}.png", n);
    EXPECT_EQ(std::filesystem::exists(folder / ("slice" + name)), n >= 4 && n < 9);
    if (n < 4 || n >= 9) continue;
    EXPECT_EQ(read("slice" + name), read("whole" + name)) << n;
    EXPECT_EQ(read("simulated" + name), read("whole" + name)) << n;
  }
  ASSERT_EQ(render({"--still", "0.32", "-o", "still.png", "--quality", "standard"}).exitCode, 0);
  EXPECT_GT(read("still.png").size(), 1000u);
}

TEST_F(CacheOfScene, OfAnotherMotionItIsRefusedOfAnotherPictureNot) {
  write({.look = "stomach", .cameraTarget = -0.04});
  EXPECT_EQ(render({"--frames", "0:1", "-o", "other"}).exitCode, 0);
  expectRefused(render({"--fps", "24", "-o", "x.png", "--still", "0"}), "holds 25 pictures per second, expected 24");
  expectRefused(render({"--still", "0.3", "-o", "x.png"}), "none at 0.3 s");
  for (const std::string drawn : {"camera.fov=50", "light.intensity=2", "output.size=64 48", "body.organ.look=gut"})
    EXPECT_EQ(render({"--set", drawn, "-o", "drawn"}).exitCode, 0) << drawn;
  expectRefused(render({"--set", "dynamics.gravity=0 0 1", "-o", "x"}), "organ.cache: is of another scene or stale");
  write({.young = "6e3"});
  expectRefused(render({"-o", "x"}), "organ.cache: is of another scene or stale");
  write({});
  folder.write("own/organ.csv", "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n0,-0.0525,-0.0385,0.06,1,0,0,0,0\n");
  expectRefused(render({"-o", "x"}), "organ.cache: is of another scene or stale");
  expectRefused(render({"--log", "x.csv"}), "--log", 2);
  expectRefused(run({"replay", "own/organ.xml", "--record", "own/organ.csv"}), "over an input");
  EXPECT_FALSE(std::filesystem::exists(folder / "x"));
}

// The vertices of a glTF mesh lie in a file that the scene does not name.
TEST_F(CacheOfScene, VerticesThatAMeshFileNamesCount) {
  const auto writeVertices = [&](float height) {
    const float p[12] = {0, 0, 0, 0.01F, 0, 0, 0, 0.01F, 0, 0, 0, height};
    const std::uint16_t t[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    folder.write("own/a.bin", std::string(reinterpret_cast<const char*>(p), sizeof p) +
                                  std::string(reinterpret_cast<const char*>(t), sizeof t));
  };
  folder.write("own/a.gltf", R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"buffers":[{"uri":"a.bin","byteLength":72}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[0.01,0.01,0.01]},
{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}]})");
  std::string scene = read("own/organ.xml");
  scene.insert(scene.find("<tool"), R"(<static shape="mesh" mesh="a.gltf" look="wall" position="0 1 0"/>)");
  folder.write("own/organ.xml", scene);
  writeVertices(0.01F);
  ASSERT_EQ(run({"replay", "own/organ.xml", "--cache", "organ.cache"}).err, "");
  ASSERT_EQ(render({"--frames", "0:1", "-o", "x"}).err, "");
  writeVertices(0.02F);
  expectRefused(render({"--frames", "0:1", "-o", "x"}), "organ.cache: is of another scene or stale");
}

// The strip chart shows the force of every tick, which no picture holds.
TEST_F(CacheOfScene, HelpNamesWhatItCannotShow) {
  expectRefused(render({"--show", "force", "-o", "x"}), "--show force: nothing is simulated, and a cache has pictures",
                2);
  const auto helpOf = [&](const std::string& verb) {
    std::istringstream words(run({verb, "--help"}).out);
    std::string text;
    for (std::string word; words >> word;) text += word + " ";
    return text;
  };
  EXPECT_NE(helpOf("render").find("force shows every tick, and is not drawn from a --cache"), std::string::npos);
  EXPECT_NE(helpOf("render").find("these lack the ticks of --show force"), std::string::npos);
  EXPECT_NE(helpOf("replay").find("not the ticks of --show force"), std::string::npos);
}

TEST_F(CacheOfScene, CompareNamesTheFirstPictureAndFieldThatDiffer) {
  EXPECT_EQ(run({"compare", "organ.cache", "organ.cache"}).out, "equal yes\npictures 12\n");
  expectRefused(run({"compare", "organ.cache", "none.cache"}), "none.cache: cannot be opened");
  const auto replay = [&](const std::string& set) {
    ASSERT_EQ(run({"replay", "own/organ.xml", "--cache", "other.cache", "--set", set}).exitCode, 0);
  };
  // The tool meets the organ after 0.2 s: until then pictures differ by rounding at most, whatever the tissue.
  replay("tissue.t.young=5.5e3");
  const ProgramResult any = run({"compare", "organ.cache", "other.cache"});
  EXPECT_EQ(any.exitCode, 3);
  EXPECT_EQ(any.out.substr(0, 17), "equal no\npicture ") << any.out;
  EXPECT_NE(any.out.find("\nfield organ."), std::string::npos) << any.out;
  const ProgramResult seen = run({"compare", "organ.cache", "other.cache", "--tolerance", "1e-6"});
  EXPECT_EQ(seen.exitCode, 3);
  const int picture = std::stoi(seen.out.substr(seen.out.find("picture ") + 8));
  EXPECT_GT(picture, 5) << seen.out;
  EXPECT_LT(picture, 10) << seen.out;
  EXPECT_NE(seen.out.find("\nfield organ."), std::string::npos) << seen.out;
  EXPECT_EQ(run({"compare", "organ.cache", "other.cache", "--tolerance", "2"}).exitCode, 0);
  replay("clock.duration=0.46");  // as many pictures
  const ProgramResult end = run({"compare", "organ.cache", "other.cache"});
  EXPECT_EQ(end.exitCode, 3);
  EXPECT_TRUE(end.out.starts_with("equal no\nfield state_hash\na ")) << end.out;
  EXPECT_EQ(run({"compare", "organ.cache", "other.cache", "--tolerance", "1e-9"}).exitCode, 0);
  replay("clock.duration=0.4");
  EXPECT_EQ(run({"compare", "organ.cache", "other.cache"}).out, "equal no\npictures_a 12\npictures_b 10\n");
  replay("output.fps=50");
  EXPECT_EQ(run({"compare", "organ.cache", "other.cache"}).out,
            "equal no\na 25 pictures per second, organ of 7 spheres and 235 nodes, probe\n"
            "b 50 pictures per second, organ of 7 spheres and 235 nodes, probe\n");
  folder.write("log.csv", "t,x\n0,1\n");
  expectRefused(run({"compare", "organ.cache", "log.csv"}), "organ.cache is a state cache, log.csv is none");
}

// Until rest nothing sleeps: of bodies that would, that is another motion.
TEST_F(CacheOfScene, UntilRestAMotionWithoutSleepIsMeant) {
  RunOptions options, untilRest;
  options.scene = untilRest.scene = folder / "own/organ.xml";
  untilRest.untilRest = true;
  const auto areOneMotion = [&] { return motionHash(loadRun(options)) == motionHash(loadRun(untilRest)); };
  EXPECT_TRUE(areOneMotion());
  options.overrides = untilRest.overrides = {{"dynamics.sleep_after", "1"}};
  EXPECT_FALSE(areOneMotion());
}

// Large ones take minutes.
TEST_F(CacheOfScene, ComparingEndsAtAnInterrupt) {
  const std::string cache = folder / "organ.cache";
  for (const double tolerance : {0., 1e-6}) {
    const pid_t child = fork();
    if (child == 0) {
      std::signal(SIGINT, SIG_DFL);  // nohup would have it ignored
      watchInterrupts();
      std::raise(SIGINT);
      try {
        runCompare({cache, cache, tolerance});
      } catch (const Interrupted&) {
        _exit(130);
      }
      _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_EQ(WEXITSTATUS(status), 130) << tolerance;
  }
}

}  // namespace
}  // namespace medulla
