#include "app/commands/run_notes.h"

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
  EXPECT_EQ(notesOfGrips({1, 1, 1, 1}, 0.6), Notes{"note: tool 'probe' was closed from the start and held nothing"});
  EXPECT_EQ(notesOfGrips({0, 0, 0, 0}, 0.6), Notes{});  // nothing was to be held
  EXPECT_EQ(notesOfGrips({0, 1, 0, 0}, 0.3), Notes{});  // it may hold something later
}

TEST_F(RunNotes, AHandThatJumps) {
  const auto notesOf = [&](double seconds) {
    folder.write("own/organ.csv", fmt::format("t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n"
                                              "0,0,0,0.1,1,0,0,0,0\n"
                                              "0.2,0,0,0.1,1,0,0,0,0\n"
                                              "{},0,0,0.13,1,0,0,0,0\n"
                                              "0.9,0,0,0.13,1,0,0,0,0\n",
                                              0.2 + seconds));
    return complaints(run({"check", "own/organ.xml"}));
  };
  EXPECT_EQ(notesOf(0.005), Notes{"note: tool 'probe' moves by 30 mm in 5 ms at 0.2 s: is its motion all there?"});
  EXPECT_EQ(notesOf(0.1), Notes{});
}

TEST_F(RunNotes, CaptionsThatNobodySees) {
  std::string text = read("own/organ.xml");
  text.replace(text.find("/></scene>"), 10, "><caption from=\"50\" to=\"51\" text=\"too late\"/></output></scene>");
  folder.write("own/organ.xml", text);
  const Notes notes = complaints(run({"check", "own/organ.xml"}));
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_TRUE(notes[0].starts_with("note: the caption \"too late\" begins at 50 s, and the scene ends at "))
      << notes[0];
}

TEST_F(RunNotes, ACameraThatNobodySeesArrive) {
  const auto notesOf = [&](const char* time) {
    OwnScene::write({});
    std::string text = read("own/organ.xml");
    const std::size_t end = text.find("/>", text.find("<camera"));
    text.replace(end, 2, fmt::format("><key t=\"{}\" fov=\"40\"/></camera>", time));
    folder.write("own/organ.xml", text);
    return complaints(run({"check", "own/organ.xml"}));
  };
  EXPECT_EQ(notesOf("2"), Notes{"note: the camera moves until 2 s, and the scene ends at 0.48 s"});
  EXPECT_EQ(notesOf("0.48"), Notes{});
}

TEST_F(RunNotes, JawsThatComeToWhereTheyCloseAndNoFurther) {
  EXPECT_EQ(notesOfGrips({0, 0.2, 0.5, 0}, 0.6),
            Notes{"note: the jaws of tool 'probe' come to where they close and no further: it grips nothing"});
  EXPECT_EQ(notesOfGrips({0, 0.2, 0.49, 0}, 0.6), Notes{});
}

TEST_F(RunNotes, NumbersThatAreRightInOtherUnits) {
  const auto notesWith = [&](const std::string& setting) {
    return complaints(run({"check", "own/organ.xml", "--set", setting}));
  };
  EXPECT_EQ(notesWith("tissue.t.young=6"), Notes{"note: Young's modulus of body 'organ' is 6 Pa; is it in that unit?"});
  EXPECT_EQ(notesWith("tissue.t.density=1.06"),
            Notes{"note: the density of body 'organ' is 1.06 kg/m3; is it in that unit?"});
  EXPECT_EQ(notesWith("dynamics.gravity=0 -9810 0"), Notes{"note: gravity is 9810 m/s2; is it in that unit?"});
}

TEST_F(RunNotes, SubstepsThatAreTooLongAreSaidBeforeTheRun) {
  const Notes notes = complaints(run({"check", "own/organ.xml", "--set", "dynamics.substeps=3"}));
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_TRUE(notes[0].starts_with("warning: substeps of ")) << notes[0];
  EXPECT_NE(notes[0].find(" are above the stable "), std::string::npos) << notes[0];
}

