#include <algorithm>

#include "render/image.h"
#include "tests/own_scene.h"

// What a folder of golden images holds besides those that compare: images that cannot be read, scenes that cannot be
// drawn, moments that are no more. Each is told, and keeps no other from being compared.
namespace medulla {
namespace {

class GoldenFolder : public OwnScene {
 protected:
  void SetUp() override {
    OwnScene::SetUp();
    folder.write("own/other.xml", replaced(read("own/organ.xml"), "golden=\"0.32 0.4\"", "golden=\"0.04\""));
    const ProgramResult made = golden({"--update", "own/organ.xml", "--update", "own/other.xml"});
    ASSERT_EQ(made.exitCode, 0) << made.err;
  }
  static std::string replaced(std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  }
  ProgramResult golden(std::vector<std::string> words) const {
    words.insert(words.begin(), {"golden", "--dir", "pictures"});
    return run(words);
  }
  // The comparison goes to its end: of both scenes what is said here, and a report of this run.
  void expectCompared(const std::vector<std::string>& lines, const std::string& heading) const {
    std::filesystem::create_directories(folder / "out/golden");
    folder.write("out/golden/report.html", "of a former run");
    const ProgramResult r = golden({});
    EXPECT_EQ(r.exitCode, 3) << r.err;
    for (const std::string& line : lines)
      EXPECT_NE(("\n" + r.out).find("\n" + line), std::string::npos) << "no \"" << line << "\" in " << r.out;
    EXPECT_EQ(std::count(r.out.begin(), r.out.end(), '\n'), std::ptrdiff_t(lines.size()) + 1) << r.out;
    EXPECT_NE(read("out/golden/report.html").find(heading), std::string::npos);
  }
  std::vector<std::string> images() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "pictures"))
      names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }
};

using Names = std::vector<std::string>;

TEST_F(GoldenFolder, AnImageThatCannotBeReadFailsAlone) {
  std::filesystem::resize_file(folder / "pictures/organ_8.png", 600);
  expectCompared({"organ_8 failed: pictures/organ_8.png: broken PNG", "organ_10 ok: equal", "other_1 ok: equal"},
                 "1 of 3 golden images failed");
  EXPECT_TRUE(std::filesystem::exists(folder / "out/golden/organ_8_actual.png"));
  EXPECT_EQ(golden({"--update", "organ_8"}).out, "pictures/organ_8.png written\n");
  EXPECT_EQ(golden({}).exitCode, 0);
  // No scene has it as a moment; whose it was cannot be read.
  folder.write("pictures/former_3.png", "half of a picture");
  expectCompared({"organ_8 ok", "organ_10 ok", "other_1 ok", "former_3 failed: pictures/former_3.png: is no PNG file"},
                 "1 of 4 golden images failed");
  for (const char* image : {"organ_8", "organ_10", "other_1"})
    folder.write(fmt::format("pictures/{}.png", image), "half of a picture");
  expectRefused(golden({}), "is no PNG file");
}

TEST_F(GoldenFolder, ASceneThatCannotBeDrawnFailsAlone) {
  const std::string scene = read("own/organ.xml");
  const auto withOther = [](const std::string& line) { return Names{line, "other_1 ok: equal"}; };
  write({.young = "soft"});
  expectCompared(withOther("organ failed: own/organ.xml:2: <tissue> young=\"soft\""), "1 of 2 golden images failed");
  folder.write("own/organ.xml", replaced(scene, " golden=\"0.32 0.4\"", ""));
  expectCompared(withOther("organ failed: own/organ.xml: names no golden moments"), "1 of 2");
  std::filesystem::remove(folder / "own/organ.xml");
  expectCompared(withOther("organ failed: own/organ.xml"), "1 of 2");
  expectRefused(golden({"own/organ.xml"}), "own/organ.xml: does not exist");
  folder.write("own/organ.xml", scene);
  folder.write("own/organ.csv", "t[s]\n0\n");
  expectCompared({"organ failed: own/organ.csv:1: ", "other failed: own/organ.csv:1: "}, "2 of 2");
}

