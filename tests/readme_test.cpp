#include "tests/program_run.h"

#include <gtest/gtest.h>

#include <regex>

#include "app/scene.h"
#include "tests/temporary_folder.h"

// What the READMEs show runs, and counts, as it stands there.
namespace medulla {

TEST(Readme, ItsSceneRunsAmongTheScenes) {
  const std::filesystem::path source = MEDULLA_SOURCE_DIR;
  const std::string text = readFile(source / "README.md"), before = "```xml\n";
  const std::size_t start = text.find(before + "<scene ");
  ASSERT_NE(start, std::string::npos);
  const std::size_t end = text.find("```", start + before.size());
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "scenes");
  std::filesystem::create_directory_symlink(source / "assets", folder / "assets");
  std::filesystem::create_symlink(source / "scenes/liver.csv", folder / "scenes/liver.csv");
  folder.write("scenes/mine.xml", text.substr(start + before.size(), end - start - before.size()));
  const ProgramResult r = runProgram({"replay", folder / "scenes/mine.xml", "--set", "clock.duration=0.2"});
  EXPECT_EQ(r.exitCode, 0);
  EXPECT_EQ(complaints(r), std::vector<std::string>{});
}

TEST(Readme, ScenesTakeAsManySubstepsAsItSays) {
  const std::string folder = std::string(MEDULLA_SOURCE_DIR) + "/scenes/", text = readFile(folder + "README.md");
  const std::regex row(R"(\n\| `(\w+\.xml)` \|.*\| (\d+) \|)"), count("substeps_per_frame (\\d+)");
  int rows = 0;
  for (std::sregex_iterator match(text.begin(), text.end(), row), end; match != end; ++match, ++rows) {
    const std::string scene = folder + (*match)[1].str();
    const std::string told = runProgram({"info", scene}).out;
    std::smatch perFrame;
    ASSERT_TRUE(std::regex_search(told, perFrame, count)) << scene;
    EXPECT_EQ(std::stoi((*match)[2]), std::stoi(perFrame[1]) * readScene(scene).dynamicsRate) << scene;
  }
  EXPECT_EQ(rows, 6);
}

}  // namespace medulla
