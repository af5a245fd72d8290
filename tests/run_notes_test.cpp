#include <array>

#include "tests/own_scene.h"

// What a run tells on standard error of what was hardly meant.
namespace medulla {
namespace {

class RunNotes : public OwnScene {
 protected:
  // The tool's grip at 0, 0.1, 0.2 and 0.3 s, on its way to the organ, which it presses from 0.3 s on.
  std::vector<std::string> notesOfGrips(const std::array<double, 4>& grip, double duration) const {
    std::string text = "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n";
    for (int k = 0; k < 4; ++k)
      text += fmt::format("{},-0.0525,-0.0385,{},1,0,0,0,{}\n", 0.1 * k, 0.08 - 0.005 * k, grip[k]);
    text += fmt::format("0.4,-0.0525,-0.0385,0.019,1,0,0,0,{}\n", grip[3]);
    folder.write("own/organ.csv", text);
    const ProgramResult r = run(
        {"replay", "own/organ.xml", "--set", fmt::format("clock.duration={}", duration), "--set", "output.golden=0"});
    EXPECT_EQ(r.exitCode, 0) << r.err;
    return complaints(r);
  }
};

using Notes = std::vector<std::string>;

TEST_F(RunNotes, AToolThatClosedBesideTheBodyHeldNothing) {
  EXPECT_EQ(notesOfGrips({0, 1, 0, 0}, 0.6), Notes{"note: tool 'probe' closed once and held nothing"});
  EXPECT_EQ(notesOfGrips({0, 1, 0, 1}, 0.6), Notes{"note: tool 'probe' closed 2 times and held nothing"});
  EXPECT_EQ(notesOfGrips({0, 0, 0, 0}, 0.6), Notes{});  // nothing was to be held
  EXPECT_EQ(notesOfGrips({0, 1, 0, 0}, 0.3), Notes{});  // it may hold something later
}

TEST_F(RunNotes, ABodyOfWhichEveryNodeIsHeld) {
  std::string text = read("own/organ.xml");
  text.replace(text.find("spheres=\"1\""), 11, "sphere=\"1 2 4 5\"");
  folder.write("own/organ.xml", text);
  for (const char* verb : {"check", "replay"}) {
    const std::vector<std::string> notes = complaints(run({verb, "own/organ.xml"}));
    ASSERT_FALSE(notes.empty());
    EXPECT_EQ(notes[0], "note: every node of body 'organ' is held");
  }
}

}  // namespace
}  // namespace medulla