TEST_F(GoldenFolder, NothingIsStoredWhereOneOfTheScenesCannotBeDrawn) {
  write({.cameraTarget = -0.03});
  const std::string before = read("pictures/organ_8.png");
  const std::string other = read("own/other.xml");
  // Found when it is read, when its trajectory is, and while it runs.
  const std::string stiff = replaced(replaced(other, "5e3", "1e9"), "<dynamics ", "<dynamics substeps=\"1\" ");
  for (const std::string& bad : {replaced(other, "5e3", "soft"), replaced(other, "organ.csv", "none.csv"),
                                 replaced(stiff, "golden=\"0.04\"", "golden=\"0.4\"")}) {
    folder.write("own/other.xml", bad);
    const ProgramResult r = golden({"--update", "own/organ.xml", "--update", "own/other.xml"});
    EXPECT_EQ(r.exitCode, 1) << r.out;
    EXPECT_EQ(r.out, "");
    EXPECT_TRUE(read("pictures/organ_8.png") == before);
  }
}

TEST_F(GoldenFolder, AnImageThatNoMomentNamesFailsUntilAnUpdateRemovesIt) {
  write({.golden = "0.04 0.4"});
  const std::string former = "organ_8 failed: no moment of own/organ.xml: --update organ removes it";
  expectCompared({"organ_1 failed: pictures/organ_1.png does not exist", "organ_10 ok: equal", former, "other_1 ok"},
                 "2 of 4 golden images failed");
  EXPECT_EQ(golden({"own/other.xml"}).exitCode, 0);  // another scene's
  EXPECT_EQ(golden({"--update", "organ_1"}).out, "pictures/organ_1.png written\n");
  const ProgramResult named = golden({"own/organ.xml"});
  EXPECT_EQ(named.exitCode, 3);
  EXPECT_NE(named.out.find(former), std::string::npos) << named.out;
  EXPECT_EQ(images(), (Names{"organ_1.png", "organ_10.png", "organ_8.png", "other_1.png"}));
  EXPECT_EQ(golden({"--update", "organ"}).out,
            "pictures/organ_1.png written\npictures/organ_10.png written\n"
            "pictures/organ_8.png removed: no moment of its scene\n");
  EXPECT_EQ(images(), (Names{"organ_1.png", "organ_10.png", "other_1.png"}));
  EXPECT_EQ(golden({}).exitCode, 0);
}

TEST_F(GoldenFolder, PicturesOfAFailureGoWithTheirMoment) {
  write({.cameraTarget = -0.03});
  EXPECT_EQ(golden({"own/organ.xml"}).exitCode, 3);
  EXPECT_TRUE(std::filesystem::exists(folder / "out/golden/organ_8_difference.png"));
  write({.golden = "0.4"});
  EXPECT_EQ(golden({"own/organ.xml", "--update", "organ"}).exitCode, 0);
  EXPECT_EQ(golden({"own/organ.xml"}).exitCode, 0);
  for (const auto& entry : std::filesystem::directory_iterator(folder / "out/golden"))
    EXPECT_EQ(entry.path().filename(), "report.html");
}

TEST_F(GoldenFolder, TheReportShowsWhatHasNoGoldenImageOrAnotherSize) {
  const auto picturesIn = [&] {
    EXPECT_EQ(golden({"own/organ.xml"}).exitCode, 3);
    const std::string report = read("out/golden/report.html"), image = "src=\"data:image/png";
    int count = 0;
    for (std::size_t at = report.find(image); at != std::string::npos; at = report.find(image, at + 1)) ++count;
    return count;
  };
  std::filesystem::rename(folder / "pictures/organ_8.png", folder / "aside.png");
  EXPECT_EQ(picturesIn(), 1);
  std::filesystem::copy_file(MEDULLA_SOURCE_DIR "/golden_images/gallbladder_84.png", folder / "pictures/organ_8.png");
  EXPECT_EQ(picturesIn(), 2);
}

TEST_F(GoldenFolder, NothingIsStoredWhereOneImageCannotBe) {
  write({.cameraTarget = -0.03});
  const std::string before = read("pictures/organ_8.png");
  std::filesystem::remove(folder / "pictures/organ_10.png");
  std::filesystem::create_directory(folder / "pictures/organ_10.png");
  expectRefused(golden({"own/organ.xml", "--update", "organ"}), "organ_10.png: is a folder");
  EXPECT_TRUE(read("pictures/organ_8.png") == before);
}

