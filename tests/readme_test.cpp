#include "tests/program_run.h"

#include <gtest/gtest.h>

#include <cctype>
#include <regex>
#include <sstream>

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

// Whole, or as the last part of a name: a body's and a tool's own come before it.
static void expectDocumented(const std::string& name, const std::string& text) {
  const std::size_t dot = name.find_last_of('.');
  const bool isPart = dot != std::string::npos && std::isalpha(static_cast<unsigned char>(name[dot + 1]));
  const std::string last = isPart ? name.substr(dot + 1) : name;
  EXPECT_TRUE(text.find("`" + last + "`") != std::string::npos || text.find("." + last + "`") != std::string::npos)
      << name;
}

TEST(Readme, EveryResultIsInTheListOfResults) {
  const std::string source = std::string(MEDULLA_SOURCE_DIR) + "/", text = readFile(source + "docs/results.md");
  const TemporaryFolder folder;
  folder.write("force.txt",
               "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip,fx[N],fy[N],fz[N]\n0,0,0,0,1,0,0,0,0,0,0,0\n"
               "1,0,0,0.01,1,0,0,0,0,0,0,1\n");
  const std::string log = folder / "run.csv";
  int results = 0;
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {"info", source + "assets/gallbladder/gallbladder.model.xml"},
           {"info", source + "assets/abdomen/liver.model.xml"},
           {"info", source + "assets/liver/liver.obj"},
           {"info", source + "scenes/gallbladder.xml"},
           {"info", folder / "force.txt"},
           {"replay", source + "scenes/gallbladder.xml", "--set", "clock.duration=0.2", "--realtime", "--log", log,
            "--trajectory", folder / "force.txt"},
           {"compare", log, log},
           {"info", log},
           {"replay", source + "scenes/gallbladder.xml", "--set", "clock.duration=0.2", "--cache", folder / "a.cache"},
           {"info", folder / "a.cache"},
           {"check", source + "scenes/gallbladder.xml"},
           {"render", source + "scenes/gallbladder.xml", "--still", "0", "--size", "64x64", "-o", folder / "still.png"},
           {"new", source + "assets/gallbladder/gallbladder.obj", "--spheres", "3", "-o", folder / "new"},
           {"build", source + "assets/gallbladder/gallbladder.obj", "--spheres", "3", "-o", folder / "m.xml"}}) {
    const ProgramResult r = runProgram(arguments);
    ASSERT_EQ(r.exitCode, 0) << r.err;
    std::istringstream lines(r.out);
    for (std::string line; std::getline(lines, line); ++results) expectDocumented(line.substr(0, line.find(' ')), text);
  }
  EXPECT_GT(results, 100);
  const std::string logged = readFile(log);
  folder.write("shorter.csv", logged.substr(0, logged.rfind('\n', logged.size() - 2) + 1));
  const ProgramResult differing = runProgram({"compare", log, folder / "shorter.csv"});
  EXPECT_EQ(differing.exitCode, 3);
  std::istringstream differences(differing.out);
  for (std::string line; std::getline(differences, line);) expectDocumented(line.substr(0, line.find(' ')), text);
  const std::string header = readFile(log).substr(0, readFile(log).find('\n'));
  std::istringstream columns(header);
  for (std::string column; std::getline(columns, column, ',');)
    if (column.size() < 3 || column[column.size() - 2] != '.') expectDocumented(column, text);
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
