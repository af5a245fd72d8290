#include <fcntl.h>
#include <sys/stat.h>

#include <thread>

#include "app/files/text_file.h"
#include "tests/own_scene.h"

// What users hand the program by mistake: one line, the exit code, nothing written and nothing harmed.
namespace medulla {
namespace {

class BadInput : public OwnScene {
 protected:
  // The scene with one more element, in its first line.
  void add(const std::string& element) const {
    std::string text = read("own/organ.xml");
    folder.write("own/organ.xml", text.insert(text.find('\n'), element));
  }
};

TEST_F(BadInput, AStaticMeshBeyondWhatCanBeDrawnIsRefused) {
  folder.write("own/far.obj", "v 1e39 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n");
  add("<static shape='mesh' mesh='far.obj' look='wall'/>");
  expectRefused(run({"check", "own/organ.xml"}),
                "own/organ.xml:1: own/far.obj reaches 1e+39 m from its origin, expected at most 1000 m");
}

TEST_F(BadInput, NothingIsWrittenToStandardOutputOrToAFolderThatIsCalledAsAModel) {
  expectRefused(run({"render", "own/organ.xml", "-o", "-"}), "-: is no file");
  expectRefused(run({"replay", "own/organ.xml", "--log", "-"}), "-: is no file");
  folder.write("a.obj", "");
  expectRefused(run({"build", "a.obj", "own/a.obj", "-o", "both.xml"}),
                "both.xml: expected the name of a folder for the models of 2 meshes");
  EXPECT_FALSE(std::filesystem::exists(folder / "-"));
  EXPECT_FALSE(std::filesystem::exists(folder / "both.xml"));
}

TEST_F(BadInput, AMeshThatIsFarTooLargeIsRefusedInOneLine) {
  folder.write("m.obj", "v 1e7 0 0\nv 0 1e7 0\nv 0 0 1e7\nv 0 0 0\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n");
  expectRefused(run({"build", "m.obj", "-o", "m.xml"}), "is the unit right?");
}

TEST_F(BadInput, AMeshThatIsDrawnMuchSmallerThanItIsIsNoted) {
  folder.write("m.obj",
               "v 0.1 0 0\nv -0.1 0 0\nv 0 0.1 0\nv 0 -0.1 0\nv 0 0 0.1\nv 0 0 -0.1\nf 1 3 5\nf 3 2 5\nf 2 4 5\n"
               "f 4 1 5\nf 3 1 6\nf 2 3 6\nf 4 2 6\nf 1 4 6\n");
  const auto noteOf = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"build", "m.obj", "-o", "m.xml", "--spheres", "1"});
    const ProgramResult r = run(words);
    EXPECT_EQ(r.exitCode, 0) << r.err;
    EXPECT_NE(r.out.find("drawn_inside_max "), std::string::npos);
    const std::size_t at = r.err.find("m.obj: note: the drawn surface lies up to ");
    return at == std::string::npos ? "" : r.err.substr(at, r.err.find('\n', at) - at);
  };
  EXPECT_NE(noteOf({}).find("medulla build --fine m.obj"), std::string::npos);
  EXPECT_EQ(noteOf({"--fine", "m.obj"}), "");
}

TEST_F(BadInput, CheckWarnsOfWhatRunsWarnOf) {
  EXPECT_EQ(run({"check", "own/organ.xml"}).err, "");
  add(fmt::format("<body name='twin' tissue='t' look='liver' model='{}/assets/gallbladder/gallbladder.model.xml'/>",
                  MEDULLA_SOURCE_DIR));
  const std::vector<std::string> changes{"--set", "dynamics.sleep_after=1",    "--set", "dynamics.integrator=implicit",
                                         "--set", "clock.duration=0.02",       "--set", "output.golden=0",
                                         "--set", "body.organ.surface=contact"};
  const auto warnings = [&](const char* verb) {
    std::vector<std::string> words{verb, "own/organ.xml"};
    words.insert(words.end(), changes.begin(), changes.end());
    const ProgramResult r = run(words);
    EXPECT_EQ(r.exitCode, 0) << r.err;
    return complaints(r);
  };
  const std::vector<std::string> found = warnings("check");
  EXPECT_EQ(found, warnings("replay"));
  ASSERT_EQ(found.size(), 3u);
  EXPECT_TRUE(found[0].starts_with("warning: bodies 'twin' and 'organ' overlap by ")) << found[0];
  EXPECT_TRUE(found[2].starts_with("note: surface=\"contact\" is \"full\"")) << found[2];
}

