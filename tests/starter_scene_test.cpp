#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "app/files/log_table.h"
#include "app/scene.h"
#include "tests/program_run.h"
#include "tests/temporary_folder.h"
#include "tests/test_shapes.h"

// medulla new and medulla check: from somebody's mesh to a scene that runs.
namespace medulla {

static const std::string kMesh = std::string(MEDULLA_SOURCE_DIR) + "/assets/gallbladder/gallbladder.obj";

static std::string objText(const TriangleMesh& mesh) {
  std::string obj;
  for (const Eigen::Vector3d& x : mesh.vertices) obj += fmt::format("v {} {} {}\n", x.x(), x.y(), x.z());
  for (const auto& [a, b, c] : mesh.triangles) obj += fmt::format("f {} {} {}\n", a + 1, b + 1, c + 1);
  return obj;
}

static ProgramResult makeStarter(const TemporaryFolder& folder, const std::string& mesh = kMesh) {
  return runProgram({"new", mesh, "-o", folder / "mine", "--spheres", "5"});
}

TEST(StarterScene, IsCheckedAndItsToolPressesAndHoldsTheBody) {
  const TemporaryFolder folder;
  const ProgramResult made = makeStarter(folder);
  ASSERT_EQ(made.exitCode, 0) << made.err;
  const std::string scene = folder / "mine/gallbladder.xml";
  EXPECT_NE(made.out.find("scene " + scene), std::string::npos) << made.out;
  const std::string text = readFile(scene);  // editors refuse two hyphens within a comment
  for (std::size_t at = text.find("<!--"); at != std::string::npos; at = text.find("<!--", at + 4))
    EXPECT_EQ(text.find("--", at + 4), text.find("-->", at + 4));
  const ProgramResult checked = runProgram({"check", scene});
  EXPECT_EQ(checked.exitCode, 0) << checked.err;
  EXPECT_EQ(checked.out, "valid yes\n");

  ASSERT_EQ(runProgram({"replay", scene, "--log", folder / "log.csv"}).exitCode, 0);
  const std::string log = readFile(folder / "log.csv");
  const std::string header = log.substr(0, log.find('\n'));
  const auto column = [&](const std::string& name) {
    return std::count(header.begin(), header.begin() + static_cast<long>(header.find(name)), ',');
  };
  int pressing = 0, holding = 0;
  for (std::size_t at = log.find('\n') + 1; at < log.size(); at = log.find('\n', at) + 1) {
    const std::string row = log.substr(at, log.find('\n', at) - at);
    const auto field = [&](long k) {
      std::size_t start = 0;
      for (; k > 0; --k) start = row.find(',', start) + 1;
      return row.substr(start, row.find(',', start) - start);
    };
    pressing += field(column("grasper.contact")) == "1" && field(column("grasper.held")) == "0";
    holding += field(column("grasper.held")) != "0";
  }
  EXPECT_GT(pressing, 25);  // of 50 per second
  EXPECT_GT(holding, 100);
}

// Hung on one sphere or on a thin tail, the body swung out of the tool's way at the first touch; nothing was held.
TEST(StarterScene, ItsToolHoldsBodiesOfFewSpheres) {
  const TemporaryFolder folder;
  for (const auto& [organ, spheres] :
       {std::pair("dolphin", "2"), {"dolphin", "3"}, {"dolphin", "7"}, {"dolphin", "10"}, {"stomach", "5"}}) {
    const std::string mesh = fmt::format("{0}/assets/{1}/{1}.obj", MEDULLA_SOURCE_DIR, organ);
    const std::string made = folder / (std::string(organ) + spheres), log = folder / "log.csv";
    ASSERT_EQ(runProgram({"new", mesh, "-o", made, "--spheres", spheres}).exitCode, 0);
    const ProgramResult run = runProgram({"replay", fmt::format("{}/{}.xml", made, organ), "--log", log});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(complaints(run).size(), 0) << organ << ", " << spheres << " spheres: " << run.err;
    const LogTable table = readLog(log);
    const std::size_t held = columnOf(table, "grasper.held");
    EXPECT_GT(std::count_if(table.value.begin(), table.value.end(), [&](const auto& row) { return row[held] != 0; }),
              100)
        << organ << ", " << spheres << " spheres";
  }
}

// The tool is twenty times as stiff as a patch of the tissue: what it pushes gives way and a neighbour stands out, and
// where the push jumps from one to the other it rattled by 4.9 N about 12.5 N.
TEST(StarterScene, AToolThatHoldsStillFeelsAForceThatDoes) {
  const TemporaryFolder folder;
  const std::string mesh = std::string(MEDULLA_SOURCE_DIR) + "/assets/liver/liver.obj", log = folder / "log.csv";
  ASSERT_EQ(runProgram({"new", mesh, "-o", folder / "mine", "--spheres", "25"}).exitCode, 0);
  const ProgramResult run = runProgram({"replay", folder / "mine/liver.xml", "--set", "clock.duration=2.4", "--set",
                                        "tool.grasper.stiffness=2540", "--log", log, "--log-rate", "tick"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const LogTable table = readLog(log);
  double count = 0, sum = 0, squares = 0;
  for (const std::vector<double>& row : table.value) {
    if (row[0] < 2) continue;  // pressed since 1.8 s
    double square = 0;
    for (const char axis : {'x', 'y', 'z'})
      square += std::pow(row[columnOf(table, std::string("grasper.force.") + axis)], 2);
    ++count;
    sum += std::sqrt(square);
    squares += square;
  }
  const double mean = sum / count;
  EXPECT_GT(mean, 1);
  EXPECT_LT(std::sqrt(squares / count - mean * mean), 0.15 * mean);
}

// Its nodes are corners alone, off which a tool slides, out of the picture.
TEST(StarterScene, ABoxOfTwelveTrianglesIsTouchedOnAFace) {
  const TemporaryFolder folder;
  folder.write("box.obj",
               "v -1 -1 -1\nv 1 -1 -1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1\n"
               "f 1 3 4\nf 1 4 2\nf 5 6 8\nf 5 8 7\nf 1 2 6\nf 1 6 5\nf 3 7 8\nf 3 8 4\nf 1 5 7\nf 1 7 3\nf 2 4 "
               "8\nf 2 8 6\n");
  ASSERT_EQ(makeStarter(folder, folder / "box.obj").exitCode, 0);
  const std::string keys = readFile(folder / "mine/box.csv");
  const std::size_t touch = keys.find("\n3.8,");
  ASSERT_NE(touch, std::string::npos);
  double x = 0, y = 0, z = 0;
  ASSERT_EQ(std::sscanf(keys.c_str() + touch, " 3.8,%lf,%lf,%lf", &x, &y, &z), 3);
  EXPECT_LT(std::max(std::abs(x), std::abs(y)), 0.5);
  EXPECT_NEAR(z, 1, 1e-6);
}

// A tool made for a tube's length would close far behind it.
TEST(StarterScene, TheToolIsNoThickerThanAThinBody) {
  const TemporaryFolder folder;
  folder.write("tube.obj", objText(cylinderMesh(1, 0.005, 12, 200)));
  ASSERT_EQ(runProgram({"new", folder / "tube.obj", "-o", folder / "mine"}).exitCode, 0);
  const Scene scene = readScene(folder / "mine/tube.xml");
  EXPECT_LT(scene.tools[0].settings.radius, 0.005);
  EXPECT_LT(scene.tools[0].settings.gripRadius, 0.01);
}

// From its end a long body hides behind the tool.
TEST(StarterScene, ABodyIsSeenAcrossItsLongestSide) {
  const TemporaryFolder folder;
  for (const int axis : {0, 2}) {
    TriangleMesh mesh = cylinderMesh(0.2, 0.02, 12, 20);  // along x
    if (axis == 2)
      for (Eigen::Vector3d& x : mesh.vertices) x = {x.y(), x.z(), x.x()};
    const std::string name = fmt::format("bar{}", axis);
    folder.write(name + ".obj", objText(mesh));
    ASSERT_EQ(runProgram({"new", folder / (name + ".obj"), "-o", folder / name}).exitCode, 0);
    const Scene scene = readScene(folder / fmt::format("{0}/{0}.xml", name));
    const Eigen::Vector3d view = scene.camera[0].position - scene.camera[0].target;
    EXPECT_GT(view[axis == 0 ? 2 : 0], 0.99 * view.norm());
  }
}

TEST(StarterScene, ThinSheetsRunInImplicitSteps) {
  const TemporaryFolder folder;
  for (const double thickness : {0.02, 0.0008}) {
    const std::string name = thickness < 0.01 ? "sheet" : "lens";
    folder.write(name + ".obj", objText(ellipsoidMesh(4, {0.05, 0.035, thickness})));
    const ProgramResult made = runProgram({"new", folder / (name + ".obj"), "-o", folder / name, "--spheres", "14"});
    ASSERT_EQ(made.exitCode, 0) << made.err;
    const std::string scene = folder / fmt::format("{0}/{0}.xml", name);
    EXPECT_EQ(readFile(scene).find("integrator=\"implicit\"") != std::string::npos, thickness < 0.01) << name;
    EXPECT_EQ(complaints(runProgram({"check", scene})), std::vector<std::string>{}) << name;
  }
}

TEST(StarterScene, HarmsNothingThatIsThere) {
  const TemporaryFolder folder;
  ASSERT_EQ(makeStarter(folder).exitCode, 0);
  const std::string before = readFile(folder / "mine/gallbladder.csv");
  const ProgramResult again = makeStarter(folder);
  EXPECT_EQ(again.exitCode, 1);
  EXPECT_EQ(again.out, "");
  EXPECT_NE(again.err.find("gallbladder.xml: exists already; nothing was written"), std::string::npos) << again.err;
  EXPECT_EQ(readFile(folder / "mine/gallbladder.csv"), before);
}

TEST(StarterScene, LeavesNothingBehindWhereTheMeshIsRefused) {
  const TemporaryFolder folder;
  folder.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const ProgramResult made = makeStarter(folder, folder / "flat.obj");
  EXPECT_EQ(made.exitCode, 1);
  EXPECT_EQ(complaints(made).size(), 1) << made.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "mine"));
}

static std::string boxObj(double x, double y, double z, double at) {
  std::string out;
  for (int v = 0; v < 8; ++v) out += fmt::format("v {} {} {}\n", at + (v & 1 ? x : 0), v & 2 ? y : 0, v & 4 ? z : 0);
  for (const char* face : {"1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"})
    out += fmt::format("f {}\n", face);
  return out;
}

TEST(StarterScene, WhatNoToolReachesIsRefused) {
  const TemporaryFolder folder;
  folder.write("far.obj", boxObj(0.1, 0.06, 0.05, 1000));
  const ProgramResult made = makeStarter(folder, folder / "far.obj");
  EXPECT_EQ(made.exitCode, 1);
  ASSERT_EQ(complaints(made).size(), 1) << made.err;
  EXPECT_NE(made.err.find("reaches 1e+03 m from the origin"), std::string::npos) << made.err;
  EXPECT_EQ(made.out, "");
  EXPECT_FALSE(std::filesystem::exists(folder / "mine"));
}

TEST(StarterScene, SpheresThatDoNotFillTheBodyAreNoted) {
  const TemporaryFolder folder;
  folder.write("slab.obj", boxObj(0.15, 0.15, 0.01, 0));
  const ProgramResult made = makeStarter(folder, folder / "slab.obj");
  EXPECT_EQ(made.exitCode, 0) << made.err;
  EXPECT_NE(made.err.find("note: the spheres cover"), std::string::npos) << made.err;
}

// A body and a tool of one name are refused.
TEST(StarterScene, IsCheckedWhateverTheMeshIsCalled) {
  const TemporaryFolder folder;
  for (const char* name : {"grasper", "tool", "my organ"}) {
    const std::string mesh = folder / (std::string(name) + ".obj");
    std::filesystem::copy_file(kMesh, mesh);
    const ProgramResult made = makeStarter(folder, mesh);
    ASSERT_EQ(made.exitCode, 0) << made.err;
    const std::string scene = made.out.substr(made.out.find("scene ") + 6);
    EXPECT_EQ(runProgram({"check", scene.substr(0, scene.find('\n'))}).out, "valid yes\n") << name;
  }
  std::filesystem::copy_file(kMesh, folder / "\u0441\u0435\u0440\u0434\u0446\u0435.obj");
  std::filesystem::copy_file(kMesh, folder / "tube n\u00e0 m\u00eb.obj");
  EXPECT_TRUE(
      makeStarter(folder, folder / "\u0441\u0435\u0440\u0434\u0446\u0435.obj").out.ends_with("mine/organ.xml\n"));
  EXPECT_TRUE(makeStarter(folder, folder / "tube n\u00e0 m\u00eb.obj").out.ends_with("mine/tube_n_m.xml\n"));
  const std::string hyphens = "left--" + std::string(230, 'o');
  std::filesystem::copy_file(kMesh, folder / (hyphens + ".obj"));
  const std::string cut = "left-" + std::string(195, 'o');
  EXPECT_TRUE(makeStarter(folder, folder / (hyphens + ".obj")).out.ends_with("mine/" + cut + ".xml\n"));
  EXPECT_EQ(runProgram({"check", folder / ("mine/" + cut + ".xml")}).out, "valid yes\n");
  const std::string model = readFile(folder / "mine/my_organ.model.xml");
  EXPECT_NE(model.find("settings=\"medulla build 'my organ.obj' --"), std::string::npos) << model.substr(0, 400);
}

TEST(Check, NamesFileAndLineOfWhatCannotRun) {
  const TemporaryFolder folder;
  ASSERT_EQ(makeStarter(folder).exitCode, 0);
  const std::string scene = folder / "mine/gallbladder.xml";
  const ProgramResult wrong = runProgram({"check", scene, "--set", "body.gallbladder.look=livr"});
  EXPECT_EQ(wrong.exitCode, 1);
  EXPECT_EQ(wrong.out, "");
  EXPECT_EQ(wrong.err.find("medulla: --set body.gallbladder.look: unknown look \"livr\": did you mean \"liver\"?"), 0)
      << wrong.err;
  const ProgramResult none = runProgram({"check", scene, "--set", "body.gallbladder.model=none.xml"});
  EXPECT_EQ(none.err, "medulla: --set body.gallbladder.model: model of body \"gallbladder\" \"" + folder.path() +
                          "/mine/none.xml\" does not exist\n");
  std::filesystem::remove(folder / "mine/gallbladder.csv");
  const ProgramResult missing = runProgram({"check", scene});
  EXPECT_EQ(missing.exitCode, 1);
  EXPECT_NE(missing.err.find("gallbladder.csv\" does not exist"), std::string::npos) << missing.err;
}

}  // namespace medulla