TEST_F(GoldenFolder, AnUpdateThatFindsNoRoomLeavesAllImagesAsTheyWere) {
  namespace fs = std::filesystem;
  const std::vector<std::string> before = images();
  std::uintmax_t largest = 0;
  std::vector<fs::file_time_type> written;
  for (const std::string& name : before) {
    largest = std::max(largest, fs::file_size(folder / ("pictures/" + name)));
    written.push_back(fs::last_write_time(folder / ("pictures/" + name)));
  }
  ProgramOptions full;
  full.fileSizeLimit = static_cast<long>(largest) - 1;
  expectRefused(run({"golden", "--dir", "pictures", "--update", "organ", "--update", "other"}, full),
                "cannot be written: File too large");
  EXPECT_EQ(images(), before);
  for (std::size_t k = 0; k < before.size(); ++k)
    EXPECT_EQ(fs::last_write_time(folder / ("pictures/" + before[k])), written[k]) << before[k];
}

TEST_F(GoldenFolder, AFolderThatIsNotThereIsSaidToBeSo) {
  expectRefused(run({"golden", "--dir", "nowhere"}), "nowhere: No such file or directory");
}

TEST_F(GoldenFolder, AnUpdateOfASceneThatNamesNoMomentAnyMoreRemovesItsImages) {
  folder.write("own/organ.xml", replaced(read("own/organ.xml"), " golden=\"0.32 0.4\"", ""));
  const ProgramResult r = golden({"own/organ.xml", "--update", "organ"});
  EXPECT_EQ(r.exitCode, 0) << r.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "pictures/organ_8.png"));
  EXPECT_TRUE(std::filesystem::exists(folder / "pictures/other_1.png"));
  expectRefused(golden({"own/organ.xml", "--update", "organ"}), "own/organ.xml: names no golden moments");
}

TEST_F(GoldenFolder, ImagesOfAnotherSceneOfTheNameAreKeptUntilThatHasGone) {
  const std::string scene = read("own/organ.xml"), before = read("pictures/organ_8.png");
  std::filesystem::create_directory(folder / "moved");
  folder.write("moved/organ.xml", replaced(scene, "organ.csv", "../own/organ.csv"));
  expectRefused(golden({"--update", "moved/organ.xml"}),
                "moved/organ.xml: two scenes of the name organ for one folder of golden images: pictures/organ_");
  EXPECT_TRUE(read("pictures/organ_8.png") == before);
  std::filesystem::remove(folder / "own/organ.xml");
  EXPECT_EQ(golden({"--update", "moved/organ.xml"}).exitCode, 0);
  EXPECT_FALSE(read("pictures/organ_8.png") == before);
}

TEST_F(GoldenFolder, PicturesOfOthersAreNotedAndKept) {
  std::filesystem::copy(folder / "pictures/organ_8.png", folder / "pictures/organ copy.png");
  Image square = blackImage(8, 8);
  for (const char* name : {"logo", "organ_99"}) writePng(folder / ("pictures/" + std::string(name) + ".png"), square);
  const ProgramResult r = golden({});
  EXPECT_EQ(r.exitCode, 0) << r.out;
  EXPECT_EQ(complaints(r), (Names{"note: pictures/logo.png is compared with nothing: it names no scene",
                                  "note: pictures/organ copy.png is compared with nothing: it is called as no moment "
                                  "of a scene here",
                                  "note: pictures/organ_99.png is compared with nothing: it names no scene"}));
  EXPECT_EQ(golden({"--update", "own/organ.xml"}).exitCode, 0);
  EXPECT_EQ(images(),
            (Names{"logo.png", "organ copy.png", "organ_10.png", "organ_8.png", "organ_99.png", "other_1.png"}));
}

TEST_F(GoldenFolder, ImagesOfAMissingSceneFailWhereScenesAreThoseOfTheCurrentFolder) {
  std::filesystem::create_directory(folder / "scenes");
  const std::string scene = replaced(read("own/organ.xml"), "organ.csv", "../own/organ.csv");
  for (const char* name : {"scenes/a.xml", "scenes/b.xml"}) folder.write(name, scene);
  ASSERT_EQ(run({"golden", "--update", "a", "--update", "b"}).exitCode, 0);
  std::filesystem::remove(folder / "scenes/b.xml");
  const ProgramResult r = run({"golden"});
  EXPECT_EQ(r.exitCode, 3);
  EXPECT_NE(r.out.find("b_8 failed: its scene "), std::string::npos) << r.out;
  EXPECT_NE(r.out.find("scenes/b.xml does not exist\n"), std::string::npos) << r.out;
}

}  // namespace
}  // namespace medulla