// Where bodies settle first nothing is known yet of what they have settled to.
TEST_F(BadInput, CheckWarnsOfABuriedToolOnlyWhereBodiesDoNotSettle) {
  folder.write(
      "own/organ.csv",
      "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n0,-0.0525,-0.0385,0.02,1,0,0,0,0\n0.4,-0.0525,-0.0385,0.02,1,0,0,0,0\n");
  const std::string at = "warning: tool 'probe' reaches ";
  EXPECT_EQ(run({"check", "own/organ.xml"}).err.substr(0, at.size()), at);
  EXPECT_EQ(run({"check", "own/organ.xml", "--set", "clock.settle=0.1"}).err, "");
  EXPECT_EQ(run({"replay", "own/organ.xml", "--set", "clock.settle=0.1"}).err.substr(0, at.size()), at);
}

TEST_F(BadInput, WhatAnOverrideMakesImpossibleIsSaidOfIt) {
  const std::string text = read("own/organ.xml"), fix = "<fix spheres=\"1\"/>";
  std::string changed = text;
  changed.replace(text.find(fix), fix.size(),
                  "<fix box='-1 -1 -1 1 1 1'/><load force='0 0 1' plane='0 0 1 0.04'/><links torsion='2'/>");
  folder.write("own/organ.xml", changed);
  for (const auto& [path, value, words] :
       {std::array{"fix.box", "2 2 2 3 3 3", "no surface node of body \"organ\" lies in here"},
        {"load.plane", "0 0 1 -9", "no surface node of body \"organ\" lies in here"},
        {"links.box", "2 2 2 3 3 3", "no link of body \"organ\" has its middle in here"},
        {"links", "identified", "body \"organ\" has identified links, and its model "}}) {
    const std::string option = fmt::format("body.organ.{}", path);
    expectRefused(run({"check", "own/organ.xml", "--set", option + "=" + value}),
                  fmt::format("medulla: --set {}: {}", option, words));
  }
}

// Programs write a scene in one line.
TEST_F(BadInput, AnOverrideIsNotBlamedForWhatStandsInTheSameLine) {
  add("<body name='twin' tissue='t' look='liver' model='none.xml'/>");
  std::string text = read("own/organ.xml");
  std::replace(text.begin(), text.end(), '\n', ' ');
  folder.write("own/organ.xml", text);
  const std::string model = MEDULLA_SOURCE_DIR "/assets/gallbladder/gallbladder.model.xml";
  const auto refusal = [&](const std::string& setting) {
    return complaints(run({"check", "own/organ.xml", "--set", setting}));
  };
  const std::vector<std::string> expected{
      "medulla: own/organ.xml:1: model of body \"twin\" \"own/none.xml\" does not exist"};
  EXPECT_EQ(refusal("body.organ.model=" + model), expected);
  EXPECT_EQ(refusal("tissue.t.young=6e3"), expected);
  EXPECT_EQ(refusal("body.twin.model=nothing.xml"),
            std::vector<std::string>{
                "medulla: --set body.twin.model: model of body \"twin\" \"own/nothing.xml\" does not exist"});
}

TEST_F(BadInput, ATissueTooStiffForAnyStepIsRefusedWhereItStands) {
  const std::string message = "body 'organ' cannot be simulated: its stable substep is ";
  expectRefused(run({"check", "own/organ.xml", "--set", "tissue.t.young=1e20"}), "--set tissue.t.young: " + message);
  expectRefused(run({"check", "own/organ.xml", "--set", "tissue.t.young=1e30"}), "--set tissue.t.young: " + message);
  write({.young = "1e20"});
  expectRefused(run({"check", "own/organ.xml"}), "own/organ.xml:2: " + message);
}

TEST_F(BadInput, ResultsThatCannotBeWrittenFailTheRun) {
  ProgramOptions full;
  full.output = "/dev/full";
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"check", "own/organ.xml"},
        {"info", "own/organ.xml"},
        {"render", "own/organ.xml", "--still", "0", "--size", "64x48", "--quality", "draft"}})
    expectRefused(run(words, full), "standard output cannot be written");
  const std::string mesh = MEDULLA_SOURCE_DIR "/assets/gallbladder/gallbladder.obj";
  const ProgramResult made = run({"new", mesh, "--spheres", "5", "-o", "begun"}, full);
  EXPECT_EQ(made.exitCode, 1);
  EXPECT_NE(made.err.find("standard output cannot be written"), std::string::npos) << made.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "begun"));
}