TEST_F(RunNotes, LinksThatBendFarMoreEasilyThanTheyTwist) {
  const std::string text = read("own/organ.xml");
  const auto notesOf = [&](const std::string& factors, const std::string& integrator) {
    std::string changed = text;
    changed.insert(changed.find("</body>"), "<links " + factors + "/>");
    folder.write("own/organ.xml", changed);
    return complaints(run({"check", "own/organ.xml", "--set", "dynamics.integrator=" + integrator}));
  };
  const Notes limp = notesOf("flexion=\"0.1\"", "explicit");
  ASSERT_EQ(limp.size(), 1u);
  EXPECT_TRUE(limp[0].starts_with("note: links of body 'organ' bend far more easily than they twist")) << limp[0];
  EXPECT_EQ(notesOf("flexion=\"0.1\"", "implicit"), Notes{});
  EXPECT_EQ(notesOf("flexion=\"0.1\" torsion=\"0.1\"", "explicit"), Notes{});
  EXPECT_EQ(notesOf("flexion=\"0.5\"", "explicit"), Notes{});
}

TEST_F(RunNotes, GoldenMomentsThatAreOnePictureAreNotValid) {
  expectRefused(run({"check", "own/organ.xml", "--set", "output.golden=0.2 0.21"}),
                "two golden moments are picture 5 at 25 Hz");
}

TEST_F(RunNotes, TissueTooStiffForExplicitSteps) {
  const auto notesOf = [&](const std::string& young, const std::string& integrator) {
    const Notes notes = complaints(run(
        {"check", "own/organ.xml", "--set", "tissue.t.young=" + young, "--set", "dynamics.integrator=" + integrator}));
    return std::count_if(notes.begin(), notes.end(), [](const std::string& note) {
      return note.starts_with("note: ") &&
             note.ends_with(
                 " substeps per second: tissue so stiff, or cells so small, run faster in implicit steps "
                 "(<dynamics integrator=\"implicit\"/>)");
    });
  };
  EXPECT_EQ(notesOf("1e10", "explicit"), 1);
  EXPECT_EQ(notesOf("1e10", "implicit"), 0);
  EXPECT_EQ(notesOf("1e4", "explicit"), 0);
}

TEST_F(RunNotes, AFinThatNoSphereReachesInto) {
  const auto notesWith = [&](const std::string& spheres) {
    const std::string dolphin = MEDULLA_SOURCE_DIR "/assets/dolphin/dolphin.obj";
    return complaints(run({"build", dolphin, "--spheres", spheres, "-o", "dolphin.model.xml"}));
  };
  const Notes few = notesWith("7");
  ASSERT_EQ(few.size(), 1u);
  EXPECT_NE(few[0].find(" of 562 surface nodes hang on what lies outside of their part of the body"),
            std::string::npos);
  EXPECT_EQ(notesWith("25"), Notes{});
}

TEST_F(RunNotes, AToolThatPressesASkinFeelsItTooHard) {
  const auto notesOf = [&](const std::string& surface) {
    return complaints(run({"replay", "own/organ.xml", "--set", "body.organ.surface=" + surface}));
  };
  EXPECT_EQ(notesOf("skin"),
            Notes{"note: tools acted on body 'organ', whose surface=\"skin\" does not yield by itself: "
                  "they feel it too hard; \"contact\" or \"full\" does"});
  EXPECT_EQ(notesOf("contact"), Notes{});
}

TEST_F(RunNotes, AToolThatSurfacesLeaveNoRoomFor) {
  LoadedScene loaded;
  loaded.scene.servoRate = 1000;
  loaded.scene.tools.resize(2);
  loaded.scene.tools[1].name = "probe";
  RunTotals totals;
  totals.squeezedTicks = {49, 60};
  testing::internal::CaptureStderr();
  printNotes(loaded, totals, World({}, {}, {}));
  const std::string told = testing::internal::GetCapturedStderr();
  EXPECT_TRUE(told.starts_with("note: for 0.06 s surfaces left tool 'probe' less than half of its radius: ")) << told;
  EXPECT_EQ(std::count(told.begin(), told.end(), '\n'), 1);
}

