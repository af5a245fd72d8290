#include "app/files/scene_overrides.h"

#include "tests/complete_scene.h"

// `--set PATH=VALUE`.
namespace medulla {
namespace {

using SceneOverrides = SceneFile;

TEST_F(SceneOverrides, OverridesReplaceSingleAttributes) {
  const Scene s = read(completeScene, {{"body.gallbladder.surface", "full"},
                                       {"tissue.bile_sac.young", "1"},
                                       {"tissue.bile_sac.young", "1e4"},
                                       {"dynamics.gravity", "0 0 0"},
                                       {"tool.grasper.radius", "0.005"},
                                       {"body.gallbladder.links.torsion", "7"},
                                       {"body.second.links.flexion", "8"},
                                       {"body.second.position", "1 2 3"},
                                       {"scene.name", "other"}});
  EXPECT_EQ(s.bodies[0].surface, SurfaceMode::full);
  EXPECT_EQ(s.bodies[0].tissue.young, 1e4);  // the later one
  EXPECT_EQ(s.dynamics.gravity, Eigen::Vector3d::Zero());
  EXPECT_EQ(s.tools[0].settings.radius, 0.005);
  EXPECT_EQ(s.bodies[0].steered[0].factors.torsion, 7);
  EXPECT_EQ(s.bodies[1].steered[0].factors.flexion, 8);  // where the scene has no <links>
  EXPECT_EQ(s.bodies[1].worldFromModel.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(s.name, "other");
}

TEST_F(SceneOverrides, OverridesReachElementsLeftToTheirDefaults) {
  const std::string text = edited(
      R"(<light position="0.01 0 0.01" intensity="1.5" reference_distance="0.2" haze="0.1 0.2 0.3" haze_distance="4" caustics="0.5"/>)",
      "");
  EXPECT_EQ(read(text, {{"light.intensity", "3"}}).lightIntensity, 3);
}

TEST_F(SceneOverrides, AShorterRunDropsTheGoldenTimesBeyondIt) {
  EXPECT_EQ(read(completeScene, {{"clock.duration", "3.5"}}).goldenTimes, (std::vector<double>{0.5, 3}));
}

TEST_F(SceneOverrides, AnotherRateMayMakeOnePictureOfTwoGoldenMoments) {
  EXPECT_EQ(read(edited("golden=\"0.5 3 7\"", "golden=\"0.5 0.6\""), {{"output.fps", "1"}}).goldenTimes.size(), 2u);
}

TEST_F(SceneOverrides, OfValuesThatContradictEachOtherTheOverrideIsToBlame) {
  const auto set = [&](const char* path, const char* value) { return complaint(completeScene, {{path, value}}); };
  EXPECT_EQ(set("dynamics.integrator", "explicit"),
            "--set dynamics.integrator: <dynamics> integrator=\"explicit\": order=\"2\" needs integrator=\"implicit\"");
  EXPECT_TRUE(
      set("clock.dynamics", "70").starts_with("--set clock.dynamics: <clock> dynamics=\"70\": expected the servo"));
  EXPECT_TRUE(set("light.offset", "0 0 0").starts_with("--set light.offset: "));
}

TEST_F(SceneOverrides, MistakesInOverridesNameTheOverride) {
  const auto set = [&](const char* path, const char* value) { return complaint(completeScene, {{path, value}}); };
  EXPECT_EQ(
      set("body.galbladder.surface", "skin"),
      "--set body.galbladder.surface: the scene has nothing of this name; did you mean body.gallbladder.surface?");
  EXPECT_EQ(set("body.gut.look", "gut"),
            "--set body.gut.look: the scene has nothing of this name; did you mean body.second.look?");
  EXPECT_EQ(set("dynamics.gravty", "0 0 0"),
            "--set dynamics.gravty: the scene has nothing of this name; did you mean dynamics.gravity?");
  EXPECT_EQ(set("body.gallbladder", "x"),
            "--set body.gallbladder: expected a value of it, such as body.gallbladder.model");
  EXPECT_EQ(set("body", "x"), "--set body: expected a value of it, such as body.gallbladder.model");
  EXPECT_EQ(set("camera.keys.fov", "50"),
            "--set camera.keys.fov: the scene has nothing of this name, and several elements answer to camera.key.fov, "
            "which reaches none");
  EXPECT_EQ(set("camera.key.fov", "50"), "--set camera.key.fov: several elements answer to this, expected one");
  EXPECT_EQ(
      set("body.gallbladder.surface", "thin"),
      R"(--set body.gallbladder.surface: <body> surface="thin": did you mean "skin"? known: full, skin, contact)");
  EXPECT_EQ(set("tissue.bile_sac.young", "-1"),
            R"(--set tissue.bile_sac.young: <tissue> young="-1": expected 1 number > 0)");
  EXPECT_EQ(set("", "x").substr(0, 6), "--set ");
}

}  // namespace
}  // namespace medulla
