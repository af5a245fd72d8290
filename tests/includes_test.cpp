#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <regex>
#include <set>

#include "app/files/text_file.h"

// Arrows between the folders run app -> haptics -> physics and app -> render, never back, and each library is met in as
// few files as it can be.
namespace medulla {
namespace {

const std::filesystem::path sourceFolder = MEDULLA_SOURCE_DIR;

struct Source {
  std::string path;  // relative to the project
  std::vector<std::string> includes;
  long lines = 0;
  std::string folder() const { return path.substr(0, path.find('/')); }
};

std::vector<Source> readSources() {
  std::vector<Source> sources;
  const std::regex include("(?:^|\\n)[ \\t]*#[ \\t]*include[ \\t]*[<\"]([^>\"]+)[>\"]");
  for (const char* folder : {"physics", "haptics", "render", "app", "tests", "assets"}) {
    if (!std::filesystem::exists(sourceFolder / folder)) continue;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(sourceFolder / folder)) {
      const std::string extension = entry.path().extension();
      if (extension != ".h" && extension != ".cpp") continue;
      const std::string text = readTextFile(entry.path());
      Source& source = sources.emplace_back();
      source.path = std::filesystem::relative(entry.path(), sourceFolder);
      source.lines = std::count(text.begin(), text.end(), '\n');
      for (std::sregex_iterator match(text.begin(), text.end(), include), end; match != end; ++match) {
        source.includes.push_back(match->str(1));
      }
    }
  }
  return sources;
}

const std::vector<Source>& sources() {
  static const std::vector<Source> all = readSources();
  return all;
}

// Own files outside the tests that include something of this prefix.
std::set<std::string> filesThatInclude(const std::string& prefix) {
  std::set<std::string> files;
  for (const Source& source : sources()) {
    if (source.folder() == "tests") continue;
    for (const std::string& include : source.includes) {
      if (include.starts_with(prefix)) files.insert(source.path);
    }
  }
  return files;
}

TEST(Includes, AreFoundAtAll) {
  EXPECT_GT(sources().size(), 30u);
  EXPECT_FALSE(filesThatInclude("physics/").empty());
}

TEST(Includes, ArrowsBetweenFoldersNeverRunBack) {
  const std::map<std::string, std::set<std::string>> allowed = {
      {"physics", {"physics"}},
      {"haptics", {"haptics", "physics"}},
      {"render", {"render"}},
      {"app", {"app", "haptics", "physics", "render"}},
      {"assets", {"assets", "physics"}},
      {"tests", {"tests", "app", "haptics", "physics", "render"}},
  };
  const std::regex relative("\\.\\./.*");
  for (const Source& source : sources()) {
    for (const std::string& include : source.includes) {
      EXPECT_FALSE(std::regex_match(include, relative)) << source.path << " includes " << include;
      const std::string folder = include.substr(0, include.find('/'));
      if (folder == include || !allowed.contains(folder)) continue;
      EXPECT_TRUE(allowed.at(source.folder()).contains(folder)) << source.path << " includes " << include;
    }
  }
}

TEST(Includes, OwnHeadersAreNamedFromTheTop) {
  for (const Source& source : sources()) {
    for (const std::string& include : source.includes) {
      const std::filesystem::path beside = (sourceFolder / source.path).parent_path() / include;
      const bool ofAssets = source.folder() == "assets";  // a program of its own
      EXPECT_TRUE(ofAssets || !std::filesystem::exists(beside)) << source.path << " includes " << include;
    }
  }
}

TEST(Includes, LibrariesAreMetInFewFiles) {
  for (const char* prefix : {"embree3/", "GL/osmesa.h", "EGL/egl.h", "assimp/", "tinyxml2.h", "CLI/", "libdeflate.h"}) {
    const std::set<std::string> files = filesThatInclude(prefix);
    EXPECT_EQ(files.size(), 1u) << prefix << " in " << testing::PrintToString(files);
  }
  std::map<std::string, int> stb;
  for (const Source& source : sources()) {
    for (const std::string& include : source.includes) {
      if (include.find("stb_") != std::string::npos && source.folder() != "tests") ++stb[include];
    }
  }
  for (const auto& [header, count] : stb) EXPECT_EQ(count, 1) << header;
}

TEST(Includes, GlmStaysWithThePictureAndEigenBecomesGlmInOnePlace) {
  for (const std::string& file : filesThatInclude("glm/")) {
    EXPECT_TRUE(file.starts_with("render/") || file.starts_with("app/scene_view")) << file;
  }
  for (const std::string& file : filesThatInclude("Eigen/")) EXPECT_FALSE(file.starts_with("render/")) << file;
}

// In the README next above it, as a word of its own.
TEST(Sources, EveryHeaderStandsInAReadme) {
  for (const Source& source : sources()) {
    if (!source.path.ends_with(".h") || source.folder() == "tests") continue;
    const std::filesystem::path header = sourceFolder / source.path;
    std::filesystem::path folder = header.parent_path();
    while (!std::filesystem::exists(folder / "README.md")) folder = folder.parent_path();
    EXPECT_TRUE(
        std::regex_search(readTextFile(folder / "README.md"), std::regex("\\b" + header.stem().string() + "\\b")))
        << source.path << " in " << folder;
  }
}

TEST(Sources, StayShortEnoughToRead) {
  for (const Source& source : sources()) EXPECT_LE(source.lines, 500) << source.path;
}

}  // namespace
}  // namespace medulla