TEST_F(RunNotes, ACameraThatSeesNoBody) {
  const auto notesOf = [&](double target) {
    write({.cameraTarget = target});
    return complaints(run({"render", "own/organ.xml", "--still", "0.04", "--size", "64x48", "-o", "still.png"}));
  };
  EXPECT_EQ(notesOf(-0.05), Notes{});
  EXPECT_EQ(notesOf(0.3), Notes{"note: no body is in sight of the camera in any picture"});
}

TEST_F(RunNotes, APictureThatIsTooSmallForItsCaption) {
  const auto notesOf = [&](const char* size) {
    return complaints(
        run({"render", "own/organ.xml", "--still", "0.04", "--size", size, "--show", "caption", "-o", "still.png"}));
  };
  EXPECT_EQ(notesOf("320x240"), Notes{});
  EXPECT_EQ(notesOf("32x32"), Notes{"note: 1 of 1 pictures are too small for their caption"});
}

TEST_F(RunNotes, StaticShapesThatBodiesPassThroughOrThatAreOfAnotherUnit) {
  const std::string text = read("own/organ.xml");
  const auto notesOf = [&](const std::string& shape, const std::string& contact) {
    std::string changed = text;
    changed.insert(changed.find("<tool "), shape);
    changed.insert(changed.find("gravity="), "contact=\"" + contact + "\" ");
    folder.write("own/organ.xml", changed);
    return complaints(run({"check", "own/organ.xml"}));
  };
  const std::string plane = R"(<static shape="plane" position="0 -5 0" normal="0 1 0" look="matte" )";
  const Notes passed{
      "note: bodies pass through static shapes: <dynamics contact=\"balls\"> lets them lie on these, "
      "contact=\"false\" of the shapes ends this note"};
  EXPECT_EQ(notesOf(plane + "/>", "balls"), Notes{});
  EXPECT_EQ(notesOf(plane + "/>", "none"), passed);
  EXPECT_EQ(notesOf(plane + "contact=\"false\"/>", "none"), Notes{});
  const std::string liver = std::string(MEDULLA_SOURCE_DIR) + "/assets/liver/liver.obj";
  const auto mesh = [&](const std::string& unit) {
    return notesOf("<static shape=\"mesh\" mesh=\"" + liver + "\" unit=\"" + unit +
                       "\" position=\"0 -9 0\" look=\"liver\" contact=\"false\"/>",
                   "balls");
  };
  EXPECT_EQ(mesh("m"), Notes{});
  const Notes small = mesh("mm");
  ASSERT_EQ(small.size(), 1);
  EXPECT_TRUE(small[0].starts_with("note: " + liver)) << small[0];
  EXPECT_TRUE(small[0].ends_with(" m in all; is its unit right?")) << small[0];
}

TEST_F(RunNotes, AMotionThatDoesNotFitTheScene) {
  const auto notesOf = [&](const std::string& verb, double from, double to, const std::string& more = "") {
    folder.write("own/organ.csv", fmt::format("t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n{},0,0,0.5,1,0,0,0,0\n"
                                              "{},0,0,0.4,1,0,0,0,0\n{},0,0,0.4,1,0,0,0,0\n",
                                              from, to, to + 50));  // still at the end, of which nothing is missed
    std::vector<std::string> words{verb, "own/organ.xml"};
    if (!more.empty()) words.insert(words.end(), {"--set", more, "--set", "output.golden=0"});
    Notes notes = complaints(run(words));
    std::erase(notes, "note: tool 'probe' touched nothing in its whole motion");
    return notes;
  };
  const std::string end = " s of the motion of tool 'probe' are not played: the scene is 0 to 0.48 s";
  EXPECT_EQ(notesOf("check", 0, 0.9), Notes{});
  EXPECT_EQ(notesOf("check", 0, 1.2), Notes{"note: 0.72 of 1.2" + end});
  EXPECT_EQ(notesOf("replay", 0, 1.2), Notes{"note: 0.72 of 1.2" + end});
  EXPECT_EQ(notesOf("check", -2, 0.4), Notes{"note: 2 of 2.4" + end});
  EXPECT_EQ(notesOf("replay", 0, 1.2, "clock.duration=0.04"), Notes{});  // one who shortens a scene knows
  EXPECT_EQ(notesOf("check", 0.5, 0.6), Notes{});
  const std::string late = "note: tool 'probe' stands still until 3 s, where own/organ.csv begins";
  EXPECT_EQ(notesOf("check", 3, 5), (Notes{late, "note: 2 of 2" + end}));
  EXPECT_EQ(notesOf("check", 3, 5, "clock.duration=6"), Notes{late});
  // Who describes a recording has said when it begins.
  notesOf("check", 3, 5);
  folder.write("own/hand.xml",
               "<recording file='organ.csv'><columns time='1' position='2 3 4'/><span delay='3'/></recording>");
  const Notes delayed = complaints(run({"check", "own/organ.xml", "--trajectory", "own/hand.xml"}));
  EXPECT_EQ(delayed, Notes{"note: 2 of 2" + end});
  const ProgramResult still = run({"render", "own/organ.xml", "--trajectory", "own/hand.xml", "--still", "0.04",
                                   "--size", "64x48", "-o", "still.png"});
  EXPECT_EQ(complaints(still), Notes{});
}

