#include "tests/program_run.h"

#include <gtest/gtest.h>

#include "tests/temporary_folder.h"

// What the README shows runs as it stands there.
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

}  // namespace medulla
