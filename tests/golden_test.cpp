#include <gtest/gtest.h>

#include <algorithm>

#include "render/image.h"
#include "tests/program_run.h"
#include "tests/temporary_folder.h"

// The golden images of every shipped scene, through the command that users run; and that the gate closes.
namespace medulla {

static const std::string kSource = MEDULLA_SOURCE_DIR;

static std::vector<std::string> shippedScenes() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(kSource + "/scenes"))
    if (entry.path().extension() == ".xml") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

class GoldenScene : public testing::TestWithParam<std::string> {};

TEST_P(GoldenScene, LooksAsStored) {
  const TemporaryFolder folder;
  ProgramOptions options;
  options.folder = kSource;
  const ProgramResult r =
      runProgram({"golden", "scenes/" + GetParam() + ".xml", "--failures", folder / "failures"}, options);
  EXPECT_EQ(r.exitCode, 0) << r.out << r.err;
  EXPECT_NE(r.out.find(" ok: "), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(Shipped, GoldenScene, testing::ValuesIn(shippedScenes()),
                         [](const auto& scene) { return scene.param; });

TEST(Golden, AnotherPictureFailsWithItsDifferenceAndTheCommandThatRepeatsIt) {
  const TemporaryFolder folder;
  const std::string scene = kSource + "/scenes/gallbladder.xml";
  std::filesystem::create_directory(folder / "images");
  for (const auto& entry : std::filesystem::directory_iterator(kSource + "/golden_images")) {
    const std::string name = entry.path().filename().string();
    if (name.rfind("gallbladder_", 0) != 0) continue;
    std::vector<PngText> texts;
    Image image = readPng(entry.path().string(), &texts);
    if (name == "gallbladder_15.png")  // a black square of 20 pixels: a tenth of a per cent of nothing much
      for (int y = 300; y < 320; ++y)
        for (int x = 600; x < 620; ++x)
          for (int c = 0; c < 3; ++c) image.pixels[4 * (std::size_t(y) * image.width + x) + c] = 0;
    writePng(folder / ("images/" + name), image, texts);
  }
  const ProgramResult r =
      runProgram({"golden", scene, "--images", folder / "images", "--failures", folder / "failures"});
  EXPECT_EQ(r.exitCode, 3) << r.out << r.err;
  EXPECT_NE(r.out.find("gallbladder_15 failed"), std::string::npos) << r.out;
  EXPECT_NE(r.err.find("medulla golden "), std::string::npos) << r.err;
  EXPECT_TRUE(std::filesystem::exists(folder / "failures/gallbladder_15_actual.png"));
  EXPECT_TRUE(std::filesystem::exists(folder / "failures/gallbladder_15_difference.png"));
}

}  // namespace medulla