TEST_F(BadInput, APipeThatNobodyFillsEndsAtAnInterrupt) {
  ASSERT_EQ(::mkfifo((folder / "pipe.xml").c_str(), 0600), 0);
  int writer = -1;
  ProgramOptions interrupted;
  interrupted.interruptWhen = [&] {  // once somebody reads
    writer = ::open((folder / "pipe.xml").c_str(), O_WRONLY | O_NONBLOCK);
    return writer >= 0;
  };
  EXPECT_EQ(run({"check", "pipe.xml"}, interrupted).exitCode, 130);
  ::close(writer);
}

TEST_F(BadInput, APipeIsReadToItsEnd) {
  const std::string path = folder / "pipe", text(1 << 20, 'x');
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  const std::jthread writer([&] { folder.write("pipe", text); });
  EXPECT_EQ(readTextFile(path), text);
}

// A run of less than one picture has one; a camera that sees next to nothing is none.
TEST_F(BadInput, TinyTimesAndAnglesOfViewDoNotEndTheProgram) {
  const ProgramResult brief = run({"render", "own/organ.xml", "-o", "brief", "--set", "clock.duration=1e-12", "--set",
                                   "output.golden=0", "--size", "64x64"});
  EXPECT_EQ(brief.exitCode, 0) << brief.err;
  EXPECT_NE(brief.out.find("pictures 1\n"), std::string::npos) << brief.out;
  expectRefused(run({"check", "own/organ.xml", "--set", "camera.fov=1e-36"}), "expected 1 number >= 0.01 and < 180");
}

TEST_F(BadInput, OutputsThatAreCalledAsAnotherKindOfFileAreWrongUsage) {
  const std::string mesh = MEDULLA_SOURCE_DIR "/tests/accuracy/cylinder.obj";
  const std::string victim = read("own/organ.xml");
  for (const auto& [option, ending] :
       {std::pair("--log", ".csv"), {"--frame-times", ".csv"}, {"--record", ".csv"}, {"--cache", ".cache"}})
    expectRefused(run({"replay", "own/organ.xml", option, "own/organ.xml"}),
                  fmt::format("{} own/organ.xml: expected a file that ends in {}", option, ending), 2);
  expectRefused(run({"replay", "own/organ.xml", "--record", "probe=own/organ.xml"}), "ends in .csv", 2);
  expectRefused(run({"render", "own/organ.xml", "--log", "{scene}.obj", "-o", "a.mp4"}), "--log organ.obj: expected",
                2);
  expectRefused(run({"render", "own/organ.xml", "--log", "own/{scene}.xml", "-o", "a.mp4"}), "ends in .csv", 2);
  for (const std::string ending : {".txt", ""}) {
    folder.write("organ" + ending, "mine");
    for (const char* option : {"--log", "--frame-times", "--record"})
      expectRefused(run({"render", "own/organ.xml", option, "{scene}" + ending, "-o", "a.mp4"}), "does not exist yet",
                    2);
    EXPECT_EQ(read("organ" + ending), "mine");
    std::filesystem::remove(folder / ("organ" + ending));
  }
  expectRefused(run({"replay", "own/organ.xml", "--surface-at", "end", "own/organ.xml"}), "ends in .obj", 2);
  expectRefused(run({"build", mesh, "-o", "own/organ.ply"}), "-o own/organ.ply: expected a file that ends in .xml", 2);
  expectRefused(run({"build", mesh, "-o", "m.xml", "--report", "own/organ.xml"}), "--report own/organ.xml: exp", 2);
  for (const char* other : {"own/notes.md", "own/main.cpp", "own/scene.xsd"})
    expectRefused(run({"replay", "own/organ.xml", "--log", other}), "ends in .csv", 2);
  EXPECT_EQ(read("own/organ.xml"), victim);
  EXPECT_EQ(folder.contents(), std::vector<std::string>{"own"});
  EXPECT_EQ(run({"replay", "own/organ.xml", "--log", "own/log.txt"}).exitCode, 0);
  folder.write("photo.jpg", "seen once");
  for (const char* name : {"photo.jpg", "own/organ.XML"})
    expectRefused(run({"replay", "own/organ.xml", "--log", name}), "expected a file that ends in .csv", 2);
  EXPECT_EQ(read("photo.jpg"), "seen once");
}

