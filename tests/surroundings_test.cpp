#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/own_scene.h"

// What a shell hands to the program besides its words: standard streams, signals that are ignored, pipes, links.
namespace medulla {
namespace {

namespace fs = std::filesystem;

class Surroundings : public OwnScene {
 protected:
  // The exit code of a line for bash, in the test's folder; $M is the program.
  int shell(const std::string& line) const {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_DFL);  // a shell cannot undo SIG_IGN
    folder.write("line.sh", "M='" MEDULLA_PROGRAM "'\ncd \"$(dirname \"$0\")\"\n" + line + "\n");
    const int status = std::system(("bash '" + (folder / "line.sh") + "' > /dev/null 2>&1").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
};

TEST_F(Surroundings, NotesDoNotGoIntoAFileWhereStandardErrorIsClosed) {
  // A tool that starts inside of the body: what is said of it comes once the log is open.
  folder.write("in.csv",
               "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n0,-0.041,-0.041,0.005,1,0,0,0,0\n"
               "0.2,-0.041,-0.041,0.005,1,0,0,0,0\n");
  EXPECT_EQ(shell("$M replay own/organ.xml --trajectory in.csv --log closed.csv 2>&-"), 0);
  EXPECT_EQ(shell("$M replay own/organ.xml --trajectory in.csv --log open.csv 2> notes"), 0);
  EXPECT_NE(read("notes").find("at the start"), std::string::npos);
  EXPECT_EQ(read("closed.csv"), read("open.csv"));
  EXPECT_EQ(shell("$M check own/organ.xml >&-"), 1);
}

// A run long enough for one, on a terminal.
TEST_F(Surroundings, ABarLeavesItsLineBeforeAnythingElseIsTold) {
  EXPECT_EQ(shell("script -qec \"$M replay own/organ.xml --set clock.duration=120\" terminal"), 0);
  const std::string told = read("terminal"), bar = " s left";
  if (told.find(bar) == std::string::npos) GTEST_SKIP() << "over before a bar is drawn";
  for (std::size_t at = told.find(bar); at != std::string::npos; at = told.find(bar, at + 1))
    EXPECT_EQ(told.substr(at + bar.size(), 4), "\r\x1b[K") << told.substr(at, 60);
}

TEST_F(Surroundings, NotesThatCannotBeWrittenAreLostAndNothingElse) {
  folder.write("none.csv", "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n0,1,1,1,1,0,0,0,0\n0.1,1,1,1,1,0,0,0,0\n");
  EXPECT_EQ(shell("$M replay own/organ.xml --trajectory none.csv 2> /dev/full > results"), 0);
  EXPECT_NE(read("results").find("hash"), std::string::npos);
  EXPECT_EQ(shell("$M replay own/organ.xml --trajectory none.csv --log a.csv 2>&1 > results | true\n"
                  "exit ${PIPESTATUS[0]}"),
            0);
  EXPECT_TRUE(fs::exists(folder / "a.csv"));
}

TEST_F(Surroundings, AReaderOfResultsWhoLeavesEndsTheRunAfterItsWork) {
  EXPECT_EQ(shell("$M replay own/organ.xml --log a.csv | true; exit ${PIPESTATUS[0]}"), 128 + SIGPIPE);
  EXPECT_EQ(folder.contents().size(), 3u);
  EXPECT_TRUE(fs::exists(folder / "a.csv"));
  // Of more results than a buffer holds some are written before the end.
  EXPECT_EQ(shell("$M info '" MEDULLA_SOURCE_DIR "/scenes/heap.xml' | true; exit ${PIPESTATUS[0]}"), 128 + SIGPIPE);
}

TEST_F(Surroundings, SignalsThatAreIgnoredStayIgnored) {
  write({.golden = "0", .duration = 2});
  const std::string render =
      "$M render own/organ.xml --size 96x64 -o film.gif & P=$!\n"
      "until ls film.gif.*; do sleep 0.01; done; kill ";
  EXPECT_EQ(shell("trap '' HUP\n" + render + "-HUP $P; wait $P"), 0);
  EXPECT_TRUE(fs::remove(folder / "film.gif"));
  EXPECT_EQ(shell(render + "-HUP $P; wait $P"), 130);
  EXPECT_FALSE(fs::exists(folder / "film.gif"));
}

TEST_F(Surroundings, PipesAreReadOnce) {
  EXPECT_EQ(shell("cat '" MEDULLA_SOURCE_DIR "/assets/gallbladder/gallbladder.model.xml' | $M info /dev/stdin"), 0);
  const std::string replay = "$M replay own/organ.xml --trajectory <(cat own/organ.csv) --cache a.cache\n";
  EXPECT_EQ(shell(replay + "$M render own/organ.xml --trajectory <(cat own/organ.csv) --cache a.cache --frames 0:1 "
                           "--size 64x48 -o a"),
            0);
  folder.write("other.csv", "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n0,1,1,1,1,0,0,0,0\n0.1,1,1,1,1,0,0,0,0\n");
  EXPECT_EQ(shell("$M render own/organ.xml --trajectory <(cat other.csv) --cache a.cache --frames 0:1 --size 64x48 "
                  "-o b"),
            1);
  EXPECT_EQ(shell("mkfifo pipe; cat own/organ.csv > pipe & "
                  "$M replay own/organ.xml --trajectory pipe --cache b.cache"),
            0);
  EXPECT_EQ(read("a.cache"), read("b.cache"));
}

TEST_F(Surroundings, ALogIsNotWrittenWhereResultsGo) {
  EXPECT_EQ(shell("$M replay own/organ.xml --log /dev/stdout > both; exit $?"), 1);
  EXPECT_EQ(read("both"), "");
}

TEST_F(Surroundings, GoldenImagesBehindLinksFindTheirScenes) {
  fs::create_directories(folder / "far/away/pictures");
  fs::create_directory_symlink("far/away/pictures", folder / "golden");
  fs::create_symlink("own/organ.xml", folder / "organ.xml");
  fs::copy(folder / "own/organ.csv", folder / "organ.csv");  // beside the link
  EXPECT_EQ(shell("$M golden --dir golden --update organ.xml"), 0);
  EXPECT_EQ(shell("$M golden --dir golden"), 0);
  EXPECT_EQ(shell("$M golden --dir golden organ.xml"), 0);
  write({.golden = "0.4"});
  for (const char* scene : {"own/organ.xml", "organ.xml"})
    EXPECT_EQ(shell(std::string("$M golden --dir golden ") + scene), 3) << scene;
  EXPECT_EQ(shell("$M golden --dir golden --update organ.xml"), 0);
  EXPECT_FALSE(fs::exists(folder / "golden/organ_8.png"));
  EXPECT_TRUE(fs::exists(folder / "golden/organ_10.png"));
}

TEST_F(Surroundings, AGoldenSceneByALinkOfAnotherNameIsFoundUnderThat) {
  fs::create_symlink("own/organ.xml", folder / "alias.xml");
  fs::copy(folder / "own/organ.csv", folder / "organ.csv");  // beside the link
  EXPECT_EQ(shell("$M golden --dir golden --update alias.xml"), 0);
  EXPECT_EQ(shell("$M golden --dir golden"), 0);
}

TEST_F(Surroundings, GoldenImagesLieBesideTheFolderOfTheirSceneHoweverItIsCalled) {
  fs::create_directory(folder / "own/deep");
  EXPECT_EQ(shell("cd own; $M golden --update ./organ.xml"), 0);
  EXPECT_TRUE(fs::exists(folder / "golden_images/organ_10.png"));
  EXPECT_EQ(shell("cd own/deep; $M golden ../organ.xml"), 0);
}

TEST_F(Surroundings, ASceneInALinkedFolderReadsWhatLiesBesideThat) {
  std::string scene = read("own/organ.xml");
  const std::string named = "trajectory=\"";
  fs::create_directories(folder / "far/away");
  folder.write("far/away/organ.xml", scene.insert(scene.find(named) + named.size(), "../"));
  fs::copy(folder / "own/organ.csv", folder / "far/organ.csv");
  fs::create_directory_symlink("far/away", folder / "linked");
  EXPECT_EQ(shell("$M check linked/organ.xml"), 0);
}

}  // namespace
}  // namespace medulla