TEST_F(RunNotes, AToolThatStartsInsideABodyIsNamedWithItsDepth) {
  const auto startOf = [&](double z, int grip) {
    const std::string rest = fmt::format(",-0.0525,-0.0385,{},1,0,0,0,{}\n", z, grip);
    folder.write("own/organ.csv", "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n0" + rest + "0.4" + rest);
    const ProgramResult r = run({"check", "own/organ.xml"});
    EXPECT_EQ(r.exitCode, 0) << r.err;
    return complaints(r);
  };
  const auto depthOf = [](const Notes& notes) {
    const std::string words = "warning: tool 'probe' reaches ";
    if (notes.size() != 1 || !notes[0].starts_with(words)) return 0.;
    EXPECT_NE(notes[0].find(" mm into body 'organ' at the start"), std::string::npos) << notes[0];
    return std::stod(notes[0].substr(words.size()));
  };
  EXPECT_EQ(startOf(0.05, 0), Notes{});
  const Notes deep = startOf(0.012, 0);
  EXPECT_GT(depthOf(deep), 2);
  EXPECT_GT(depthOf(deep), depthOf(startOf(0.015, 0)));
  EXPECT_EQ(startOf(0.012, 1), Notes{});  // closed, it holds what it is in
  startOf(0.012, 0);
  for (const auto& words : {std::vector<std::string>{"replay", "own/organ.xml"},
                            {"render", "own/organ.xml", "--still", "0", "--size", "64x48", "-o", "still.png"}})
    EXPECT_EQ(complaints(run(words)), deep) << words[0];
}

TEST_F(RunNotes, ShippedScenesHaveNone) {
  const std::string scenes = std::string(MEDULLA_SOURCE_DIR) + "/scenes";
  for (const auto& entry : std::filesystem::recursive_directory_iterator(scenes)) {
    if (entry.path().extension() != ".xml" || readFile(entry.path().string()).find("<scene") == std::string::npos)
      continue;
    const ProgramResult r = run({"check", entry.path().string()});
    EXPECT_EQ(r.exitCode, 0) << r.err;
    EXPECT_EQ(complaints(r), Notes{}) << entry.path();
  }
}

TEST_F(RunNotes, AToolThatBeginsClosedInTissueHoldsItAtRest) {
  folder.write("own/organ.csv",
               "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n0,-0.0525,-0.0385,0.019,1,0,0,0,1\n"
               "0.2,-0.0525,-0.0385,0.019,1,0,0,0,1\n");
  const ProgramResult r = run({"replay", "own/organ.xml"});
  EXPECT_EQ(complaints(r), Notes{});
  EXPECT_NE(r.out.find("impulse_mismatch 0 %"), std::string::npos) << r.out;
}

