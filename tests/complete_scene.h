#pragma once

#include <gtest/gtest.h>

#include "app/scene.h"
#include "tests/complaint.h"
#include "tests/temporary_folder.h"

namespace medulla {

// Every element and every attribute of the format, each value other than its default.
inline constexpr const char* completeScene = R"(<?xml version="1.0"?>
<?xml-model href="scene.xsd"?>
<scene name="complete">
  <clock servo="1000" dynamics="40" duration="12" settle="2"/>
  <dynamics integrator="implicit" order="2" gravity="0 0 -9.5" ambient_drag="0.3" substeps="16" contact="swept" sleep_after="0.5"/>
  <!-- tissues -->
  <tissue name="bile_sac" young="6e3" poisson="0.4" density="1030" damping="0.2" friction="0.3"/>
  <tissue name="liver"/>
  <body name="gallbladder" model="../assets/gallbladder.model.xml" tissue="bile_sac" look="gallbladder"
        position="0.1 0.2 0.3"
        orientation="0.707 0 0.707 0" links="springs" surface="skin" reference="fem.txt">
    <fix spheres="0 1" dof="translation"/>
    <fix spheres="4" dof="all"/> <drive sphere="2" axis="0 1 1" amplitude="0.1" frequency="2" phase="0.5" velocity="1 0 0" dof="all"/>
    <links select="all" elongation="2" flexion="3" torsion="0.5"/><neighbours names="second"/>
  </body>
  <body name="second" model="second.model.xml" tissue="liver" look="liver"> <fix box="0 1 2 3 4 5"/> <fix sphere="1 2 3 0.5" dof="translation"/> <fix plane="0 2 0 0.5"/> <fix vertices="held.csv"/> <load box="1 2 3 4 5 6" force="0 0 1.5" from="0.5" to="2"/> <load sphere="7 8 9 1" force="1 0 0"/> <load plane="0 0 1 3" force="2 0 0"/> <load vertices="pulled.csv" force="3 0 0" from="0" to="0"/> <load file="loads.csv" to="4"/> </body>
  <static shape="mesh" mesh="/abs/wall.obj" look="wall" position="1 0 0" orientation="0 1 0 0" unit="mm" contact="true" friction="0.4"/><static shape="plane" normal="0 0 2" position="0 0 3"/><static shape="box" size="1 2 3" look="fat" contact="false"/><static shape="sphere" radius="4"/>
  <tool name="grasper" trajectory="gallbladder.csv" radius="0.004" stiffness="300" damping="2" friction="0.4 0.1"
        force_max="5" grip_radius="0.007" grip_force_max="4"/>
  <camera position="0 0 0.2" target="0 0.01 0" fov="50" endoscope="false">
    <key t="4" position="0 0.1 0.2"/>
    <key t="6" target="0.1 0 0" fov="40"/>
  </camera>
  <light position="0.01 0 0.01" intensity="1.5" reference_distance="0.2" haze="0.1 0.2 0.3" haze_distance="4" caustics="0.5"/>
  <output size="640 480" fps="25" golden="0.5 3 7"><caption from="0.5" to="2" text="pressed &amp; held"/><caption from="2" to="3" text="let go"/></output>
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
    return complaintOf([&] { read(text, overrides); }, folder);
  }
  // The complete scene with the first `from` replaced by `to`.
  static std::string edited(const std::string& from, const std::string& to) {
    std::string text = completeScene;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  }
  // One edit of the complete scene and the whole complaint that it must bring.
  struct Mistake {
    const char *from, *to, *complaint;
  };
  void expectComplaints(const std::vector<Mistake>& mistakes) const {
    for (const Mistake& m : mistakes) EXPECT_EQ(complaint(edited(m.from, m.to)), m.complaint);
  }

  TemporaryFolder temporary;
  const std::string folder = temporary.path();
};

}  // namespace medulla
