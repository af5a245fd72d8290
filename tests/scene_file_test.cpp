#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <regex>

#include "app/files/scene_rules.h"
#include "app/files/text_file.h"
#include "tests/complaint.h"
#include "tests/complete_scene.h"

namespace medulla {
namespace {

TEST_F(SceneFile, EveryValueArrives) {
  const Scene s = read(completeScene);
  EXPECT_EQ(s.name, "complete");
  EXPECT_EQ(s.servoRate, 1000);
  EXPECT_EQ(s.dynamicsRate, 40);
  EXPECT_EQ(s.duration, 12);
  EXPECT_EQ(s.dynamics.frameDuration, 1.0 / 40);
  EXPECT_EQ(s.dynamics.settleFrames, 80);
  EXPECT_EQ(s.dynamics.gravity, Eigen::Vector3d(0, 0, -9.5));
  EXPECT_EQ(s.dynamics.ambientDrag, 0.3);
  EXPECT_EQ(s.dynamics.substeps, 16);
  EXPECT_EQ(s.dynamics.contact, ContactMode::swept);
  EXPECT_EQ(s.dynamics.integrator, Integrator::implicit);
  EXPECT_EQ(s.dynamics.order, 2);
  EXPECT_EQ(s.dynamics.sleepAfter, 0.5);
  ASSERT_EQ(s.bodies.size(), 2u);
  const SceneBody& body = s.bodies[0];
  EXPECT_EQ(body.place.line, 9);
  EXPECT_EQ(body.name, "gallbladder");
  EXPECT_EQ(body.modelPath, std::filesystem::path(folder).parent_path().string() + "/assets/gallbladder.model.xml");
  EXPECT_EQ(body.look, "gallbladder");
  EXPECT_EQ(body.tissue.young, 6e3);
  EXPECT_EQ(body.tissue.poisson, 0.4);
  EXPECT_EQ(body.tissue.density, 1030);
  EXPECT_EQ(body.tissue.damping, 0.2);
  EXPECT_EQ(body.tissue.friction, 0.3);
  EXPECT_EQ(body.neighbours, std::vector<int>{1});
  EXPECT_EQ(s.bodies[1].neighbours, std::nullopt);
  EXPECT_EQ(body.surface, SurfaceMode::skin);
  EXPECT_EQ(body.links, LinkModel::springs);
  EXPECT_EQ(body.referencePath, folder + "/fem.txt");
  EXPECT_EQ(body.steered, (std::vector<SteeredLinks>{{{2, 3, 0.5}}}));
  EXPECT_EQ(body.worldFromModel.translation(), Eigen::Vector3d(0.1, 0.2, 0.3));
  // A quarter turn about y, given with three digits: a rotation to the last bit nevertheless.
  EXPECT_NEAR((body.worldFromModel.linear() * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 0, 1e-12);
  ASSERT_EQ(body.fixed.size(), 3u);
  EXPECT_EQ(body.fixed[1].sphere, 1);
  EXPECT_EQ(body.fixed[1].freedom, FixedFreedom::translation);
  EXPECT_EQ(body.fixed[2].sphere, 4);
  EXPECT_EQ(body.fixed[2].freedom, FixedFreedom::all);
  ASSERT_EQ(body.driven.size(), 1u);
  EXPECT_EQ(body.driven[0].sphere, 2);
  EXPECT_EQ(body.driven[0].axis, Eigen::Vector3d(0, 1, 1));
  EXPECT_EQ(body.driven[0].amplitude, 0.1);
  EXPECT_EQ(body.driven[0].frequency, 2);
  EXPECT_EQ(body.driven[0].phase, 0.5);
  EXPECT_EQ(body.driven[0].velocity, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(body.driven[0].freedom, FixedFreedom::all);
  EXPECT_EQ(s.bodies[1].tissue.young, Tissue().young);
  EXPECT_EQ(s.bodies[1].modelPath, folder + "/second.model.xml");
}

TEST_F(SceneFile, EveryValueOfFixesAndLoadsArrives) {
  const Scene s = read(completeScene);
  const std::vector<SceneFix>& fixes = s.bodies[1].fixes;
  ASSERT_EQ(fixes.size(), 4u);
  EXPECT_EQ(fixes[0].nodes.region.box.min(), Eigen::Vector3d(0, 1, 2));
  EXPECT_EQ(fixes[0].nodes.region.box.max(), Eigen::Vector3d(3, 4, 5));
  EXPECT_EQ(fixes[0].freedom, FixedFreedom::all);
  EXPECT_EQ(fixes[1].nodes.region.shape, Region::Shape::ball);
  EXPECT_EQ(fixes[1].nodes.region.centre, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(fixes[1].nodes.region.radius, 0.5);
  EXPECT_EQ(fixes[1].freedom, FixedFreedom::translation);
  EXPECT_EQ(fixes[2].nodes.region.shape, Region::Shape::halfSpace);
  EXPECT_EQ(fixes[2].nodes.region.normal, Eigen::Vector3d(0, 2, 0));
  EXPECT_EQ(fixes[2].nodes.region.distance, 0.5);
  EXPECT_EQ(fixes[2].nodes.verticesPath, "");
  EXPECT_EQ(fixes[3].nodes.verticesPath, folder + "/held.csv");
  const std::vector<SceneLoad>& loads = s.bodies[1].loads;
  ASSERT_EQ(loads.size(), 5u);
  EXPECT_EQ(loads[0].place.line, 16);
  EXPECT_EQ(loads[0].nodes.region.box.max(), Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(loads[0].whole.force, Eigen::Vector3d(0, 0, 1.5));
  EXPECT_EQ(loads[0].whole.from, 0.5);
  EXPECT_EQ(loads[0].whole.to, 2);
  EXPECT_EQ(loads[1].nodes.region.radius, 1);
  EXPECT_EQ(loads[1].whole.from, 0);
  EXPECT_EQ(loads[1].whole.to, 1);
  EXPECT_EQ(loads[2].nodes.region.distance, 3);
  EXPECT_EQ(loads[3].nodes.verticesPath, folder + "/pulled.csv");
  EXPECT_EQ(loads[3].whole.to, 0);
  EXPECT_EQ(loads[3].forcesPath, "");
  EXPECT_EQ(loads[4].forcesPath, folder + "/loads.csv");
  EXPECT_EQ(loads[4].whole.to, 4);
}

TEST_F(SceneFile, EveryValueOfScenerysToolsAndPictureArrives) {
  const Scene s = read(completeScene);
  ASSERT_EQ(s.statics.size(), 4u);
  EXPECT_EQ(s.statics[0].meshPath, "/abs/wall.obj");
  EXPECT_EQ(s.statics[0].look, "wall");
  EXPECT_EQ(s.statics[0].unit, "mm");
  EXPECT_EQ(s.statics[0].shape.worldFromShape.translation(), Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(s.statics[0].shape.friction, 0.4);
  EXPECT_TRUE(s.statics[0].contact);
  EXPECT_EQ(s.statics[1].shape.kind, StaticShape::Kind::plane);
  EXPECT_EQ(s.statics[1].shape.worldFromShape.translation(), Eigen::Vector3d(0, 0, 3));
  EXPECT_NEAR((s.statics[1].shape.worldFromShape.linear().col(1) - Eigen::Vector3d::UnitZ()).norm(), 0, 1e-15);
  EXPECT_TRUE(s.statics[1].contact);
  EXPECT_EQ(s.statics[2].shape.kind, StaticShape::Kind::box);
  EXPECT_EQ(s.statics[2].shape.size, Eigen::Vector3d(1, 2, 3));
  EXPECT_FALSE(s.statics[2].contact);
  EXPECT_EQ(s.statics[3].shape.kind, StaticShape::Kind::sphere);
  EXPECT_EQ(s.statics[3].shape.radius, 4);
  EXPECT_EQ(s.statics[3].look, "");
  ASSERT_EQ(s.tools.size(), 1u);
  EXPECT_EQ(s.tools[0].name, "grasper");
  EXPECT_EQ(s.tools[0].trajectoryPath, folder + "/gallbladder.csv");
  const ToolSettings& t = s.tools[0].settings;
  EXPECT_EQ(t.radius, 0.004);
  EXPECT_EQ(t.stiffness, 300);
  EXPECT_EQ(t.damping, 2);
  EXPECT_EQ(t.staticFriction, 0.4);
  EXPECT_EQ(t.dynamicFriction, 0.1);
  EXPECT_EQ(t.forceMax, 5);
  EXPECT_EQ(t.gripRadius, 0.007);
  EXPECT_EQ(t.gripForceMax, 4);
  // The camera's own pose opens the run; a key takes from it what it leaves out.
  ASSERT_EQ(s.camera.size(), 3u);
  EXPECT_EQ(s.camera[0].time, 0);
  EXPECT_EQ(s.camera[0].position, Eigen::Vector3d(0, 0, 0.2));
  EXPECT_EQ(s.camera[1].time, 4);
  EXPECT_EQ(s.camera[1].position, Eigen::Vector3d(0, 0.1, 0.2));
  EXPECT_EQ(s.camera[1].fovDegrees, 50);
  EXPECT_EQ(s.camera[2].position, Eigen::Vector3d(0, 0, 0.2));
  EXPECT_EQ(s.camera[2].target, Eigen::Vector3d(0.1, 0, 0));
  EXPECT_EQ(s.camera[2].fovDegrees, 40);
  EXPECT_FALSE(s.endoscope);
  EXPECT_EQ(s.lightPosition, Eigen::Vector3d(0.01, 0, 0.01));
  EXPECT_EQ(s.haze, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(s.hazeDistance, 4);
  EXPECT_EQ(s.caustics, 0.5);
  EXPECT_EQ(s.lightIntensity, 1.5);
  EXPECT_EQ(s.lightReferenceDistance, 0.2);
  EXPECT_EQ(s.width, 640);
  EXPECT_EQ(s.height, 480);
  EXPECT_EQ(s.fps, 25);
  EXPECT_EQ(s.goldenTimes, (std::vector<double>{0.5, 3, 7}));
  ASSERT_EQ(s.captions.size(), 2u);
  EXPECT_EQ(s.captions[0].from, 0.5);
  EXPECT_EQ(s.captions[0].to, 2);
  EXPECT_EQ(s.captions[0].text, "pressed & held");
  EXPECT_EQ(s.captions[1].text, "let go");
}

TEST_F(SceneFile, DefaultsStandWhereNothingIsSaid) {
  const Scene s = read(
      "<scene name='small'><clock duration='1'/><tissue name='t'/><body name='b' model='b.xml' tissue='t' "
      "look='liver'/>"
      "<camera position='0 0 1' target='0 0 0'/></scene>");
  EXPECT_EQ(s.servoRate, 1200);
  EXPECT_EQ(s.dynamicsRate, 50);
  EXPECT_EQ(s.dynamics.gravity, Eigen::Vector3d(0, -9.81, 0));
  EXPECT_EQ(s.dynamics.substeps, 0);
  EXPECT_EQ(s.dynamics.contact, ContactMode::balls);
  EXPECT_EQ(s.bodies[0].surface, SurfaceMode::full);
  EXPECT_TRUE(s.bodies[0].worldFromModel.isApprox(Eigen::Isometry3d::Identity(), 0));
  ASSERT_EQ(s.camera.size(), 1u);
  EXPECT_EQ(s.camera[0].fovDegrees, 60);
  EXPECT_TRUE(s.endoscope && !s.haze);
  EXPECT_EQ(s.width, 1280);
  EXPECT_TRUE(s.goldenTimes.empty());
}

TEST_F(SceneFile, ALampBesideTheLens) {
  const Scene s = read(edited("position=\"0.01 0 0.01\"", "offset=\"0.01 0 0.01\""), {{"light.caustics", "0"}});
  EXPECT_FALSE(s.lightPosition);
  EXPECT_EQ(s.lightOffset, Eigen::Vector3d(0.01, 0, 0.01));
}

TEST_F(SceneFile, AKeyAtZeroReplacesTheCamerasOwnPose) {
  const Scene s = read(edited("<key t=\"4\"", "<key t=\"0\""));
  ASSERT_EQ(s.camera.size(), 2u);
  EXPECT_EQ(s.camera[0].time, 0);
  EXPECT_EQ(s.camera[0].position, Eigen::Vector3d(0, 0.1, 0.2));
}

TEST_F(SceneFile, MistakesInTheStructureNameTheLineAndWhatWasExpected) {
  expectComplaints({
      {"position=\"0.1", "positon=\"0.1", R"(x.xml:10: <body> has no attribute "positon"; did you mean "position"?)"},
      {"<light ", "<lihgt ", R"(x.xml:24: <scene> has no child <lihgt>; did you mean "light"?)"},
      {"<fix spheres=\"4\"", "<body spheres=\"4\"",
       R"(x.xml:13: <body> has no child <body>; expected one of fix, drive, load, links, neighbours)"},
      {" duration=\"12\"", "", R"(x.xml:4: <clock> lacks the attribute "duration")"},
      {"<clock servo=\"1000\" dynamics=\"40\" duration=\"12\" settle=\"2\"/>", "", "x.xml:3: <scene> lacks a <clock>"},
      {"<dynamics ", "<dynamics/><dynamics ", "x.xml:5: <scene> has more than 1 <dynamics>"},
      {"young=\"6e3\"", "young=\"6e3\" young=\"7e3\"",
       R"(x.xml:7: broken XML: an attribute is not of the form name="value", or stands twice)"},
      {"<!-- tissues -->", "tissues", R"(x.xml:6: <scene> holds text "tissues", expected none)"},
      {"<!-- tissues -->", "<!ENTITY x>", "x.xml:6: <!...> inside an element is not understood"},
      {"<scene ", "<scone ", "x.xml:3: broken XML: an element is not closed where it was opened"},
      {"</scene>", "</scene><scene/>", "x.xml:26: broken XML: more than one element or text at the top"},
      {"name=\"second\"", "name=\"gallbladder\"",
       R"(x.xml:16: <body> name="gallbladder": another <body> has this name)"},
      {"name=\"liver\"", "name=\"bile_sac\"", R"(x.xml:8: <tissue> name="bile_sac": another <tissue> has this name)"},
      {"name=\"grasper\"", "name=\"second\"",
       R"(x.xml:18: <tool> name="second": a <body> has this name, and columns of logs are named after both)"},
      {"name=\"grasper\"", "name=\"my,tool\"",
       R"(x.xml:18: <tool> name="my,tool": expected letters, digits, _ and - only)"},
      {"tissue=\"bile_sac\"", "tissue=\"bile_sack\"",
       R"(x.xml:9: <body> tissue="bile_sack": no <tissue> of this name; did you mean "bile_sac"?)"},
      {"model=\"second.model.xml\"", "model=\"\"", R"(x.xml:16: <body> model="": is empty)"},
  });
}

TEST_F(SceneFile, NamesAreNoLongerThanFilesCanBeNamedAfter) {
  const auto named = [&](int letters) {
    return edited("name=\"grasper\"", "name=\"" + std::string(letters, 'g') + "\"");
  };
  EXPECT_NO_THROW(read(named(200)));
  EXPECT_NE(complaint(named(201)).find(": expected at most 200 letters"), std::string::npos);
}

// What single precision, or a product of two, would make infinity or nothing of.
TEST_F(SceneFile, NumbersBeyondWhatCanBeDrawnOrSimulatedAreRefused) {
  expectComplaints({
      {"6e3", "1e-160", R"(x.xml:7: <tissue> young="1e-160": expected no number below 1e-100)"},
      {"radius=\"0.004\"", "radius=\"1e-160\"", R"(x.xml:18: <tool> radius="1e-160": expected no number below 1e-100)"},
      {"6e3", "1e300", R"(x.xml:7: <tissue> young="1e300": expected no number beyond 1e+30)"},
      {"0.1 0.2 0.3", "0.1 0.2 -1e9", R"(x.xml:10: <body> position="0.1 0.2 -1e9": expected no number beyond 1000)"},
      {"amplitude=\"0.1\"", "amplitude=\"1e4\"",
       R"(x.xml:13: <drive> amplitude="1e4": expected no number beyond 1000)"},
      {"phase=\"0.5\"", "phase=\"-1e18\"", R"(x.xml:13: <drive> phase="-1e18": expected no number beyond 1e+06)"},
      {"frequency=\"2\"", "frequency=\"1e20\"",
       R"(x.xml:13: <drive> frequency="1e20": expected no number beyond 1e+06)"},
      {"position=\"1 0 0\"", "position=\"1e39 0 0\"",
       R"(x.xml:17: <static> position="1e39 0 0": expected no number beyond 1000)"},
      {"normal=\"0 0 2\"", "normal=\"0 0 1e200\"",
       R"(x.xml:17: <static> normal="0 0 1e200": expected no number beyond 1e+30)"},
      {"size=\"1 2 3\"", "size=\"1 2 1001\"", R"(x.xml:17: <static> size="1 2 1001": expected no number beyond 1000)"},
      {"radius=\"4\"", "radius=\"1e39\"", R"(x.xml:17: <static> radius="1e39": expected no number beyond 1000)"},
      {"radius=\"0.004\"", "radius=\"100\"", R"(x.xml:18: <tool> radius="100": expected no number beyond 5)"},
      {"grip_radius=\"0.007\"", "grip_radius=\"6\"",
       R"(x.xml:19: <tool> grip_radius="6": expected no number beyond 5)"},
      {"position=\"0 0 0.2\"", "position=\"0 0 1e39\"",
       R"(x.xml:20: <camera> position="0 0 1e39": expected no number beyond 1000)"},
      {"target=\"0 0.01 0\"", "target=\"0 1e39 0\"",
       R"(x.xml:20: <camera> target="0 1e39 0": expected no number beyond 1000)"},
      {"target=\"0.1 0 0\"", "target=\"-2000 0 0\"",
       R"(x.xml:22: <key> target="-2000 0 0": expected no number beyond 1000)"},
      {"position=\"0.01 0 0.01\"", "position=\"0.01 0 1e4\"",
       R"(x.xml:24: <light> position="0.01 0 1e4": expected no number beyond 1000)"},
      {"reference_distance=\"0.2\"", "reference_distance=\"1e39\"",
       R"(x.xml:24: <light> reference_distance="1e39": expected no number beyond 1000)"},
      {"haze_distance=\"4\"", "haze_distance=\"1e39\"",
       R"(x.xml:24: <light> haze_distance="1e39": expected no number beyond 1000)"},
  });
  EXPECT_EQ(complaint(edited("0.1 0.2 0.3", "1000 -1000 0")), "");
}

TEST_F(SceneFile, WrongValuesOfTimesDynamicsAndBodiesNameTheLineAndWhatWasExpected) {
  expectComplaints({
      {"6e3", "6e3Pa", R"(x.xml:7: <tissue> young="6e3Pa": expected 1 number > 0)"},
      {"6e3", "nan", R"(x.xml:7: <tissue> young="nan": expected 1 number > 0)"},
      {"6e3", "inf", R"(x.xml:7: <tissue> young="inf": expected 1 number > 0)"},
      {"6e3", "1e999", R"(x.xml:7: <tissue> young="1e999": expected 1 number > 0)"},
      {"6e3", "0x10", R"(x.xml:7: <tissue> young="0x10": expected 1 number > 0)"},
      {"6e3", "", R"(x.xml:7: <tissue> young="": expected 1 number > 0)"},
      {"6e3", "0", R"(x.xml:7: <tissue> young="0": expected 1 number > 0)"},
      {"poisson=\"0.4\"", "poisson=\"0.5\"", R"(x.xml:7: <tissue> poisson="0.5": expected 1 number >= 0 and < 0.5)"},
      {"density=\"1030\"", "density=\"1e-300\"", R"(x.xml:7: <tissue> density="1e-300": expected 1 number >= 1e-06)"},
      {"damping=\"0.2\"", "damping=\"-1\"", R"(x.xml:7: <tissue> damping="-1": expected 1 number >= 0)"},
      {"0.1 0.2 0.3", "0.1 0.2", R"(x.xml:10: <body> position="0.1 0.2": expected 3 numbers)"},
      {"0.1 0.2 0.3", "0.1 0.2 0.3 0", R"(x.xml:10: <body> position="0.1 0.2 0.3 0": expected 3 numbers)"},
      {"0.1 0.2 0.3", "0.1,0.2,0.3",
       R"(x.xml:10: <body> position="0.1,0.2,0.3": expected 3 numbers, separated by blanks)"},
      {"0.707 0 0.707 0", "0.7 0 0.7 0",
       R"(x.xml:11: <body> orientation="0.7 0 0.7 0": expected a unit quaternion w x y z (length within 1e-3 of 1))"},
      {"\"springs\"", "\"ropes\"", R"(x.xml:11: <body> links="ropes": expected one of springs, beam, identified)"},
      {"\"skin\"", "\"thin\"", R"(x.xml:11: <body> surface="thin": did you mean "skin"? known: full, skin, contact)"},
      {"ambient_drag=\"0.3\"", "ambient_drag=\"-1\"",
       R"(x.xml:5: <dynamics> ambient_drag="-1": expected 1 number >= 0)"},
      {"sleep_after=\"0.5\"", "sleep_after=\"-1\"", R"(x.xml:5: <dynamics> sleep_after="-1": expected 1 number >= 0)"},
      {"\"implicit\"", "\"mixed\"", R"(x.xml:5: <dynamics> integrator="mixed": expected one of explicit, implicit)"},
      {"order=\"2\"", "order=\"3\"", R"(x.xml:5: <dynamics> order="3": expected one of 1, 2)"},
      {"\"implicit\"", "\"explicit\"", R"(x.xml:5: <dynamics> order="2": order="2" needs integrator="implicit")"},
      {"substeps=\"16\"", "substeps=\"1.5\"",
       R"(x.xml:5: <dynamics> substeps="1.5": expected 1 integer >= 0 and <= 1e+05)"},
      {"\"swept\"", "\"cones\"",
       R"(x.xml:5: <dynamics> contact="cones": did you mean "none"? known: none, balls, swept)"},
      {"friction=\"0.3\"", "friction=\"-0.3\"", R"(x.xml:7: <tissue> friction="-0.3": expected 1 number >= 0)"},
      {"names=\"second\"", "names=\"secnd\"",
       R"(x.xml:14: <neighbours> names="secnd": no <body> is named "secnd"; did you mean "second"?)"},
      {"names=\"second\"", "names=\"second gallbladder\"",
       R"(x.xml:14: <neighbours> names="second gallbladder": a body is no neighbour of itself)"},
      {"names=\"second\"", "names=\"\"", R"(x.xml:14: <neighbours> names="": is empty)"},
      {"look=\"fat\" contact=\"false\"", "look=\"fat\" contact=\"false\" friction=\"1\"",
       R"(x.xml:17: <static> friction="1": friction needs contact="true")"},
      {"names=\"second\"", "names=\" \"", R"(x.xml:14: <neighbours> names=" ": expected names of bodies)"},
      {"servo=\"1000\"", "servo=\"1001\"",
       R"(x.xml:4: <clock> servo="1001": expected the servo rate to be a multiple of the dynamics rate)"},
      {"settle=\"2\"", "settle=\"61\"", R"(x.xml:4: <clock> settle="61": expected 1 number >= 0 and <= 60)"},
      {"dynamics=\"40\"", "dynamics=\"10\"", R"(x.xml:4: <clock> dynamics="10": expected 1 number >= 20 and <= 1200)"},
  });
}

TEST_F(SceneFile, WrongValuesOfWhatHoldsAndMovesBodiesLikewise) {
  expectComplaints({
      {"box=\"0 1 2 3 4 5\"", "box=\"0 1 2 3 4\"", R"(x.xml:16: <fix> box="0 1 2 3 4": expected 6 numbers)"},
      {"box=\"0 1 2 3 4 5\"", "box=\"0 1 2 3 4 1\"",
       R"(x.xml:16: <fix> box="0 1 2 3 4 1": expected the lower corner first: x0 y0 z0 x1 y1 z1)"},
      {"1 2 3 0.5", "1 2 3 0", R"(x.xml:16: <fix> sphere="1 2 3 0": expected a radius > 0: x y z r)"},
      {"<links ", "<links box=\"0 0 0 1 1 1\" ",
       "x.xml:14: <links> says which by one attribute of select, box, sphere, plane"},
      {"select=\"all\"", "select=\"some\"",
       R"(x.xml:14: <links> select="some": expected all, or box, sphere or plane instead)"},
      {"select=\"all\"", "sphere=\"0 0 0 0\"", R"(x.xml:14: <links> sphere="0 0 0 0": expected a radius > 0: x y z r)"},
      {"<fix box=\"0 1 2 3 4 5\"/>", "<fix/>",
       "x.xml:16: <fix> says where by one attribute of spheres, box, sphere, plane, vertices"},
      {"<fix box", "<fix vertices=\"a.csv\" box",
       "x.xml:16: <fix> says where by one attribute of spheres, box, sphere, plane, vertices"},
      {"plane=\"0 2 0 0.5\"", "plane=\"0 0 0 1\"",
       R"(x.xml:16: <fix> plane="0 0 0 1": expected a direction and a distance: nx ny nz d)"},
      {"plane=\"0 2 0 0.5\"", "plane=\"0 nan 0 1\"", R"(x.xml:16: <fix> plane="0 nan 0 1": expected 4 numbers)"},
      {"held.csv", "", R"(x.xml:16: <fix> vertices="": is empty)"},
      {"<load box=\"1 2 3 4 5 6\"", "<load",
       "x.xml:16: <load> says where by one attribute of file, box, sphere, plane, vertices"},
      {"<load box", "<load sphere=\"0 0 0 1\" box",
       "x.xml:16: <load> says where by one attribute of file, box, sphere, plane, vertices"},
      {" force=\"0 0 1.5\"", "", "x.xml:16: <load>: expected the attribute \"force\""},
      {"0 0 1.5", "0 0 nan", R"(x.xml:16: <load> force="0 0 nan": expected 3 numbers)"},
      {"0 0 1.5", "1.5", R"(x.xml:16: <load> force="1.5": expected 3 numbers)"},
      {"loads.csv\"", "loads.csv\" force=\"1 0 0\"",
       R"(x.xml:16: <load> force="1 0 0": the file has the forces, expected one of the two)"},
      {"to=\"2\"", "to=\"0.25\"",
       R"(x.xml:16: <load> to="0.25": the load grows from 0.5 s to 0.25 s, expected the earlier time first)"},
      {"from=\"0.5\" to=\"2\"", "from=\"3\"",
       R"(x.xml:16: <load> from="3": the load grows from 3 s to 1 s, expected the earlier time first)"},
      {"from=\"0.5\"", "from=\"-1\"", R"(x.xml:16: <load> from="-1": expected 1 number >= 0)"},
      {"sphere=\"2\"", "sphere=\"4\"", R"(x.xml:13: <drive> sphere="4": this sphere is fixed)"},
      {"axis=\"0 1 1\"", "axis=\"0 0 0\"", R"(x.xml:13: <drive> axis="0 0 0": expected a direction)"},
      {"frequency=\"2\"", "frequency=\"0\"", R"(x.xml:13: <drive> frequency="0": expected 1 number > 0)"},
      {"spheres=\"0 1\"", "spheres=\"\"", R"(x.xml:12: <fix> spheres="": expected one or more integers >= 0)"},
      {"spheres=\"0 1\"", "spheres=\"0 -1\"", R"(x.xml:12: <fix> spheres="0 -1": expected one or more integers >= 0)"},
      {"spheres=\"4\"", "spheres=\"1\"", R"(x.xml:13: <fix> spheres="1": sphere 1 is fixed twice)"},
  });
}

TEST_F(SceneFile, WrongValuesOfSceneryAndToolsLikewise) {
  expectComplaints({
      {"shape=\"mesh\"", "shape=\"cone\"",
       R"(x.xml:17: <static> shape="cone": expected one of plane, box, sphere, mesh)"},
      {"shape=\"mesh\"", "shape=\"box\"",
       R"(x.xml:17: <static> shape="box": expected the attribute "size" with this shape)"},
      {"shape=\"box\"", "shape=\"box\" radius=\"1\"",
       R"(x.xml:17: <static> radius="1": only shape="sphere" has this attribute)"},
      {" normal=\"0 0 2\"", "", R"(x.xml:17: <static> shape="plane": expected the attribute "normal" with this shape)"},
      {"normal=\"0 0 2\"", "normal=\"0 0 0\"", R"(x.xml:17: <static> normal="0 0 0": expected a direction)"},
      {"normal=\"0 0 2\"", "normal=\"0 0 2\" orientation=\"1 0 0 0\"",
       R"(x.xml:17: <static> orientation="1 0 0 0": a plane has a normal instead)"},
      {"size=\"1 2 3\"", "size=\"1 2 0\"", R"(x.xml:17: <static> size="1 2 0": expected 3 numbers > 0)"},
      {" radius=\"4\"", "", R"(x.xml:17: <static> shape="sphere": expected the attribute "radius" with this shape)"},
      {"radius=\"4\"", "radius=\"-4\"", R"(x.xml:17: <static> radius="-4": expected 1 number > 0)"},
      {"mesh=\"/abs/wall.obj\" ", "",
       R"(x.xml:17: <static> shape="mesh": expected the attribute "mesh" with this shape)"},
      {"contact=\"true\"", "contact=\"yes\"", R"(x.xml:17: <static> contact="yes": expected true or false)"},
      {"friction=\"0.4\"", "friction=\"-1\"", R"(x.xml:17: <static> friction="-1": expected 1 number >= 0)"},
      {" look=\"fat\"", "", R"(x.xml:17: <static> shape="box": without contact and without a look it has no effect)"},
      {"unit=\"mm\"", "unit=\"km\"",
       R"(x.xml:17: <static> unit="km": did you mean "m"? known: m, cm, mm, micron, inch)"},
      {"0.4 0.1", "0.1 0.4", R"(x.xml:18: <tool> friction="0.1 0.4": expected static >= dynamic friction)"},
  });
}

TEST_F(SceneFile, WrongValuesOfThePictureLikewise) {
  expectComplaints({
      {"<key t=\"6\"", "<key t=\"4\"", R"(x.xml:22: <key> t="4": expected a later time than the key before it)"},
      {"target=\"0 0.01 0\"", "target=\"0 0 0.2\"",
       R"(x.xml:20: <camera> position="0 0 0.2": position and target are the same point)"},
      {"endoscope=\"false\"", "endoscope=\"no\"", R"(x.xml:20: <camera> endoscope="no": expected true or false)"},
      {"intensity=\"1.5\"", "offset=\"1 0 0\"",
       R"(x.xml:24: <light> offset="1 0 0": expected one of offset, from the lens, and position, in the world)"},
      {"position=\"0.01 0 0.01\"", "", R"(x.xml:24: <light> caustics="0.5": expected a light with a position)"},
      {"haze=\"0.1 0.2 0.3\"", "", R"(x.xml:24: <light> haze_distance="4": expected a haze beside it)"},
      {"haze=\"0.1 0.2 0.3\"", "haze=\"0.1 0.2 -1\"",
       R"(x.xml:24: <light> haze="0.1 0.2 -1": expected 3 numbers >= 0)"},
      {"haze_distance=\"4\"", "haze_distance=\"0\"", R"(x.xml:24: <light> haze_distance="0": expected 1 number > 0)"},
      {"caustics=\"0.5\"", "caustics=\"2\"", R"(x.xml:24: <light> caustics="2": expected 1 number >= 0 and <= 1)"},
      {"640 480", "641 480", R"(x.xml:25: <output> size="641 480": expected even width and height (video needs them))"},
      {"640 480", "640 8", R"(x.xml:25: <output> size="640 8": expected 2 integers >= 16 and <= 8192)"},
      {"let go", "放す", R"(x.xml:25: <caption> text="放す": expected Latin letters, digits and signs, not '放')"},
      {"0.5 3 7", "0.5 13", R"(x.xml:25: <output> golden="0.5 13": a time beyond the scene's duration)"},
      {"0.5 3 7", "0.5 0.501", R"(x.xml:25: <output> golden="0.5 0.501": two golden moments are picture 13 at 25 Hz)"},
      {"0.5 3 7", "3 0.5", R"(x.xml:25: <output> golden="3 0.5": expected increasing times)"},
  });
}

TEST_F(SceneFile, AValueMayGoOnInTheNextLine) {
  const Scene s = read(edited("pressed &amp; held", "pressed &amp;\nheld"));
  ASSERT_FALSE(s.captions.empty());
  EXPECT_EQ(s.captions[0].text, "pressed & held");
}

TEST_F(SceneFile, FilesThatAreNoScenes) {
  EXPECT_EQ(complaint(""), "x.xml: broken XML: the file is empty");
  EXPECT_EQ(complaint("t[s],x[m]\n"), "x.xml: is no XML: expected a file that begins with <");
  EXPECT_EQ(complaint("<model version='1'/>"), "x.xml:1: the root element is <model>, expected <scene>");
  EXPECT_EQ(complaint("\n<scene name='a'>\n<clock duration=1/></scene>"),
            "x.xml:3: broken XML: an attribute is not of the form name=\"value\", or stands twice");
  EXPECT_EQ(complaint("<!DOCTYPE scene [ <!ENTITY e '0.2'> ]>\n<scene name='a'/>").substr(5),
            ":1: declarations within a DOCTYPE are not understood, expected none");
  EXPECT_EQ(complaint(std::string("<scene\0/>", 9)), "x.xml: holds a zero byte, expected XML text");
  EXPECT_EQ(complaint("<scene>\n<!-- gr\xf6\xdf -->"), "x.xml:2: holds the byte 0xF6, expected UTF-8 or ASCII");
  EXPECT_EQ(complaint("<scene/>\n<!--\xc3"), "x.xml:2: ends within a letter, expected UTF-8 or ASCII");
  const auto reading = [](const std::string& path) { return complaintOf([&] { readScene(path); }); };
  EXPECT_EQ(reading(folder + "/none.xml"), folder + "/none.xml: cannot be opened: No such file or directory");
  EXPECT_EQ(reading(folder), folder + ": is a folder, expected a file");
  const std::string deep = [] {
    std::string text;
    for (int k = 0; k < 100000; ++k) text += "<a>";
    return text;
  }();
  EXPECT_EQ(complaint(deep), "x.xml:1: broken XML: elements are nested too deeply");
}

// The XML with every comment and declaration blanked, so that only tags are left to search.
std::string withoutComments(std::string text) {
  for (const auto& [open, close] : {std::pair("<!--", "-->"), std::pair("<?", "?>")}) {
    for (std::size_t at = text.find(open); at != std::string::npos; at = text.find(open)) {
      const std::size_t end = text.find(close, at) + std::string(close).size();
      for (std::size_t k = at; k < end; ++k) text[k] = text[k] == '\n' ? '\n' : ' ';
    }
  }
  return text;
}

// How a complaint about this place begins.
std::string place(const std::string& text, long offset) {
  return fmt::format("x.xml:{}: ", std::count(text.begin(), text.begin() + offset, '\n') + 1);
}

std::vector<std::string> scenesAtHand() {
  std::vector<std::string> texts = {completeScene};
  for (const auto& entry : std::filesystem::directory_iterator(MEDULLA_SOURCE_DIR "/scenes")) {
    if (entry.path().extension() == ".xml") texts.push_back(readTextFile(entry.path()));
  }
  return texts;
}

TEST_F(SceneFile, EveryMisspeltAttributeFailsAtItsLine) {
  const std::regex attribute("\\s([A-Za-z_]+)=[\"']");
  for (const std::string& text : scenesAtHand()) {
    const std::string tags = withoutComments(text);
    int count = 0;
    for (std::sregex_iterator match(tags.begin(), tags.end(), attribute), end; match != end; ++match, ++count) {
      const std::string name = match->str(1);
      const std::size_t behind = match->position(1) + name.size();
      const std::string found = complaint(std::string(text).insert(behind, 1, 'x'));
      EXPECT_TRUE(found.starts_with(place(tags, match->position(1)))) << name << ": " << found;
      EXPECT_TRUE(found.ends_with(fmt::format("has no attribute \"{0}x\"; did you mean \"{0}\"?", name))) << found;
    }
    EXPECT_GT(count, 10);
  }
}

TEST_F(SceneFile, EveryMisspeltElementFailsAtItsLine) {
  for (const std::string& text : scenesAtHand()) {
    const std::string tags = withoutComments(text);
    for (const XmlRule& rule : sceneRules()) {
      const std::regex tag("<(/?)" + rule.element + "\\b");
      std::smatch first;
      if (!std::regex_search(tags, first, tag)) continue;
      const std::string found = complaint(std::regex_replace(tags, tag, "<$1" + rule.element + "x"));
      EXPECT_TRUE(found.starts_with(place(tags, first.position()))) << found;
      EXPECT_NE(found.find(fmt::format("<{}x>", rule.element)), std::string::npos) << found;
    }
  }
}

TEST(SceneFiles, EveryShippedSceneIsRead) {
  for (const auto& entry : std::filesystem::directory_iterator(MEDULLA_SOURCE_DIR "/scenes")) {
    if (entry.path().extension() != ".xml") continue;
    EXPECT_EQ(readScene(entry.path()).name, entry.path().stem());
  }
}

}  // namespace
}  // namespace medulla