TEST_F(BadInput, AReportIsNotWrittenOverTheVerticesThatAreHeld) {
  const std::string mesh = MEDULLA_SOURCE_DIR "/tests/accuracy/cylinder.obj";
  folder.write("held.csv", "0\n1\n");
  expectRefused(run({"build", mesh, "-o", "m.xml", "--identify", "--fix", "vertices=held.csv", "--report", "held.csv"}),
                "held.csv: would be written over an input");
}

TEST_F(BadInput, AModelReplacesNoOtherXml) {
  const std::string mesh = MEDULLA_SOURCE_DIR "/tests/accuracy/cylinder.obj";
  folder.write("notes.xml", "not even XML");
  for (const char* name : {"own/organ.xml", "notes.xml"}) {
    const std::string victim = read(name);
    expectRefused(run({"build", mesh, "-o", name, "--spheres", "1"}),
                  std::string(name) + ": is no model: expected one to replace");
    EXPECT_EQ(read(name), victim);
  }
  for (const char* again : {"first", "second"})
    EXPECT_EQ(run({"build", mesh, "-o", "m.xml", "--spheres", "1"}).exitCode, 0) << again;
}

TEST_F(BadInput, DevicesAndPipesAreNoFiles) {
  expectRefused(run({"check", "/dev/zero"}), "/dev/zero: is a device, expected a file or a pipe");
  expectRefused(run({"replay", "own/organ.xml", "--trajectory", "/dev/zero"}), "/dev/zero: is a device");
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  expectRefused(run({"render", "own/organ.xml", "--cache", "pipe", "-o", "frames"}), "pipe: is not a file");
}

TEST_F(BadInput, TwoFilesForOneToolAreRefused) {
  for (const auto& [option, file] : {std::pair("--record", "r.csv"), std::pair("--trajectory", "own/organ.csv")})
    expectRefused(run({"replay", "own/organ.xml", option, file, option, "probe=q.csv"}), "one file per tool");
  EXPECT_EQ(folder.contents(), std::vector<std::string>{"own"});
}

TEST_F(BadInput, StabilityWritesOverNoInput) {
  std::string text = read("own/organ.xml");
  text.replace(text.find("spheres=\"1\""), 11, "vertices=\"map.csv\"");
  folder.write("own/organ.xml", text);
  folder.write("own/map.csv", "0\n1\n2\n");
  expectRefused(run({"stability", "own/organ.xml", "-o", "own"}), "own/map.csv: would be written over an input");
  EXPECT_EQ(read("own/map.csv"), "0\n1\n2\n");
}

TEST_F(BadInput, WhatChartsAndStabilityCannotWriteIsSaidBeforeAnyRun) {
  std::filesystem::create_directories(folder / "out/chart.svg");
  std::filesystem::create_directories(folder / "out/trials.csv");
  expectRefused(run({"chart", "own/organ.xml", "-o", "out"}), "out/chart.svg: is a folder");
  expectRefused(run({"stability", "own/organ.xml", "-o", "out"}), "out/trials.csv: is a folder");
}

