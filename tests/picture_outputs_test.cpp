#include "app/picture_outputs.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

extern "C" {
#include <libavutil/version.h>
}

#include "render/image.h"
#include "tests/own_scene.h"

// Where pictures go, through the program: the same bytes however a run is cut up, and nothing half-finished under a
// final name.
namespace medulla {
namespace {

namespace fs = std::filesystem;

class Outputs : public OwnScene {
 protected:
  ProgramResult render(const std::vector<std::string>& more, const ProgramOptions& options = {}) const {
    std::vector<std::string> words{"render", "own/organ.xml"};
    words.insert(words.end(), more.begin(), more.end());
    return run(words, options);
  }
  // PNG bytes of pictures [0, count), by number.
  std::vector<std::string> pictures(const std::string& name, int count) const {
    std::vector<std::string> out(count);
    for (int n = 0; n < count; ++n) out[n] = read(fmt::format("{}/{:05d}.png", name, n));
    return out;
  }
  std::vector<std::string> contents() const {  // but for the scene
    std::vector<std::string> names = folder.contents();
    std::erase(names, "own");
    return names;
  }
};

TEST_F(Outputs, BytesDependOnNeitherRunNorThreadsNorContext) {
  ProgramOptions alone;
  alone.environment = {{"LP_NUM_THREADS", "0"}};
  ProgramOptions one, two;
  one.environment = {{"LP_NUM_THREADS", "1"}};
  two.environment = {{"LP_NUM_THREADS", "2"}};
  ASSERT_EQ(render({"-o", "a"}, two).exitCode, 0);
  ASSERT_EQ(render({"-o", "b"}, one).exitCode, 0);
  ASSERT_EQ(render({"-o", "c", "--context", "osmesa"}, alone).exitCode, 0);
  const std::vector<std::string> expected = pictures("a", 12);
  EXPECT_GT(expected[11].size(), 1000u);
  EXPECT_EQ(pictures("b", 12), expected);
  EXPECT_EQ(pictures("c", 12), expected);
  const ProgramResult egl = render({"-o", "d", "--context", "egl"});
  if (egl.exitCode == 1 && egl.err.find("no OpenGL context") != std::string::npos)
    GTEST_SKIP() << "EGL cannot start here: " << egl.err;
  EXPECT_EQ(pictures("d", 12), expected);
}

TEST_F(Outputs, AKilledRunIsResumedToTheSameBytes) {
  write({.golden = "0", .duration = 2});
  const std::vector<std::string> small{"--size", "64x48", "-o", "frames", "--resume"};
  const fs::path collecting = folder / "frames/0-50.part";
  ProgramOptions killed;
  killed.signal = SIGKILL;
  killed.interruptWhen = [&] { return fs::exists(collecting / "00006.png"); };
  EXPECT_EQ(render(small, killed).exitCode, 128 + SIGKILL);
  ASSERT_TRUE(fs::exists(collecting / "00005.png"));
  EXPECT_FALSE(fs::exists(folder / "frames/00000.png"));
  // As a power cut would leave them: a name without its bytes, and a file under a temporary name.
  fs::resize_file(collecting / "00003.png", 50);
  folder.write("frames/0-50.part/00049.png.1-0.part", "x");
  const auto earlier = fs::last_write_time(collecting / "00005.png");

  // ^C keeps them, too.
  ProgramOptions interrupted;
  interrupted.interruptWhen = [&] { return fs::exists(collecting / "00020.png"); };
  EXPECT_EQ(render(small, interrupted).exitCode, 130);
  EXPECT_EQ(fs::last_write_time(collecting / "00005.png"), earlier);

  expectRefused(render({"--size", "64x48", "-o", "frames", "--resume", "--view", "model"}), "pictures of another run");
  const ProgramResult rest = render(small);
  ASSERT_EQ(rest.exitCode, 0) << rest.err;
  EXPECT_LE(std::stoi(valueOf(rest.out, "pictures")), 30) << rest.out;
  ASSERT_EQ(render({"--size", "64x48", "-o", "whole"}).exitCode, 0);
  EXPECT_EQ(pictures("frames", 50), pictures("whole", 50));
  EXPECT_EQ(contents().size(), 2u);
}

TEST_F(Outputs, WithoutResumeWhatAKilledRunLeftIsDrawnAnew) {
  folder.write("x", "");
  fs::create_directories(folder / "frames/0-12.part");
  folder.write("frames/0-12.part/00000.png", "left by a killed run");
  ASSERT_EQ(render({"--size", "64x48", "-o", "frames"}).exitCode, 0);
  EXPECT_EQ(read("frames/00000.png").substr(1, 3), "PNG");
  EXPECT_FALSE(fs::exists(folder / "frames/0-12.part"));
}

TEST_F(Outputs, WhatSomebodyPutWherePicturesCollectStaysThere) {
  fs::create_directories(folder / "frames/0-2.part");
  for (const char* name : {"frames/0-2.part/00007.png", "frames/00007.png", "frames/0-2.part/notes.png"})
    folder.write(name, name);
  ASSERT_EQ(render({"--size", "64x48", "-o", "frames", "--frames", "0:2"}).exitCode, 0);
  EXPECT_EQ(read("frames/00001.png").substr(1, 3), "PNG");
  for (const char* name : {"frames/0-2.part/00007.png", "frames/00007.png", "frames/0-2.part/notes.png"})
    EXPECT_EQ(read(name), name);
  EXPECT_EQ(read("frames/notes.png"), "");
}

// A link from a disk to another: a file is renamed only within one.
TEST_F(Outputs, PicturesGoWhereALinkToAnotherDiskLeads) {
  char elsewhere[] = "/dev/shm/medulla_pictures_XXXXXX";
  if (!::mkdtemp(elsewhere)) GTEST_SKIP() << "no other disk";
  fs::create_directory_symlink(elsewhere, folder / "frames");
  const ProgramResult r = render({"--size", "64x48", "-o", "frames", "--frames", "0:2"});
  EXPECT_EQ(r.exitCode, 0) << r.err;
  EXPECT_TRUE(fs::exists(std::string(elsewhere) + "/00001.png"));
  EXPECT_TRUE(fs::is_symlink(folder / "frames"));
  fs::remove_all(elsewhere);
}

TEST_F(Outputs, TwoRunsDoNotDrawTheSamePicturesAtOnce) {
  Image image{16, 16, std::vector<std::uint8_t>(4 * 16 * 16, 200)};
  PngFolder first(folder / "frames", {.first = 0, .last = 12, .run = 1});
  first.write(0, image);
  expectRefused(render({"--size", "64x48", "-o", "frames"}), "another run is drawing these pictures");
  EXPECT_EQ(render({"--size", "64x48", "--frames", "1:3", "-o", "frames"}).exitCode, 0);
  first.finish();
  EXPECT_FALSE(fs::exists(folder / "frames/00000.png"));
  first.commit();
  EXPECT_TRUE(fs::exists(folder / "frames/00000.png"));
  EXPECT_TRUE(fs::exists(folder / "frames/00002.png"));
}

TEST_F(Outputs, AShorterRunLeavesNoPicturesOfALongerOne) {
  const std::vector<std::string> whole{"--size", "64x48", "-o", "frames"};
  ASSERT_EQ(render(whole).exitCode, 0);
  const std::string expected = read("frames/00005.png");
  for (const char* name : {"7.png", "000007.png", "00007.jpg", "a00007.png", "-0007.png", "00012.png"})
    folder.write(std::string("frames/") + name, "somebody's");
  folder.write("frames/00020.png", expected);                                         // behind a gap
  ASSERT_EQ(render({"--frames", "0:2", "--size", "64x48", "-o", "frames"}).err, "");  // others draw the rest
  EXPECT_TRUE(fs::exists(folder / "frames/00011.png"));

  std::vector<std::string> shorter = whole;
  shorter.insert(shorter.end(), {"--set", "clock.duration=0.24"});
  const ProgramResult r = render(shorter);
  ASSERT_EQ(r.exitCode, 0) << r.err;
  ASSERT_EQ(complaints(r).size(), 1u) << r.err;
  EXPECT_TRUE(complaints(r)[0].starts_with("note: frames: 6 ")) << r.err;
  EXPECT_EQ(read("frames/00005.png"), expected);
  int left = 0;
  for (const auto& entry : fs::directory_iterator(folder / "frames")) left += entry.exists();
  EXPECT_EQ(left, 6 + 6 + 1);
  EXPECT_FALSE(fs::exists(folder / "frames/00006.png"));
  EXPECT_EQ(render(shorter).err, "");

  ASSERT_EQ(mkfifo((folder / "frames/00006.png").c_str(), 0600), 0);  // which nobody will ever write into
  EXPECT_EQ(render(shorter).err, "");
}

TEST_F(Outputs, SeveralScenesInOneProcessHaveFilesOfTheirOwn) {
  folder.write("own/second.xml", read("own/organ.xml"));
  const ProgramResult both = run({"render", "own/organ.xml", "own/second.xml", "-o", "{scene}", "-o", "{scene}.gif",
                                  "--log", "{scene}.csv", "--size", "64x48"});
  ASSERT_EQ(both.exitCode, 0) << both.err;
  ASSERT_EQ(render({"--size", "64x48", "-o", "alone"}).exitCode, 0);
  EXPECT_EQ(pictures("organ", 12), pictures("alone", 12));
  EXPECT_EQ(pictures("second", 12), pictures("alone", 12));
  EXPECT_EQ(read("organ.csv"), read("second.csv"));
  EXPECT_EQ(read("second.gif").substr(0, 6), "GIF89a");
  expectRefused(run({"render", "own/organ.xml", "own/second.xml", "-o", "film.mp4"}), "{scene}", 2);
  expectRefused(run({"render", "own/organ.xml", "own/organ.xml", "-o", "{scene}.mp4"}), "two outputs");
  expectRefused(run({"render", "own/second.xml", "own/organ.xml", "-o", "{scene}.gif", "--log", "own/{scene}.csv"}),
                "own/organ.csv: would be written over an input");
  EXPECT_FALSE(fs::exists(folder / "own/second.csv"));
}

// What cannot be loaded shows before anything is drawn, and what fails as it runs says of which scene.
TEST_F(Outputs, OfSeveralScenesOneThatFailsIsNamed) {
  std::string lost = read("own/organ.xml");
  lost.replace(lost.find("gallbladder.model.xml"), 21, "gone.model.xml");
  folder.write("own/lost.xml", lost);
  const std::vector<std::string> all = {"render",      "own/organ.xml", "own/lost.xml", "-o",
                                        "{scene}.gif", "--size",        "64x48"};
  expectRefused(run(all), "gone.model.xml");
  EXPECT_FALSE(fs::exists(folder / "organ.gif"));
  folder.write("own/lost.xml", read("own/organ.xml"));
  std::vector<std::string> stiff = all;
  stiff.insert(stiff.end(), {"--set", "dynamics.substeps=1", "--set", "tissue.t.young=1e7"});
  const ProgramResult failed = run(stiff);
  EXPECT_EQ(failed.exitCode, 1);
  EXPECT_NE(failed.err.find("medulla: own/organ.xml: body 'organ' is not finite at "), std::string::npos) << failed.err;
}

TEST_F(Outputs, FoldersThatAreMissingAreMade) {
  ASSERT_EQ(render({"--size", "64x48", "--frames", "0:2", "-o", "films/new/{scene}.gif", "-o", "films/b.mp4"}).exitCode,
            0);
  ASSERT_EQ(render({"--size", "64x48", "--still", "0", "-o", "stills/{scene}.png"}).exitCode, 0);
  for (const char* name : {"films/new/organ.gif", "films/b.mp4", "stills/organ.png"})
    EXPECT_TRUE(fs::is_regular_file(folder / name)) << name;
}

TEST_F(Outputs, ANameMayBeAsLongAsNamesMayBe) {
  for (const std::string ending : {".gif", ".mp4", ".webp"}) {
    const std::string name = std::string(255 - ending.size(), 'n') + ending;
    EXPECT_EQ(render({"--size", "64x48", "--frames", "0:2", "-o", name}).exitCode, 0) << ending;
    EXPECT_TRUE(fs::is_regular_file(folder / name)) << ending;
  }
  int entries = 0;
  for (const auto& entry : fs::directory_iterator(folder.path())) entries += entry.exists();
  EXPECT_EQ(entries, 1 + 3);
}

TEST_F(Outputs, AStillIsThePictureOfItsTimeAndAveragesFourTimesThePixels) {
  ASSERT_EQ(render({"-o", "frames", "--frames", "8:9"}).exitCode, 0);
  ASSERT_EQ(render({"--still", "0.32", "--quality", "standard", "-o", "a.png"}).exitCode, 0);
  EXPECT_EQ(read("a.png"), read("frames/00008.png"));
  ASSERT_EQ(render({"--still", "0.32"}).exitCode, 0);  // organ.png, the best
  const Image best = readPng(folder / "organ.png"), standard = readPng(folder / "a.png");
  EXPECT_EQ(best.width, 320);
  const ImageDifference d = compareImages(best, standard);
  EXPECT_GT(d.psnr, 24);  // the same picture
  EXPECT_LT(d.psnr, 50);  // and another
  ASSERT_EQ(render({"--still", "0.32", "--quality", "draft", "-o", "draft.png"}).exitCode, 0);
  EXPECT_FALSE(compareImages(readPng(folder / "draft.png"), standard).equal);
  expectRefused(render({"--still", "0.5", "-o", "b.png"}), "--still 0.5: expected a time from 0 to 0.48 s");
  expectRefused(render({"--still", "0", "-o", "b.mp4"}), "b.mp4: expected FILE.png");
  expectRefused(render({"--still", "-1", "-o", "b.png"}), "--still", 2);
  EXPECT_FALSE(fs::exists(folder / "b.png"));
}

TEST_F(Outputs, FourKIsDrawn) {
  ASSERT_EQ(render({"--still", "0", "--size", "3840x2160", "--quality", "standard"}).exitCode, 0);
  const Image image = readPng(folder / "organ.png");
  EXPECT_EQ(image.width, 3840);
  EXPECT_EQ(image.height, 2160);
}

TEST_F(Outputs, SizesThatCannotBeDrawnAreRefused) {
  for (const char* size : {"0x0", "0x480", "20000x720", "640x20000", "641x480", "640x481", "-640x480", "14x16"})
    expectRefused(render({"--size", size, "-o", "a.mp4"}), std::string("--size ") + size);
  expectRefused(render({"--set", "output.size=641 480", "-o", "a.mp4"}), "even");
  EXPECT_TRUE(contents().empty());
}

TEST_F(Outputs, OnlyVideosNeedEvenSizes) {
  const std::vector<std::string> one{"--frames", "0:1", "--show", "caption"};
  const auto picture = [&](const std::string& size, const std::string& view) {
    std::vector<std::string> words{"--size", size, "--view", view, "-o", size + view};
    words.insert(words.end(), one.begin(), one.end());
    const ProgramResult r = render(words);
    EXPECT_EQ(r.exitCode, 0) << r.err;
    return readPng(folder / (size + view + "/00000.png"));
  };
  const Image odd = picture("131x97", "tissue"), even = picture("132x98", "tissue");
  ASSERT_EQ(odd.width, 131);
  ASSERT_EQ(odd.height, 97);
  const auto middle = [](const Image& image) { return &image.pixels[4ul * (image.width * 49ul + 66)]; };
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(middle(odd)[k], middle(even)[k], 12);
  EXPECT_GT(middle(odd)[0], 20);
  const Image sides = picture("131x97", "tissue,model");
  EXPECT_EQ(sides.width, 131);
  EXPECT_EQ(sides.height, 97);
  ASSERT_EQ(render({"--still", "0", "--size", "131x97"}).exitCode, 0);
  EXPECT_EQ(readPng(folder / "organ.png").width, 131);
  expectRefused(render({"--size", "131x97", "-o", "frames", "-o", "a.gif"}), "--size 131x97: expected even numbers");
  expectRefused(render({"--size", "15x97", "-o", "frames"}), "--size 15x97: expected numbers from 16 to 8192");
}

TEST_F(Outputs, ALinkIsFollowedAndStays) {
  fs::create_directory(folder / "elsewhere");
  for (const char* name : {"still.png", "film.gif"}) {
    fs::create_symlink(std::string("elsewhere/") + name, folder / name);
    const bool still = std::string(name) == "still.png";
    ASSERT_EQ(render({"--size", "64x48", still ? "--still" : "--frames", still ? "0" : "0:2", "-o", name}).exitCode, 0);
    EXPECT_TRUE(fs::is_symlink(folder / name));
    EXPECT_TRUE(fs::is_regular_file(folder / (std::string("elsewhere/") + name)));
  }
}

TEST_F(Outputs, TwoOutputsThatLinksLeadToOnePlaceAreRefused) {
  fs::create_symlink("b.csv", folder / "a.csv");  // where nothing is yet
  expectRefused(run({"replay", "own/organ.xml", "--log", "a.csv", "--record", "b.csv"}), "named for two outputs");
}

TEST_F(Outputs, WhoMayReadAFileMayReadItsSuccessor) {
  folder.write("a.csv", "earlier");
  fs::permissions(folder / "a.csv", fs::perms::owner_read | fs::perms::owner_write);
  ASSERT_EQ(run({"replay", "own/organ.xml", "--log", "a.csv"}).exitCode, 0);
  EXPECT_NE(read("a.csv"), "earlier");
  EXPECT_EQ(fs::status(folder / "a.csv").permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

// What was made to draw with goes in the thread that it belongs to, or EGL ends the program.
TEST_F(Outputs, WhatIsRefusedWhenAllIsReadyToDrawIsSaidByEitherContext) {
  for (const char* context : {"osmesa", "egl"})
    expectRefused(render({"--context", context, "--still", "0.1", "-o", "a.jpg"}),
                  render({"--context", context, "--still", "0", "-o", "a.png"}).exitCode == 0 ? "expected FILE.png"
                                                                                              : "no OpenGL context");
}

TEST_F(Outputs, AFullDiskStopsTheRunAndLeavesNothing) {
  ProgramOptions full;
  full.fileSizeLimit = 1000;
  for (const char* name : {"a.mp4", "a.webm", "a.gif", "a.webp", "frames", "frames --resume"}) {
    const bool resume = std::string(name).find("resume") != std::string::npos;
    std::vector<std::string> words{"--size", "96x64", "-o", resume ? "frames" : name};
    if (resume) words.push_back("--resume");
    expectRefused(render(words, full), "File too large");
    if (resume) fs::remove_all(folder / "frames");  // the pictures before, for another try
    EXPECT_TRUE(contents().empty()) << name << " left " << contents()[0];
  }
  expectRefused(render({"--still", "0", "-o", "a.png"}, full), "a.png: cannot be written: File too large");
  expectRefused(run({"replay", "own/organ.xml", "--cache", "a.cache"}, full),
                "a.cache: cannot be written: File too large");
  EXPECT_TRUE(contents().empty());
}

TEST_F(Outputs, OfARunThatOneFileHasNoRoomForNoneAppears) {
  const std::vector<std::string> words{"replay", "own/organ.xml", "--log",    "a.csv", "--surface-at",
                                       "end",    "a.obj",         "--record", "b.csv"};
  ASSERT_EQ(run(words).exitCode, 0);
  const auto sizeOf = [&](const char* name) { return static_cast<long>(read(name).size()); };
  const long log = sizeOf("a.csv"), surface = sizeOf("a.obj"), record = sizeOf("b.csv");
  ASSERT_LT(log, surface);
  ASSERT_LT(surface, record);
  for (const char* name : {"a.csv", "a.obj", "b.csv"}) fs::remove(folder / name);
  ProgramOptions full;
  full.fileSizeLimit = record - 1;
  expectRefused(run(words, full), "b.csv: cannot be written: File too large");
  expectRefused(render({"--size", "16x16", "--frames", "0:1", "-o", "a.gif", "--record", "b.csv"}, full),
                "b.csv: cannot be written: File too large");
  full.fileSizeLimit = surface - 1;
  expectRefused(run({words.begin(), words.end() - 2}, full), "a.obj: cannot be written: File too large");
  EXPECT_TRUE(contents().empty()) << contents()[0];
}

TEST_F(Outputs, AStillBesideATableWithoutRoomDoesNotAppear) {
  const std::vector<std::string> words{"--size", "16x16", "--still", "0.1", "-o", "a.png", "--record", "b.csv"};
  ASSERT_EQ(render(words).exitCode, 0);
  ProgramOptions full;
  full.fileSizeLimit = static_cast<long>(fs::file_size(folder / "b.csv")) - 1;
  ASSERT_LT(fs::file_size(folder / "a.png"), full.fileSizeLimit);
  for (const char* name : {"a.png", "b.csv"}) folder.write(name, "earlier");
  expectRefused(render(words, full), "b.csv: cannot be written: File too large");
  for (const char* name : {"a.png", "b.csv"}) EXPECT_EQ(read(name), "earlier") << name;
  EXPECT_EQ(contents().size(), 2u);
}

TEST_F(Outputs, OfSeveralFilmsThatOneHasNoRoomForEarlierOnesStay) {
  const std::vector<std::string> words{"--size", "96x64", "-o", "a.mp4", "-o", "frames", "-o", "a.webm"};
  ASSERT_EQ(render(words).exitCode, 0);
  const long film = static_cast<long>(fs::file_size(folder / "a.mp4")),
             other = static_cast<long>(fs::file_size(folder / "a.webm"));
  for (const char* name : {"a.mp4", "a.webm", "frames/00003.png"}) folder.write(name, "earlier");
  ProgramOptions full;
  full.fileSizeLimit = std::max(film, other) - 1;
  expectRefused(render(words, full), std::string(film > other ? "a.mp4" : "a.webm") + ": cannot be written");
  for (const char* name : {"a.mp4", "a.webm", "frames/00003.png"}) EXPECT_EQ(read(name), "earlier") << name;
}

TEST_F(Outputs, WithoutAnyContextTheReasonsAreSaid) {
  ProgramOptions none;  // Mesa is told to offer OpenGL 2.1 alone
  none.environment = {{"MESA_GL_VERSION_OVERRIDE", "2.1"}};
  expectRefused(render({"-o", "frames"}, none), "no OpenGL context to draw with: osmesa: ");
  expectRefused(render({"-o", "frames"}, none), "; egl: ");
  expectRefused(render({"-o", "frames", "--context", "egl"}, none), "no OpenGL context to draw with: egl: ");
  for (const auto& [variable, value] :
       {std::pair("GALLIUM_DRIVER", "zink"), std::pair("LP_NATIVE_VECTOR_WIDTH", "512")}) {
    ProgramOptions crashing;  // Mesa, by a signal
    crashing.environment = {{variable, value}};
    expectRefused(render({"-o", "frames", "--context", "osmesa"}, crashing),
                  fmt::format("the environment has {}={}, expected ", variable, value));
  }
  EXPECT_TRUE(contents().empty());
}

// They are loaded where a run needs them; the loader finds what is no library first.
TEST_F(Outputs, LibrariesThatCannotBeLoadedAreSaid) {
  ProgramOptions none;
  none.environment = {{"LD_LIBRARY_PATH", (folder / "own").c_str()}};
  const std::string utilities = fmt::format("libavutil.so.{}", LIBAVUTIL_VERSION_MAJOR), mesa = "libOSMesa.so.8";
  folder.write("own/" + mesa, "");
  expectRefused(render({"-o", "frames", "--context", "osmesa"}, none), mesa + ": ");
  fs::remove(folder / ("own/" + mesa));
  folder.write("own/" + utilities, "");
  expectRefused(render({"--size", "16x16", "-o", "a.mp4"}, none), "a.mp4: cannot be written: ");
  expectRefused(render({"--size", "16x16", "-o", "a.mp4"}, none), utilities + ": ");
  EXPECT_TRUE(contents().empty());
  EXPECT_EQ(render({"--size", "16x16", "--still", "0", "-o", "a.png"}, none).exitCode, 0);
}

TEST_F(Outputs, TimingsGoToStandardError) {
  const ProgramResult r = render({"-o", "frames", "--size", "64x48", "--timings"});
  ASSERT_EQ(r.exitCode, 0) << r.err;
  for (const char* stage :
       {"stage ", "start ", "simulate ", "compose ", "light ", "draw ", "hand over ", "encode ", "sum "})
    EXPECT_NE(("\n" + r.err).find(std::string("\n") + stage), std::string::npos) << stage << " is missing in\n"
                                                                                 << r.err;
  EXPECT_EQ(r.out.find("stage"), std::string::npos);
}

// A film of twelve pictures, and one of one in the same call.
TEST_F(Outputs, TimingsAreThoseOfEachSceneAlone) {
  std::string text = read("own/organ.xml");
  text.replace(text.find("0.48"), 4, "0.04");
  text.erase(text.find(" golden"), std::string(" golden=\"0.32 0.4\"").size());
  folder.write("own/short.xml", text);
  const ProgramResult r =
      run({"render", "own/organ.xml", "own/short.xml", "-o", "{scene}", "--size", "64x48", "--timings"});
  ASSERT_EQ(r.exitCode, 0) << r.err;
  const auto cpuOf = [&r](std::size_t sum) {  // s
    double wall = 0, cpu = 0;
    std::istringstream(r.err.substr(sum + 4)) >> wall >> cpu;
    return cpu;
  };
  EXPECT_LT(cpuOf(r.err.rfind("\nsum ")), cpuOf(r.err.find("\nsum "))) << r.err;
}

TEST_F(Outputs, AFolderThatCannotTakeEveryPictureIsRefusedBeforeTheFilm) {
  fs::create_directories(folder / "frames/00002.png");
  folder.write("frames/00000.png", "earlier");
  expectRefused(render({"-o", "frames", "--frames", "0:3"}), "frames/00002.png: is a folder");
  EXPECT_EQ(read("frames/00000.png"), "earlier");
  EXPECT_EQ(render({"-o", "frames", "--frames", "3:4", "--size", "64x48"}).exitCode, 0);
  fs::create_directory(folder / "other");
  folder.write("other/0-12.part", "somebody's");
  expectRefused(render({"-o", "other"}), "other/0-12.part: cannot be made");
  EXPECT_EQ(read("other/0-12.part"), "somebody's");
  expectRefused(render({"-o", ".mp4"}), ".mp4: expected a name before the dot");
  EXPECT_EQ(contents().size(), 2u);
}

TEST_F(Outputs, AFolderThatIsForbiddenIsRefusedBeforeTheFilm) {
  if (::geteuid() == 0) GTEST_SKIP() << "nothing is forbidden to root";
  fs::create_directories(folder / "frames");
  fs::permissions(folder / "frames", fs::perms::owner_read | fs::perms::owner_exec);
  expectRefused(render({"-o", "frames", "--frames", "4:5"}), "frames: cannot be written: Permission denied");
  fs::permissions(folder / "frames", fs::perms::owner_all);
}

TEST_F(Outputs, WhatCannotBeResumedIsWrongUsage) {
  expectRefused(render({"--resume"}), "medulla: --resume: expected -o DIR", 2);
  expectRefused(render({"--resume", "-o", "a.mp4"}), "a.mp4", 2);
  expectRefused(render({"--still", "0", "--frames", "0:1"}), "--still", 2);
  folder.write("a.txt", "");
  expectRefused(render({"-o", "a.txt"}), "expected FILE.mp4, .webm, .gif or .webp, or a folder");
}

// Light does not run round a cube's edges as round a ball, though its triangles share their corners.
TEST_F(Outputs, AMeshWithSharpEdgesIsDrawnAsTheBoxThatItIs) {
  folder.write("own/cube.obj",
               "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
               "f 1 4 3\nf 1 3 2\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 4 8 7\nf 4 7 3\nf 1 5 8\nf 1 8 4\n"
               "f 2 3 7\nf 2 7 6\n");
  const std::string text = read("own/organ.xml");
  const auto drawn = [&](const std::string& shape, const std::string& name) {
    std::string changed = text;
    changed.insert(changed.find("<tool "), "<static " + shape +
                                               " position=\"-0.05 -0.04 0.09\" orientation=\"0.9 0.3 0.3162278 0\" "
                                               "look=\"matte\" contact=\"false\"/>");
    folder.write("own/organ.xml", changed);
    const ProgramResult r = render({"--still", "0", "-o", name});
    EXPECT_EQ(r.exitCode, 0) << r.err;
    return readPng(folder / name);
  };
  const Image box = drawn("shape=\"box\" size=\"0.02 0.02 0.02\"", "box.png"),
              mesh = drawn("shape=\"mesh\" mesh=\"cube.obj\" unit=\"cm\"", "mesh.png");
  double difference = 0;
  for (std::size_t k = 0; k < box.pixels.size(); ++k) difference += std::abs(box.pixels[k] - mesh.pixels[k]);
  EXPECT_LT(difference / static_cast<double>(box.pixels.size()), 0.1);
}

}  // namespace
}  // namespace medulla
