#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/program_run.h"
#include "tests/temporary_folder.h"

// The program as its users meet it: results, exit codes, one line per refusal, nothing half-written.
namespace medulla {

static const std::string kScene = std::string(MEDULLA_SOURCE_DIR) + "/scenes/gallbladder.xml";

static const std::vector<std::string> kShort = {"--set", "clock.duration=0.2", "--set", "output.golden=0"};

static std::vector<std::string> command(std::vector<std::string> words, const std::vector<std::string>& more = kShort) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

TEST(Program, ReplayPrintsItsResultsAndTheSameHashTwice) {
  const ProgramResult a = runProgram(command({"replay", kScene})), b = runProgram(command({"replay", kScene}));
  ASSERT_EQ(a.exitCode, 0) << a.err;
  for (const char* name : {"simulated", "cpu", "realtime", "substeps", "ticks", "force_max", "force_clamped",
                           "grip_slips", "user_energy_max", "volume_ratio_min", "volume_ratio_max", "impulse_mismatch",
                           "penetration_max", "static_penetration_max", "hash"})
    EXPECT_NE(valueOf(a.out, name), "") << name << " is missing in\n" << a.out;
  EXPECT_EQ(valueOf(a.out, "hash").size(), 16u);
  EXPECT_EQ(valueOf(a.out, "hash"), valueOf(b.out, "hash"));
}

// The hand feels the same organ whether the dynamics runs twenty or a hundred times a second.
TEST(Program, ShippedScenesRunAtSlowerAndFasterDynamics) {
  for (const char* name : {"gallbladder", "liver", "stomach"}) {
    const std::string scene = std::string(MEDULLA_SOURCE_DIR "/scenes/") + name + ".xml";
    const auto forceAt = [&](const char* rate) {
      const ProgramResult r = runProgram({"replay", scene, "--set", std::string("clock.dynamics=") + rate});
      EXPECT_EQ(r.exitCode, 0) << r.err;
      return std::atof(valueOf(r.out, "force_max").c_str());
    };
    const double expected = forceAt("50");
    EXPECT_GT(expected, 0.5);
    for (const char* rate : {"20", "100"})
      EXPECT_NEAR(forceAt(rate), expected, 0.12 * expected) << name << " at " << rate << " Hz";
  }
}

TEST(Program, BodiesThatOverlapAtTheStartAreNamedOnceAndComeApart) {
  const TemporaryFolder folder;
  const std::string body =
      fmt::format("model='{}/assets/gallbladder/gallbladder.model.xml' tissue='t' look='fat'", MEDULLA_SOURCE_DIR);
  folder.write("two.xml", fmt::format("<scene name='two'><clock duration='0.5'/><dynamics gravity='0 0 0'/>"
                                      "<tissue name='t'/><body name='left' {0}/>"
                                      "<body name='right' {0} position='0.004 0.022 0'/>"
                                      "<camera position='0 0 1' target='0 0 0'/></scene>",
                                      body));
  const ProgramResult run = runProgram({"replay", folder / "two.xml"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const std::string warning = "warning: bodies 'left' and 'right' overlap by ";
  const std::size_t first = run.err.find(warning);
  ASSERT_NE(first, std::string::npos) << run.err;
  EXPECT_EQ(run.err.find(warning, first + 1), std::string::npos) << run.err;
  EXPECT_NE(valueOf(run.out, "penetration_max"), "0");
}

TEST(Program, TellsThatBodiesDoNotSleepUnderTheImplicitIntegrator) {
  const auto told = [](const std::string& integrator) {
    const std::string sleeps = "dynamics.sleep_after=1", as = "dynamics.integrator=" + integrator;
    const ProgramResult run = runProgram(command({"replay", kScene, "--set", sleeps, "--set", as}));
    EXPECT_EQ(run.exitCode, 0) << run.err;
    return run.err.find("warning: sleep_after has no effect") != std::string::npos;
  };
  EXPECT_TRUE(told("implicit") && !told("explicit"));
}

TEST(Program, TellsOfAToolThatTouchesNothing) {
  const TemporaryFolder folder;
  folder.write("away.csv", "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n0,0,1,0,1,0,0,0,0\n0.1,0.1,1,0,1,0,0,0,0\n");
  const auto told = complaints(runProgram(command({"replay", kScene, "--trajectory", folder / "away.csv"})));
  EXPECT_EQ(told, std::vector<std::string>{"note: tool 'grasper' touched nothing in its whole motion"});
}

TEST(Program, DrawingOptionsLeaveTheHashAlone) {
  const TemporaryFolder folder;
  const std::string hash = valueOf(runProgram(command({"replay", kScene})).out, "hash");
  const ProgramResult plain =
      runProgram(command({"render", kScene, "-o", folder / "a", "--size", "64x48", "--fps", "24", "--frames", "0:2"}));
  ASSERT_EQ(plain.exitCode, 0) << plain.err;
  EXPECT_EQ(valueOf(plain.out, "hash"), hash);
  const ProgramResult other = runProgram(command(
      {"render", kScene, "-o", folder / "b", "--size", "96x64", "--fps", "17", "--view", "both", "--show", "proxy"}));
  ASSERT_EQ(other.exitCode, 0) << other.err;
  EXPECT_EQ(valueOf(other.out, "hash"), hash);
  EXPECT_TRUE(std::filesystem::exists(folder / "a/00001.png"));
  EXPECT_FALSE(std::filesystem::exists(folder / "a/00002.png"));
  EXPECT_TRUE(std::filesystem::exists(folder / "b/00003.png"));
}

TEST(Program, LogsOfTwoRunsAreEqualByteForByte) {
  const TemporaryFolder folder;
  for (const char* name : {"a.csv", "b.csv"})
    ASSERT_EQ(runProgram(command({"replay", kScene, "--log", folder / name})).exitCode, 0);
  EXPECT_EQ(readFile(folder / "a.csv"), readFile(folder / "b.csv"));
  EXPECT_NE(readFile(folder / "a.csv").find("grasper.device.x"), std::string::npos);
}

// The device's motion as the run consumed it, and the force that it felt: replayed, neither differs in a bit.
TEST(Program, ARecordReplaysToTheSameHashAndForce) {
  const TemporaryFolder folder;
  const std::vector<std::string> press = {"--set", "clock.duration=2.6"};
  const std::string file = folder / "record.csv";
  const ProgramResult first = runProgram(command({"replay", kScene, "--record", file}, press));
  ASSERT_EQ(first.exitCode, 0) << first.err;
  EXPECT_EQ(valueOf(first.out, "grasper.force_rms"), "");
  const ProgramResult again = runProgram(command({"replay", kScene, "--trajectory", file}, press));
  EXPECT_EQ(valueOf(again.out, "hash"), valueOf(first.out, "hash"));
  EXPECT_GT(std::stod(valueOf(first.out, "force_max")), 0.05);
  EXPECT_EQ(valueOf(again.out, "grasper.force_rms"), "0 N");
  EXPECT_EQ(valueOf(again.out, "grasper.force_lag"), "0 s");
  EXPECT_EQ(valueOf(again.out, "grasper.force_peak"), valueOf(again.out, "grasper.force_peak_measured"));
  const ProgramResult stiffer =
      runProgram(command({"replay", kScene, "--trajectory", file, "--set", "tissue.bile_sac.young=4e4"}, press));
  EXPECT_GT(std::stod(valueOf(stiffer.out, "grasper.force_peak")),
            1.5 * std::stod(valueOf(stiffer.out, "grasper.force_peak_measured")));
  EXPECT_GT(std::stod(valueOf(stiffer.out, "grasper.force_rms")), 0.01);
}

TEST(Program, ToolsAreRecordedEachIntoAFileOfItsOwn) {
  const TemporaryFolder folder;
  const std::string scene = std::string(MEDULLA_SOURCE_DIR) + "/scenes/abdomen.xml";
  const std::string a = "grasper=" + folder / "a.csv", b = "retractor=" + folder / "b.csv";
  const std::vector<std::string> brief = {"--set", "clock.duration=0.7"};
  const ProgramResult first = runProgram(command({"replay", scene, "--record", a, "--record", b}, brief));
  ASSERT_EQ(first.exitCode, 0) << first.err;
  const ProgramResult again = runProgram(command({"replay", scene, "--trajectory", b, "--trajectory", a}, brief));
  EXPECT_EQ(valueOf(again.out, "hash"), valueOf(first.out, "hash"));
  EXPECT_EQ(valueOf(again.out, "retractor.force_rms"), "0 N");
  expectRefusal(runProgram(command({"replay", scene, "--record", folder / "c.csv"}, brief)), 1,
                {"--record", "2 tools"});
  expectRefusal(runProgram(command({"replay", scene, "--record", "hook=" + folder / "c.csv"}, brief)), 1, {"hook"});
  EXPECT_EQ(folder.contents().size(), 2u);
}

TEST(Program, SurfaceHasTheInputMeshsOrder) {
  const TemporaryFolder folder;
  ASSERT_EQ(runProgram(command({"replay", kScene, "--surface-at", "end", folder / "end.obj"})).exitCode, 0);
  const std::string text = readFile(folder / "end.obj");
  EXPECT_NE(text.find("o gallbladder\n"), std::string::npos);
  std::size_t faces = 0;
  for (std::size_t at = text.find("\nf "); at != std::string::npos; at = text.find("\nf ", at + 1)) ++faces;
  EXPECT_EQ(faces, 466u);
}

TEST(Program, BuildsAModelThatRenders) {
  const TemporaryFolder folder;
  const std::string mesh = std::string(MEDULLA_SOURCE_DIR) + "/assets/gallbladder/gallbladder.obj";
  const ProgramResult r =
      runProgram({"build", mesh, "-o", folder / "m.xml", "--spheres", "9", "--report", folder / "report.csv"});
  ASSERT_EQ(r.exitCode, 0) << r.err;
  for (const char* name :
       {"triangles", "skeleton_nodes", "skeleton_links", "spheres", "links", "gap_max", "gap_mean", "gap_cones_max",
        "cover", "cover_cones", "mass_error", "centre_error", "inertia_error", "components", "centres_outside",
        "attachments_crossing", "attachment_max", "degree_max", "seconds"})
    EXPECT_NE(valueOf(r.out, name), "") << name;
  EXPECT_EQ(valueOf(r.out, "spheres"), "9");
  EXPECT_TRUE(std::filesystem::exists(folder / "report.csv"));
  EXPECT_EQ(runProgram(command({"replay", kScene, "--set", "body.gallbladder.model=" + folder / "m.xml"})).exitCode, 0);
}

TEST(Program, BuildsToAGap) {
  const TemporaryFolder folder;
  const std::string mesh = std::string(MEDULLA_SOURCE_DIR) + "/assets/gallbladder/gallbladder.obj";
  const ProgramResult r = runProgram({"build", mesh, "-o", folder / "m.xml", "--gap", "6", "--render-levels", "0"});
  ASSERT_EQ(r.exitCode, 0) << r.err;
  EXPECT_LE(std::stod(valueOf(r.out, "gap_max")), 6);
  EXPECT_LT(std::stoi(valueOf(r.out, "spheres")), 7);  // seven leave less than 4 %
  EXPECT_NE(readFile(folder / "m.xml").find("--gap 6 "), std::string::npos);
  expectRefusal(runProgram({"build", mesh, "-o", folder / "n.xml", "--gap", "6", "--spheres", "7"}), 2,
                {"--gap", "--spheres"});
  expectRefusal(runProgram({"build", mesh, "-o", folder / "n.xml", "--gap", "6", "--method", "skeleton"}), 2,
                {"--gap", "cover"});
  expectRefusal(runProgram({"build", mesh, "-o", folder / "n.xml", "--overshoot", "1", "--method", "skeleton"}), 2,
                {"--overshoot", "cover"});
  expectRefusal(runProgram({"build", mesh, "-o", folder / "n.xml", "--overshoot", "6"}), 2, {"--overshoot", "5"});
  EXPECT_EQ(folder.contents(), std::vector<std::string>{"m.xml"});
}

TEST(Program, IdentifiesTheSameNetworkEachTime) {
  const TemporaryFolder folder;
  const std::string mesh = MEDULLA_SOURCE_DIR "/tests/accuracy/cylinder.obj";
  const auto build = [&](const std::string& output, std::vector<std::string> more) {
    more.insert(more.begin(), {"build", mesh, "-o", folder / output, "--spheres", "5", "--render-levels", "0"});
    return runProgram(more);
  };
  const ProgramResult r = build("a.xml", {"--identify", "--fix", "plane=1,0,0,0.001"});
  EXPECT_EQ(r.exitCode, 0) << r.err;
  for (const char* name : {"identified_voxel", "identified_error_max", "identified_error_rms",
                           "identified_poke_error_max", "finite_elements_error_max", "formulas_error_rms"})
    EXPECT_NE(r.out.find(name), std::string::npos) << name;
  // Its frames are those of the file.
  const ProgramResult info = runProgram({"info", folder / "a.xml"});
  for (const char* name : {"attachment_max", "attachments_crossing", "centre_error"})
    EXPECT_EQ(valueOf(r.out, name), valueOf(info.out, name)) << name;
  EXPECT_EQ(build("b.xml", {"--identify", "--fix", "plane=1,0,0,0.001"}).exitCode, 0);
  const std::string model = readFile(folder / "a.xml");
  EXPECT_EQ(model, readFile(folder / "b.xml"));
  EXPECT_NE(model.find("--identify --poisson 0.45 --link-form full --fix plane=1,0,0,0.001"), std::string::npos);

  const auto refused = [&](const std::vector<std::string>& more, int exitCode, const std::vector<std::string>& says) {
    expectRefusal(build("c.xml", more), exitCode, says);
    EXPECT_FALSE(std::filesystem::exists(folder / "c.xml"));
  };
  refused({"--identify", "--poisson", "0.5"}, 2, {"0.5", "less than 0.5"});
  refused({"--identify", "--poisson", "-0.1"}, 2, {"-0.1", "from 0 to less than 0.5"});
  refused({"--fix", "plane=1,0,0,0.001"}, 2, {"--identify"});
}

TEST(Program, TellsMistakesInWhatIsHeldBeforeItPlacesSpheres) {
  const TemporaryFolder folder;
  const std::string mesh = MEDULLA_SOURCE_DIR "/tests/accuracy/cylinder.obj";
  folder.write("beyond.csv", "vertex\n0\n100000\n");
  const auto refused = [&](const std::string& fix, const std::vector<std::string>& says) {  // no spheres reach the gap
    const std::vector<std::string> words{"build", mesh, "-o", folder / "a.xml", "--gap", "0.01"};
    expectRefusal(runProgram(command(words, {"--identify", "--fix", fix})), 1, says);
  };
  refused("box=1,1,1,2,2,2", {"cylinder.obj", "box=1,1,1,2,2,2", "no node"});
  refused("box=0,0,0,1,1", {"--fix box=0,0,0,1,1", "x0,y0,z0,x1,y1,z1"});
  refused("cone=0,0,0,1", {"--fix cone=", "vertices=FILE.csv"});
  refused("vertices=none.csv", {"none.csv", "cannot be opened"});
  refused("vertices=" + (folder / "beyond.csv"), {"beyond.csv:3", "100000"});
  EXPECT_FALSE(std::filesystem::exists(folder / "a.xml"));
}

TEST(Program, IdentifiesWhereNoSphereIsFixed) {
  const TemporaryFolder folder;
  const std::string mesh = MEDULLA_SOURCE_DIR "/tests/accuracy/cylinder.obj";
  const std::vector<std::string> command{"build", mesh, "--render-levels", "0", "--identify", "-o", folder / "a.xml"};
  std::vector<std::string> small = command, single = command;
  small.insert(small.end(), {"--spheres", "2", "--fix", "plane=1,0,0,0.001"});  // held nodes alone
  single.insert(single.end(), {"--spheres", "1"});
  expectRefusal(runProgram(single), 1, {"cylinder.obj", "single sphere", "--fix"});
  EXPECT_FALSE(std::filesystem::exists(folder / "a.xml"));
  const ProgramResult r = runProgram(small);
  EXPECT_EQ(r.exitCode, 0) << r.err;
  EXPECT_LT(std::stod(valueOf(r.out, "formulas_error_rms")), 30);
}

TEST(Program, BuildsSeveralBodiesAsEachAlone) {
  const TemporaryFolder folder;
  const std::string assets = std::string(MEDULLA_SOURCE_DIR) + "/assets/";
  folder.write("large.obj", readFile(assets + "gallbladder/gallbladder.obj"));
  folder.write("dolphin.obj", readFile(assets + "dolphin/dolphin.obj"));
  const std::vector<std::string> few = {"--render-levels", "0"};
  const ProgramResult both = runProgram(command({"build", folder / "large.obj", folder / "dolphin.obj", "-o",
                                                 folder / "models", "--spheres", "12", "--report", folder / "r.csv"},
                                                few));
  ASSERT_EQ(both.exitCode, 0) << both.err;
  const std::string large = valueOf(both.out, "large.spheres"), dolphin = valueOf(both.out, "dolphin.spheres");
  EXPECT_EQ(std::stoi(large) + std::stoi(dolphin), 12);
  EXPECT_EQ(valueOf(both.out, "total.spheres"), "12");
  EXPECT_GT(std::stoi(dolphin), std::stoi(large));  // 2.5 m against 0.1 m
  EXPECT_NE(readFile(folder / "r.csv").find("dolphin.gap_max,"), std::string::npos);
  const ProgramResult alone =
      runProgram(command({"build", folder / "dolphin.obj", "-o", folder / "d.xml", "--spheres", dolphin}, few));
  ASSERT_EQ(alone.exitCode, 0) << alone.err;
  EXPECT_EQ(readFile(folder / "d.xml"), readFile(folder / "models/dolphin.model.xml"));
  expectRefusal(
      runProgram({"build", folder / "large.obj", folder / "dolphin.obj", "-o", folder / "none", "--spheres", "1"}), 1,
      {"1 spheres", "2 bodies"});
  EXPECT_FALSE(std::filesystem::exists(folder / "none"));
}

TEST(Program, TheRecordedSceneRuns) {
  const ProgramResult r = runProgram(
      {"replay", std::string(MEDULLA_SOURCE_DIR) + "/scenes/recorded/gallbladder.xml", "--set", "clock.duration=6.2"});
  ASSERT_EQ(r.exitCode, 0) << r.err;
  EXPECT_GT(std::stod(valueOf(r.out, "force_max")), 0.1);
}

TEST(Program, RepairsAreToldInOneLine) {
  const TemporaryFolder folder;
  const std::string mesh = readFile(std::string(MEDULLA_SOURCE_DIR) + "/assets/gallbladder/gallbladder.obj");
  const std::size_t lastFace = mesh.rfind("\nf ");
  folder.write("holed.obj", mesh.substr(0, lastFace + 1) + "v 0 0 0\n");
  const ProgramResult r =
      runProgram({"build", folder / "holed.obj", "-o", folder / "m.xml", "--spheres", "2", "--render-levels", "0"});
  ASSERT_EQ(r.exitCode, 0) << r.err;
  // Progress may follow, on a machine that is slow enough for it.
  EXPECT_EQ(r.err.find("mesh repair"), r.err.rfind("mesh repair")) << r.err;
  EXPECT_NE(r.err.find("holed.obj: mesh repair: dropped 1 unused vertex; filled a hole"), std::string::npos) << r.err;
}

TEST(Program, HelpAndVersion) {
  EXPECT_EQ(runProgram({"--help"}).exitCode, 0);
  EXPECT_NE(runProgram({"--help"}).out.find("render"), std::string::npos);
  for (const char* verb :
       {"render", "replay", "build", "new", "check", "info", "golden", "compare", "plot", "chart", "stability"})
    EXPECT_EQ(runProgram({verb, "--help"}).exitCode, 0);
  const ProgramResult version = runProgram({"--version"});
  for (const char* name : {"medulla", "compiler", "embree", "renderer"})
    EXPECT_NE(valueOf(version.out, name), "") << name;
}

TEST(ProgramRefuses, WrongUsageWithCodeTwo) {
  expectRefusal(runProgram({"replay"}), 2, {"SCENE"});
  expectRefusal(runProgram({"rneder", kScene}), 2, {"rneder", "did you mean \"render\"?"});
  expectRefusal(runProgram({"new", "egg.obj", "--sphere", "9"}), 2, {"no option --sphere", "--spheres", "new --help"});
  expectRefusal(runProgram({"replay", kScene, "--log-rate", "tick"}), 2, {"--log-rate", "--log"});
  expectRefusal(runProgram({"render", kScene, "--size", "10x"}), 2, {"--size"});
  expectRefusal(runProgram({"render", kScene, "--view", "skin"}), 2, {"skin"});
  expectRefusal(runProgram({"render", kScene, "--view", "tissue,skin"}), 2, {"skin"});
  expectRefusal(runProgram({"render", kScene, "--show", "proxy,sphere"}), 2, {"did you mean \"spheres\"?"});
  expectRefusal(runProgram({"render", kScene, "--show", "spheres"}), 2, {"--view model"});
  expectRefusal(runProgram({"replay", kScene, "--set", "nonsense"}), 2, {"--set"});
  expectRefusal(runProgram({"replay", kScene, "--surface-at", "soon", "/tmp/x.obj"}), 2, {"soon"});
  expectRefusal(runProgram({"replay", kScene, "--surface-at", "end", "/tmp/x.stl"}), 2, {".obj"});
  expectRefusal(runProgram({"replay", kScene, "--record", "/tmp/x.csv", "--record", "/tmp/y.csv"}), 2,
                {"--record", "one file per tool"});
  expectRefusal(runProgram({"render", kScene, "-o=a.mp4"}), 2, {"-o=a.mp4: expected -o a.mp4"});
  expectRefusal(runProgram({"replay", kScene, "--record", "=r.csv"}), 2, {"a name of the scene before the ="});
  for (const char* embree : {"isa=mmx", "threads=0", "threads=two", "avx2", "isa=sse2,,"})
    expectRefusal(runProgram({"replay", kScene, "--embree", embree}), 2, {"--embree", "avx2"});
}

TEST(ProgramRefuses, BadScenes) {
  const TemporaryFolder folder;
  expectRefusal(runProgram({"replay", folder / "none.xml"}), 1, {"none.xml"});
  expectRefusal(runProgram({"replay", folder.path()}), 1, {folder.path()});
  folder.write("broken.xml", "<scene name=\"x\">\n<clock servo=\"1200\"\n</scene>\n");
  expectRefusal(runProgram({"replay", folder / "broken.xml"}), 1, {"broken.xml:"});
  expectRefusal(runProgram({"replay", kScene, "--set", "body.gallbladder.model=none.xml"}), 1,
                {"none.xml", "gallbladder"});
  expectRefusal(runProgram({"replay", kScene, "--set", "body.gallbladder.look=plastic"}), 1, {"plastic"});
}

TEST(ProgramRefuses, BadTrajectories) {
  const TemporaryFolder folder;
  const std::string header = "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n";
  folder.write("nan.csv", header + "0,0,0,0,1,0,0,0,0\n1,nan,0,0,1,0,0,0,0\n");
  folder.write("falling.csv", header + "0,0,0,0,1,0,0,0,0\n1,0,0,0,1,0,0,0,0\n0.5,0,0,0,1,0,0,0,0\n");
  folder.write("missing.csv", "t[s],x[m],y[m],qw,qx,qy,qz,grip\n0,0,0,1,0,0,0,0\n");
  expectRefusal(runProgram({"replay", kScene, "--trajectory", folder / "nan.csv"}), 1, {"nan.csv:3"});
  expectRefusal(runProgram({"replay", kScene, "--trajectory", folder / "falling.csv"}), 1, {"falling.csv:4"});
  expectRefusal(runProgram({"replay", kScene, "--trajectory", folder / "missing.csv"}), 1, {"missing.csv:1", "z[m]"});
  expectRefusal(runProgram({"replay", kScene, "--trajectory", folder / "none.csv"}), 1, {"none.csv"});
  expectRefusal(runProgram({"replay", kScene, "--trajectory", "hook=" + folder / "nan.csv"}), 1, {"hook"});
  folder.write("unit.xml", "<recording file='r.txt' map='sofa'><units length='meter'/></recording>");
  folder.write("short.xml", "<recording file='r.csv' map='jigsaws' part='slave_left'/>");
  folder.write("r.csv", "1 2 3\n");
  expectRefusal(runProgram({"replay", kScene, "--trajectory", folder / "unit.xml"}), 1,
                {"unit.xml:1", "expected one of m, cm"});
  expectRefusal(runProgram({"check", kScene, "--trajectory", folder / "short.xml"}), 1, {"r.csv:1", "76"});
  expectRefusal(runProgram({"replay", kScene, "--trajectory", folder / "short.xml", "--log", folder / "r.csv"}), 1,
                {"r.csv:1"});
}

TEST(ProgramRefuses, OutputsThatCannotBeWritten) {
  const TemporaryFolder folder;
  folder.write("file", "x");
  expectRefusal(runProgram(command({"render", kScene, "-o", folder / "file/video.mp4"})), 1, {"file"});
  expectRefusal(runProgram(command({"render", kScene, "-o", folder / "file/frames"})), 1, {"file/frames"});
  expectRefusal(runProgram(command({"replay", kScene, "--log", folder / "file/log.csv"})), 1, {"file"});
  expectRefusal(runProgram(command({"replay", kScene, "--record", folder / "file/r.csv"})), 1, {"file"});
  const std::string mesh = std::string(MEDULLA_SOURCE_DIR) + "/assets/gallbladder/gallbladder.obj";
  expectRefusal(runProgram({"build", mesh, "-o", folder / "file/m.xml"}), 1, {"file"});
  EXPECT_EQ(folder.contents(), std::vector<std::string>{"file"});
}

TEST(ProgramRefuses, OneFileForTwoPurposes) {
  const TemporaryFolder folder;
  const std::string csv = folder / "x.csv", video = folder / "v.mp4";
  expectRefusal(runProgram(command({"replay", kScene, "--log", csv, "--frame-times", csv})), 1, {"x.csv", "two"});
  expectRefusal(runProgram(command({"render", kScene, "-o", video, "-o", video})), 1, {"v.mp4", "two"});
  expectRefusal(runProgram(command({"replay", kScene, "--log", csv, "--record", csv})), 1, {"x.csv", "two"});
  folder.write("r.xml", "<recording file='r.csv'><columns rate='30' position='1 2 3'/></recording>");
  folder.write("r.csv", "0,0,0.5\n");
  expectRefusal(runProgram(command({"replay", kScene, "--trajectory", folder / "r.xml", "--record", folder / "r.csv"})),
                1, {"r.csv", "input"});
  folder.write("scene.xml", readFile(kScene));
  folder.write("m.obj", readFile(std::string(MEDULLA_SOURCE_DIR) + "/assets/gallbladder/gallbladder.obj"));
  expectRefusal(runProgram({"build", folder / "scene.xml", "-o", folder / "scene.xml"}), 1, {"scene.xml", "input"});
  EXPECT_EQ(folder.contents().size(), 4u);
}

TEST(ProgramRefuses, ASceneThatIsMissingBeforeAnyFilm) {
  const TemporaryFolder folder;
  expectRefusal(runProgram({"render", kScene, folder / "none.xml", "-o", folder / "{scene}.gif", "--frames", "0:1"}), 1,
                {"none.xml"});
  EXPECT_TRUE(folder.contents().empty());
}

TEST(ProgramRefuses, NumbersThatAreNone) {
  expectRefusal(runProgram(command({"render", kScene, "--fps", "nan"})), 2, {"--fps"});
  expectRefusal(runProgram(command({"render", kScene, "--frames", "0:99999999999"})), 2, {"--frames"});
  expectRefusal(runProgram({"replay", kScene, "--surface-at", "nan", "/tmp/x.obj"}), 2, {"--surface-at"});
  expectRefusal(runProgram({"replay", kScene, "--set", "tissue.bile_sac.young=1e20"}), 1, {"substep"});
}

TEST(Program, PicturesMoveIntoTheirFolderWhenAllAreThere) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "frames");
  folder.write("frames/00000.png", "earlier");
  const ProgramResult failed = runProgram({"render", kScene, "-o", folder / "frames", "--size", "64x48", "--set",
                                           "dynamics.substeps=1", "--set", "tissue.bile_sac.young=1e8"});
  EXPECT_EQ(failed.exitCode, 1);
  EXPECT_EQ(readFile(folder / "frames/00000.png"), "earlier");
  EXPECT_EQ(folder.contents().size(), 1u);
  const ProgramResult done = runProgram(command({"render", kScene, "-o", folder / "frames", "--size", "64x48"}));
  EXPECT_EQ(done.exitCode, 0) << done.err;
  EXPECT_NE(readFile(folder / "frames/00000.png"), "earlier");
  EXPECT_EQ(folder.contents().size(), 1u);
}

TEST(ProgramRefuses, AStateThatStopsBeingFinite) {
  const TemporaryFolder folder;
  folder.write("log.csv", "earlier\n");
  const ProgramResult r = runProgram({"replay", kScene, "--set", "dynamics.substeps=1", "--set",
                                      "tissue.bile_sac.young=1e8", "--log", folder / "log.csv"});
  expectRefusal(r, 1, {"gallbladder", "finite"});
  EXPECT_EQ(readFile(folder / "log.csv"), "earlier\n");
  EXPECT_EQ(folder.contents().size(), 1u);
}

TEST(Program, InterruptLeavesNothingHalfWritten) {
  const TemporaryFolder folder;
  folder.write("video.mp4", "earlier");
  ProgramOptions options;
  options.interruptWhen = [&] { return std::filesystem::exists(folder / "frames/0-6000.part/00002.png"); };
  const ProgramResult r = runProgram({"render", kScene, "-o", folder / "video.mp4", "-o", folder / "frames", "--log",
                                      folder / "log.csv", "--set", "clock.duration=200", "--size", "64x48"},
                                     options);
  EXPECT_EQ(r.exitCode, 130) << r.err;
  EXPECT_EQ(readFile(folder / "video.mp4"), "earlier");
  EXPECT_EQ(folder.contents(), std::vector<std::string>{"video.mp4"});
}

// A GIF is encoded once its last picture is drawn, which takes as long as a film's drawing.
TEST(Program, InterruptEndsAFilmThatIsBeingFinished) {
  const TemporaryFolder folder;
  ProgramOptions options;
  options.interruptWhen = [&] {  // nothing is written before
    for (const std::string& entry : folder.contents())
      if (entry.starts_with("film.gif.") && !readFile(folder / entry).empty()) return true;
    return false;
  };
  const ProgramResult r = runProgram({"render", kScene, "-o", folder / "film.gif", "--set", "clock.duration=3", "--set",
                                      "output.golden=1", "--size", "640x480", "--quality", "draft"},
                                     options);
  EXPECT_EQ(r.exitCode, 130) << r.err;
  EXPECT_TRUE(folder.contents().empty());
}

}  // namespace medulla