// Led so hard that its links fold, whatever the step. The tool is out of its way: what folds when is chance.
TEST_F(RunNotes, ABodyThatCrept) {
  folder.write("own/organ.csv", "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n0,0,0,0.5,1,0,0,0,0\n0.4,0,0,0.5,1,0,0,0,0\n");
  std::string text = read("own/organ.xml");
  const std::string fix = "<fix spheres=\"1\"/>", gravity = "gravity=\"0 0 0\"";
  text.replace(
      text.find(fix), fix.size(),
      fix + R"(<drive sphere="5" dof="all" axis="0 1 0" amplitude="0.2" frequency="40" phase="0" velocity="0 0 0"/>)");
  text.replace(text.find(gravity), gravity.size(), gravity + " integrator=\"implicit\"");
  folder.write("own/organ.xml", text);
  Notes notes = complaints(run({"replay", "own/organ.xml"}));
  std::erase(notes, "note: tool 'probe' touched nothing in its whole motion");
  ASSERT_EQ(notes.size(), 1);
  EXPECT_EQ(notes[0].find("note: 'organ' crept on without speed where implicit steps failed, in "), 0) << notes[0];
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

TEST_F(RunNotes, ASkinOfWhichEverySphereIsHeld) {
  std::string text = read("own/organ.xml");
  text.replace(text.find("spheres=\"1\""), 11, "spheres=\"0 1 2 3 4 5 6\"");
  folder.write("own/organ.xml", text);
  const auto notesOf = [&](const std::string& surface) {
    return complaints(run({"check", "own/organ.xml", "--set", "body.organ.surface=" + surface}));
  };
  const std::string rigid =
      "note: body 'organ' is rigid: all its spheres are held, and surface=\"skin\" moves with these alone";
  const Notes skin = notesOf("skin"), full = notesOf("full");
  EXPECT_EQ(std::count(skin.begin(), skin.end(), rigid), 1);
  EXPECT_EQ(std::count(full.begin(), full.end(), rigid), 0);
}

TEST_F(RunNotes, LoadsThatDoNothing) {
  const std::string text = read("own/organ.xml"), fix = "<fix spheres=\"1\"/>";
  const auto notesOf = [&](const std::string& fixesAndLoads) {
    std::string changed = text;
    folder.write("own/organ.xml", changed.replace(changed.find(fix), fix.size(), fixesAndLoads));
    return complaints(run({"check", "own/organ.xml"}));
  };
  const std::string end = "<fix sphere='-0.0525 -0.0385 0.02 0.012'/>",
                    load = "<load sphere='-0.0525 -0.0385 0.02 0.012' force='0 0 -0.1'";
  EXPECT_EQ(notesOf(fix + load + " to='0.4'/>"), Notes{});
  EXPECT_EQ(notesOf(fix + load + "/>"),
            Notes{"note: a load on body 'organ' grows until 1 s, and the scene ends at 0.48 s, at 48 % of it"});
  const std::string elsewhere = "<load sphere='-0.06 -0.07 0.02 0.03' force='0 0 -0.1' to='0.4'/>";
  EXPECT_EQ(notesOf(end + load + " to='0.4'/>" + elsewhere).size(), 1u);
  EXPECT_EQ(notesOf(end + load + " to='0.4'/>"), Notes{"note: a load on body 'organ' acts where it is held"});
  EXPECT_EQ(notesOf(fix + load + " from='0.48' to='1'/>"),
            Notes{"note: a load on body 'organ' begins at 0.48 s, and the scene ends at 0.48 s"});
}

TEST_F(RunNotes, AModelWhoseIdentifiedLinksAreNotTaken) {
  const auto notesOf = [&](const std::string& links) {
    folder.write("own/liver.xml", fmt::format(R"(<scene name="liver"><clock duration="0.1"/>
<tissue name="t" young="5e3"/><body name="liver" tissue="t" look="liver" model="{}/assets/liver/liver.model.xml" {}/>
<camera position="0 0 0.4" target="0 0 0"/></scene>)",
                                              MEDULLA_SOURCE_DIR, links));
    return complaints(run({"check", "own/liver.xml"}));
  };
  EXPECT_EQ(notesOf("links=\"beam\""), Notes{});
  EXPECT_EQ(notesOf(""), Notes{"note: body 'liver' has beams, though its model has identified links: "
                               "links=\"identified\" takes these, links=\"beam\" ends this note"});
}

}  // namespace
}  // namespace medulla
