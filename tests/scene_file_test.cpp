#include <gtest/gtest.h>

#include <filesystem>

#include "app/files/scene_rules.h"
#include "app/files/text_file.h"
#include "app/scene.h"
#include "tests/temporary_folder.h"

namespace medulla {
namespace {

// Every element and every attribute of the format, each value other than its default.
const char* completeScene = R"(<?xml version="1.0"?>
<scene name="complete">
  <clock servo="1000" dynamics="40" duration="12"/>
  <dynamics integrator="explicit" order="1" gravity="0 0 -9.5" substeps="16"/>
  <!-- tissues -->
  <tissue name="bile_sac" young="6e3" poisson="0.4" density="1030" damping="0.2"/>
  <tissue name="liver"/>
  <body name="gallbladder" model="../assets/gallbladder.model.xml" tissue="bile_sac" look="gallbladder"
        position="0.1 0.2 0.3"
        orientation="0.707 0 0.707 0" links="springs" surface="skin">
    <fix spheres="0 1" dof="translation"/>
    <fix spheres="4" dof="all"/>
    <links select="all" elongation="2" flexion="3" torsion="0.5"/>
  </body>
  <body name="second" model="second.model.xml" tissue="liver" look="liver"/>
  <static shape="mesh" mesh="/abs/wall.obj" look="wall" position="1 0 0" orientation="0 1 0 0" unit="mm"/>
  <tool name="grasper" trajectory="gallbladder.csv" radius="0.004" stiffness="300" damping="2" friction="0.4 0.1"
        force_max="5" grip_radius="0.007"/>
  <camera position="0 0 0.2" target="0 0.01 0" fov="50">
    <key t="4" position="0 0.1 0.2"/>
    <key t="6" target="0.1 0 0" fov="40"/>
  </camera>
  <light offset="0.01 0 0.01" intensity="1.5" reference_distance="0.2"/>
  <output size="640 480" fps="25" golden="0.5 3 7"/>
</scene>
)";

class SceneFile : public testing::Test {
 protected:
  Scene read(const std::string& text, const std::vector<SceneOverride>& overrides = {}) const {
    temporary.write("x.xml", text);
    return readScene(temporary / "x.xml", overrides);
  }
  // The complaint, without the folder; empty where there is none.
  std::string complaint(const std::string& text, const std::vector<SceneOverride>& overrides = {}) const {
    try {
      read(text, overrides);
    } catch (const std::runtime_error& error) {
      const std::string message = error.what();
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      return message.starts_with(folder + "/") ? message.substr(folder.size() + 1) : message;
    }
    return "";
  }
  // The complete scene with the first `from` replaced by `to`.
  static std::string edited(const std::string& from, const std::string& to) {
    std::string text = completeScene;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  }

  TemporaryFolder temporary;
  const std::string folder = temporary.path();
};

TEST_F(SceneFile, EveryValueArrives) {
  const Scene s = read(completeScene);
  EXPECT_EQ(s.name, "complete");
  EXPECT_EQ(s.servoRate, 1000);
  EXPECT_EQ(s.dynamicsRate, 40);
  EXPECT_EQ(s.duration, 12);
  EXPECT_EQ(s.gravity, Eigen::Vector3d(0, 0, -9.5));
  EXPECT_EQ(s.substeps, 16);
  ASSERT_EQ(s.bodies.size(), 2u);
  const SceneBody& body = s.bodies[0];
  EXPECT_EQ(body.line, 8);
  EXPECT_EQ(body.name, "gallbladder");
  EXPECT_EQ(body.modelPath, std::filesystem::path(folder).parent_path().string() + "/assets/gallbladder.model.xml");
  EXPECT_EQ(body.look, "gallbladder");
  EXPECT_EQ(body.tissue.young, 6e3);
  EXPECT_EQ(body.tissue.poisson, 0.4);
  EXPECT_EQ(body.tissue.density, 1030);
  EXPECT_EQ(body.tissue.damping, 0.2);
  EXPECT_EQ(body.surface, SurfaceMode::skin);
  EXPECT_EQ(body.factors.elongation, 2);
  EXPECT_EQ(body.factors.flexion, 3);
  EXPECT_EQ(body.factors.torsion, 0.5);
  EXPECT_EQ(body.worldFromModel.translation(), Eigen::Vector3d(0.1, 0.2, 0.3));
  // A quarter turn about y, given with three digits: a rotation to the last bit nevertheless.
  EXPECT_NEAR((body.worldFromModel.linear() * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 0, 1e-12);
  ASSERT_EQ(body.fixed.size(), 3u);
  EXPECT_EQ(body.fixed[1].sphere, 1);
  EXPECT_EQ(body.fixed[1].freedom, FixedFreedom::translation);
  EXPECT_EQ(body.fixed[2].sphere, 4);
  EXPECT_EQ(body.fixed[2].freedom, FixedFreedom::all);
  EXPECT_EQ(s.bodies[1].tissue.young, Tissue().young);
  EXPECT_EQ(s.bodies[1].modelPath, folder + "/second.model.xml");
}

TEST_F(SceneFile, EveryValueOfScenerysToolsAndPictureArrives) {
  const Scene s = read(completeScene);
  ASSERT_EQ(s.statics.size(), 1u);
  EXPECT_EQ(s.statics[0].meshPath, "/abs/wall.obj");
  EXPECT_EQ(s.statics[0].look, "wall");
  EXPECT_EQ(s.statics[0].unit, "mm");
  EXPECT_EQ(s.statics[0].worldFromMesh.translation(), Eigen::Vector3d(1, 0, 0));
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
  EXPECT_EQ(s.lightOffset, Eigen::Vector3d(0.01, 0, 0.01));
  EXPECT_EQ(s.lightIntensity, 1.5);
  EXPECT_EQ(s.lightReferenceDistance, 0.2);
  EXPECT_EQ(s.width, 640);
  EXPECT_EQ(s.height, 480);
  EXPECT_EQ(s.fps, 25);
  EXPECT_EQ(s.goldenTimes, (std::vector<double>{0.5, 3, 7}));
}

}  // namespace
}  // namespace medulla
