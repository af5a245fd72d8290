#include <fmt/format.h>
#include <gtest/gtest.h>

#include "app/files/model_file.h"
#include "app/simulation.h"
#include "physics/dynamics/region.h"
#include "tests/complaint.h"
#include "tests/identified_model.h"
#include "tests/temporary_folder.h"

// links="identified" in scenes: what is held has to be what the model was identified with.
namespace medulla {

namespace {

class IdentifiedScene : public testing::Test {
 protected:
  void SetUp() override {
    SoftBodyModel plain = readModel(MEDULLA_SOURCE_DIR "/assets/gallbladder/gallbladder.model.xml");
    plain.settings = "medulla build pear.obj --spheres 7";
    Region region;
    region.shape = Region::Shape::halfSpace;
    region.normal = {0, -1, 0};
    region.distance = 0.02;
    synthetic::NetworkSettings settings;
    settings.held = nodesInRegion(plain, region);
    writeModel(folder / "pear.xml", *synthetic::withNetwork(plain, settings));
    writeModel(folder / "plain.xml", plain);
  }
  std::string scene(const std::string& body, const std::string& model = "pear.xml", double poisson = 0.45) const {
    folder.write("case.xml", fmt::format("<scene name='case'><clock duration='0.1'/>\n"
                                         "<tissue name='t' young='5e3' poisson='{}'/>\n"
                                         "<body name='pear' model='{}' tissue='t' look='gallbladder' "
                                         "links='identified'>{}</body>\n"
                                         "<camera position='0 0 1' target='0 0 0'/></scene>",
                                         poisson, model, body));
    return folder / "case.xml";
  }
  std::string refusal(const std::string& path) const {
    return complaintOf([&] { loadScene(readScene(path)); }, folder.path());
  }
  TemporaryFolder folder;
};

constexpr const char* kHeld = "<fix plane='0 -1 0 0.02'/>";

}  // namespace

TEST_F(IdentifiedScene, RunsHeldByItsPatch) {
  const LoadedScene loaded = loadScene(readScene(scene(kHeld)));
  EXPECT_EQ(loaded.scene.bodies[0].links, LinkModel::identified);
  EXPECT_TRUE(loaded.scene.bodies[0].fixed.empty());
  Simulation simulation(loaded);
  simulation.advanceFrame();
  const World& world = simulation.world();
  DynamicsFrame frame;
  world.readFrame(frame);
  const SoftBodyModel& m = *loaded.scene.bodies[0].model;
  for (const int node : m.identified->patches[0].nodes)
    EXPECT_EQ(frame.bodies[0].nodes[node], m.restNodes[node]) << "node " << node;
  double farthest = 0;
  for (std::size_t n = 0; n < m.restNodes.size(); ++n)
    farthest = std::max(farthest, (frame.bodies[0].nodes[n] - m.restNodes[n]).norm());
  EXPECT_GT(farthest, 0);
}

// Run in another folder than the model's, it writes that model and reads what the scene does.
TEST_F(IdentifiedScene, WithoutItsNetworkPatchOrRatioItIsRefusedAndTheRightBuildNamed) {
  const auto into = [&](const char* name) { return " -o " + (folder / name); };
  const std::string build =
      "; run where its mesh lies, this would make it: medulla build pear.obj --spheres 7 --identify --poisson ";
  EXPECT_EQ(refusal(scene(kHeld, "plain.xml")),
            "case.xml:3: body \"pear\" has identified links, and its model has none" + build +
                "0.45 --fix plane=0,-1,0,0.02" + into("plain.xml"));
  EXPECT_EQ(refusal(scene("<fix plane='0 -1 0 0.03'/>")),
            "case.xml:3: body \"pear\" has identified links, and its model was identified with another part of its "
            "surface fixed" +
                build + "0.45 --fix plane=0,-1,0,0.03" + into("pear.xml"));
  EXPECT_EQ(refusal(scene("")),
            "case.xml:3: body \"pear\" has identified links, and its model was identified with another part of its "
            "surface fixed" +
                build + "0.45" + into("pear.xml"));
  folder.write("held nodes.csv", "0\n");
  EXPECT_EQ(refusal(scene("<fix vertices='held nodes.csv'/>")),
            "case.xml:3: body \"pear\" has identified links, and its model was identified with another part of its "
            "surface fixed" +
                build + "0.45 --fix 'vertices=" + (folder / "held nodes.csv") + "'" + into("pear.xml"));
  EXPECT_EQ(refusal(scene(kHeld, "pear.xml", 0.3)),
            "case.xml:3: body \"pear\" has identified links, and its model was identified for a Poisson's ratio of "
            "0.45" +
                build + "0.3 --fix plane=0,-1,0,0.02" + into("pear.xml"));
}

TEST_F(IdentifiedScene, PatchesHoldWhollyAndInsteadOfSpheres) {
  EXPECT_EQ(refusal(scene("<fix plane='0 -1 0 0.02' dof='translation'/>")),
            "case.xml:3: body \"pear\" has identified links, which its patches hold wholly: expected dof=\"all\"");
  EXPECT_EQ(
      refusal(scene(std::string(kHeld) + "<fix spheres='0'/>")),
      "case.xml:3: body \"pear\" has identified links and fixes spheres by number: expected parts of its surface");
}

}  // namespace medulla