TEST_F(BadInput, StabilityOfWhatIsHeldWholeIsRefused) {
  std::string text = read("own/organ.xml");
  text.replace(text.find("spheres=\"1\""), 11, "sphere=\"0 0 0 9\"");
  folder.write("own/organ.xml", text);
  expectRefused(run({"stability", "own/organ.xml", "-o", "out"}), "all of body 'organ' is held");
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

TEST_F(BadInput, AChartOfStiffTissueSaysWhichStepsAreTooMany) {
  expectRefused(run({"chart", "own/organ.xml", "-o", "out", "--methods", "full", "--steps", "auto", "--set",
                     "tissue.t.young=1e12"}),
                "full asks for ");
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

TEST_F(BadInput, AChartOfWhatDoesNotMoveIsRefused) {
  folder.write("own/organ.csv", "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n0,0.5,0.5,0.5,1,0,0,0,0\n");
  expectRefused(
      run({"chart", "own/organ.xml", "-o", "out", "--steps", "2", "--methods", "skin", "--set", "clock.duration=0.04"}),
      "nothing moves in this scene");
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

TEST_F(BadInput, FoldersMadeForAFailedCommandGoAgain) {
  folder.write("a.obj", "");
  folder.write("b.obj", "");
  expectRefused(run({"build", "a.obj", "b.obj", "-o", "x/y/z"}), "a.obj: is empty");
  folder.write("empty.csv", "\n");
  expectRefused(run({"info", "empty.csv"}), "empty.csv: is empty, expected a scene, a model or a table");
  expectRefused(run({"golden", "none.xml", "--dir", "golden", "--failures", "u/v"}), "none.xml");
  expectRefused(run({"render", "own/organ.xml", "-o", "p/q/frames", "--set", "dynamics.substeps=1", "--set",
                     "tissue.t.young=1e9"}),
                "finite");
  for (const char* film : {"v/w/film.webm", "v/film.gif"}) {
    expectRefused(
        run({"render", "own/organ.xml", "-o", film, "--set", "dynamics.substeps=1", "--set", "tissue.t.young=1e9"}),
        "finite");
    expectRefused(run({"render", "own/organ.xml", "-o", film, "-o", "v/wrong.txt"}), "v/wrong.txt: expected FILE.mp4");
  }
  for (const char* name : {"x", "u", "p", "v"}) EXPECT_FALSE(std::filesystem::exists(folder / name)) << name;
}

TEST_F(BadInput, EmptyWordsAreWrongUsage) {
  expectRefused(run({"replay", "own/organ.xml", "--log", ""}), "--log ''", 2);
  expectRefused(run({"replay", "own/organ.xml", "--log="}), "--log=", 2);
  for (const char* option : {"--record", "--trajectory"})
    expectRefused(run({"replay", "own/organ.xml", option, "probe="}), "probe=: expected a file behind the =", 2);
  expectRefused(run({"render", "own/organ.xml", "-o", ""}), "-o ''", 2);
  EXPECT_EQ(folder.contents(), std::vector<std::string>{"own"});
}

TEST_F(BadInput, NumbersOfABuildThatAreNoneAreWrongUsage) {
  const std::string mesh = MEDULLA_SOURCE_DIR "/tests/accuracy/cylinder.obj";
  for (const char* option : {"--gap", "--overshoot", "--surface-mass"})
    expectRefused(run({"build", mesh, "-o", "m.xml", option, "nan"}), option, 2);
  for (const char* poisson : {"nan", "0.5", "-0.1"})
    expectRefused(run({"build", mesh, "-o", "m.xml", "--identify", "--poisson", poisson}),
                  std::string(poisson) + ": expected a number from 0 to less than 0.5", 2);
  expectRefused(run({"build", mesh, "-o", "m.xml", "--identify", "--spheres", "301"}), "at most 300", 2);
}

TEST_F(BadInput, WholeNumbersAreDecimalWhateverStandsBeforeThem) {
  const std::string mesh = MEDULLA_SOURCE_DIR "/assets/gallbladder/gallbladder.obj";
  for (const char* ten : {"010", "+10", "10"}) {
    const ProgramResult r = run({"build", mesh, "-o", "m.xml", "--spheres", ten});
    EXPECT_EQ(valueOf(r.out, "spheres"), "10") << ten << ": " << r.err;
  }
}

TEST_F(BadInput, WhatSaysNothingOfASkeletonIsWrongUsageWithIt) {
  const std::string mesh = MEDULLA_SOURCE_DIR "/assets/gallbladder/gallbladder.obj";
  for (const auto& [option, value] : {std::pair("--spheres", "7"), {"--overshoot", "0"}, {"--gap", "5"}})
    expectRefused(run({"build", mesh, "-o", "m.xml", "--method", "skeleton", option, value}),
                  std::string(option) + " " + value + ": expected --method cover", 2);
  const ProgramResult r = run({"build", mesh, "-o", "m.xml", "--method", "skeleton"});
  EXPECT_EQ(r.exitCode, 0) << r.err;
  ASSERT_EQ(complaints(r).size(), 1u) << r.err;  // that they cover little
  EXPECT_NE(r.err.find("of the volume\n"), std::string::npos) << r.err;
}

TEST_F(BadInput, ASkeletonThatLeavesItsMeshIsRefused) {
  folder.write("tet.obj", "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  expectRefused(run({"build", "tet.obj", "-o", "m.xml", "--method", "skeleton"}), "no sphere fits there");
  EXPECT_FALSE(std::filesystem::exists(folder / "m.xml"));
}

}  // namespace
}  // namespace medulla
