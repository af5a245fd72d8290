#include <gtest/gtest.h>

#include <sstream>

#include "app/simulation.h"
#include "physics/dynamics/rest_modes.h"
#include "physics/model/mass_properties.h"
#include "tests/program_run.h"
#include "tests/temporary_folder.h"

// `medulla info`: each kind of file, told by its ending or by its root element.
namespace medulla {

static const std::string kSource = std::string(MEDULLA_SOURCE_DIR) + "/";

TEST(Info, TellsOfModelsAndScenes) {
  const std::string model = kSource + "assets/gallbladder/gallbladder.model.xml";
  const ProgramResult ofModel = runProgram({"info", model});
  ASSERT_EQ(ofModel.exitCode, 0) << ofModel.err;
  EXPECT_EQ(valueOf(ofModel.out, "kind"), "model");
  EXPECT_EQ(valueOf(ofModel.out, "spheres"), "7");
  EXPECT_EQ(valueOf(ofModel.out, "triangles"), "466");
  EXPECT_EQ(valueOf(ofModel.out, "mesh_hash").size(), 16u);
  for (const char* name : {"settings", "links", "nodes", "volume", "extents", "gap_max", "cover", "mass_at_1000_kg/m3"})
    EXPECT_NE(valueOf(ofModel.out, name), "") << name;
  const ProgramResult ofScene = runProgram({"info", kSource + "scenes/gallbladder.xml"});
  EXPECT_NE(ofScene.out.find("natural_frequencies "), std::string::npos) << ofScene.out;
  ASSERT_EQ(ofScene.exitCode, 0) << ofScene.err;
  EXPECT_EQ(valueOf(ofScene.out, "kind"), "scene");
  EXPECT_EQ(valueOf(ofScene.out, "body.gallbladder.spheres"), "7");
  for (const char* name : {"duration", "servo", "dynamics", "substep", "bodies", "statics", "tools"})
    EXPECT_NE(valueOf(ofScene.out, name), "") << name;
  const TemporaryFolder folder;
  folder.write("x.xml", "<other/>\n");
  expectRefusal(runProgram({"info", folder / "x.xml"}), 1, {"x.xml:1", "scene"});
  expectRefusal(runProgram({"info", folder / "none.xml"}), 1, {"none.xml"});
}

// Who chooses between the integrators asks for it before.
TEST(Info, WhatExplicitStepsCouldTakeDoesNotDependOnTheIntegrator) {
  const TemporaryFolder folder;
  const auto stable = [&](const std::string& dynamics) {
    folder.write("x.xml",
                 "<scene name=\"x\"><clock duration=\"1\"/><dynamics " + dynamics +
                     "/><tissue name=\"t\" young=\"9e3\"/><body name=\"b\" tissue=\"t\" look=\"liver\" model=\"" +
                     kSource +
                     "assets/gallbladder/gallbladder.model.xml\"><fix spheres=\"1\"/></body>"
                     "<camera position=\"0 0 1\" target=\"0 0 0\"/></scene>");
    const ProgramResult r = runProgram({"info", folder / "x.xml"});
    EXPECT_EQ(r.exitCode, 0) << r.err;
    return valueOf(r.out, "stable_substep");
  };
  const std::string expected = stable("integrator=\"explicit\"");
  EXPECT_GT(std::stod(expected), 1e-4);
  EXPECT_EQ(stable("integrator=\"implicit\""), expected);
  EXPECT_EQ(stable("integrator=\"implicit\" order=\"2\""), expected);
}

TEST(Info, TellsOfTrajectoriesAndRecordings) {
  const std::string scenes = kSource + "scenes/";
  const ProgramResult recording = runProgram({"info", scenes + "recorded/hand.xml"}),
                      trajectory = runProgram({"info", scenes + "gallbladder.csv"});
  EXPECT_EQ(valueOf(recording.out, "kind"), "trajectory") << recording.err;
  EXPECT_EQ(valueOf(recording.out, "samples"), "292");
  EXPECT_EQ(valueOf(recording.out, "gap_max"), "0.034 s");
  for (const ProgramResult* r : {&recording, &trajectory}) EXPECT_EQ(valueOf(r->out, "grip_closings"), "2") << r->err;
  EXPECT_EQ(valueOf(trajectory.out, "to"), "12 s");
  const TemporaryFolder folder;
  folder.write("bad.csv", "t,x\n");
  expectRefusal(runProgram({"info", folder / "bad.csv"}), 1, {"bad.csv:1", "t[s]"});
  expectRefusal(runProgram({"info", kSource + "docs/force.png"}), 1, {"force.png: is of no kind", "a mesh, a model"});
}

TEST(Info, TheSpeedOfAMotionIsItsWayOverItsTime) {
  const TemporaryFolder folder;
  folder.write("a.csv",
               "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n0,0.1,0.2,0.3,1,0,0,0,0\n0.25,0.13,0.24,0.3,1,0,0,0,0\n");
  const ProgramResult r = runProgram({"info", folder / "a.csv"});
  ASSERT_EQ(r.exitCode, 0) << r.err;
  EXPECT_NEAR(std::stod(valueOf(r.out, "speed_max")), 0.2, 1e-6);
  EXPECT_TRUE(valueOf(r.out, "speed_max").ends_with(" m/s"));
  EXPECT_EQ(valueOf(r.out, "gap_max"), "0.25 s");
}

TEST(Info, AGripThatIsClosedFromTheStartHasClosedOnce) {
  const TemporaryFolder folder;
  const std::string header = "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n";
  const auto closings = [&](const std::string& rows) {
    folder.write("a.csv", header + rows);
    return valueOf(runProgram({"info", folder / "a.csv"}).out, "grip_closings");
  };
  EXPECT_EQ(closings("0,0,0,0,1,0,0,0,1\n1,0,0,0,1,0,0,0,1\n"), "1");
  EXPECT_EQ(closings("0,0,0,0,1,0,0,0,1\n1,0,0,0,1,0,0,0,0\n2,0,0,0,1,0,0,0,1\n"), "2");
}

TEST(Info, MassAndFrequenciesOfABodyAreThoseOfItsTissue) {
  const std::string scene = kSource + "scenes/gallbladder.xml";
  const ProgramResult r = runProgram({"info", scene});
  const LoadedScene loaded = loadScene(readScene(scene));
  const SceneBody& body = loaded.scene.bodies[0];
  const double volume = massProperties({body.model->restNodes, body.model->triangles}).volume;
  EXPECT_NEAR(std::stod(valueOf(r.out, "body.gallbladder.mass")), volume * body.tissue.density, 1e-4 * volume * 1e3);
  std::istringstream list(valueOf(r.out, "body.gallbladder.natural_frequencies"));
  const std::vector<double> expected = naturalFrequencies(body, bodyMechanics(body), 5);
  ASSERT_EQ(expected.size(), 5u);
  for (const double frequency : expected) {
    double told = 0;
    ASSERT_TRUE(list >> told) << list.str();
    EXPECT_NEAR(told, frequency, 1e-3 * frequency);
  }
  std::string unit;
  list >> unit;
  EXPECT_EQ(unit, "Hz");
}

TEST(Info, TellsOfWhatRunsLeave) {
  const TemporaryFolder folder;
  const ProgramResult run =
      runProgram({"replay", kSource + "scenes/gallbladder.xml", "--set", "clock.duration=0.2", "--log",
                  folder / "run.csv", "--frame-times", folder / "times.csv", "--cache", folder / "run.cache"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const ProgramResult log = runProgram({"info", folder / "run.csv"}),
                      cache = runProgram({"info", folder / "run.cache"});
  EXPECT_EQ(valueOf(log.out, "kind"), "log") << log.err;
  EXPECT_EQ(valueOf(log.out, "rows"), "10");
  EXPECT_EQ(valueOf(log.out, "to"), "0.2 s");
  const ProgramResult times = runProgram({"info", folder / "times.csv"});
  EXPECT_EQ(valueOf(times.out, "kind"), "frame_times") << times.err;
  EXPECT_EQ(valueOf(times.out, "rows"), "10");
  EXPECT_EQ(valueOf(cache.out, "kind"), "cache") << cache.err;
  EXPECT_EQ(valueOf(cache.out, "pictures"), "6");
  EXPECT_EQ(valueOf(cache.out, "tools"), "grasper");
  EXPECT_EQ(valueOf(cache.out, "hash"), valueOf(run.out, "hash"));
}

TEST(Info, TellsOfMeshesWhetherAModelCanBeBuilt) {
  const std::string mesh = kSource + "assets/gallbladder/gallbladder.obj";
  const ProgramResult whole = runProgram({"info", mesh});
  ASSERT_EQ(whole.exitCode, 0) << whole.err;
  EXPECT_EQ(whole.err, "");
  EXPECT_EQ(valueOf(whole.out, "kind"), "mesh");
  EXPECT_EQ(valueOf(whole.out, "input_triangles"), "466");
  EXPECT_EQ(valueOf(whole.out, "buildable"), "yes");
  const ProgramResult scaled = runProgram({"info", mesh, "--unit", "cm"});
  EXPECT_NEAR(std::stod(valueOf(scaled.out, "volume")), 1e-6 * std::stod(valueOf(whole.out, "volume")), 1e-15);
  EXPECT_NE(scaled.err.find("is --unit right?"), std::string::npos) << scaled.err;
  const TemporaryFolder folder;
  folder.write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 1\nf 1 2 3\n");
  const ProgramResult open = runProgram({"info", folder / "open.obj"});
  EXPECT_EQ(open.exitCode, 0);
  EXPECT_EQ(valueOf(open.out, "buildable"), "no");
  EXPECT_EQ(valueOf(open.out, "upper"), "1 2 1 m");
  EXPECT_NE(open.err.find("no model can be built"), std::string::npos) << open.err;
  expectRefusal(runProgram({"info", kSource + "scenes/gallbladder.csv", "--unit", "mm"}), 2, {"--unit", "a mesh"});
  const std::string corners = "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\n", sides = "f 1 2 4\nf 2 3 4\nf 1 4 3\n";
  folder.write("even.obj", corners + sides + "f 1 3 2\n");
  EXPECT_EQ(runProgram({"info", folder / "even.obj"}).err, "");
  folder.write("sliver.obj", corners + "v .05 .001 0\n" + sides + "f 1 3 5\nf 3 2 5\nf 2 1 5\n");
  const ProgramResult sliver = runProgram({"info", folder / "sliver.obj"});
  EXPECT_NE(sliver.err.find("sliver.obj: note: 1 of 6 triangles are slivers"), std::string::npos) << sliver.err;
  folder.write("bad.obj", "v 0 0\n");
  expectRefusal(runProgram({"info", folder / "bad.obj"}), 1, {"bad.obj:1"});
}

}  // namespace medulla
