#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "app/commands/commands.h"
#include "app/files/mesh_file.h"
#include "app/files/model_file.h"
#include "app/files/output_file.h"
#include "app/files/text.h"
#include "app/files/text_file.h"
#include "app/standard_streams.h"
#include "app/starter_scene.h"
#include "haptics/tool_input.h"
#include "render/output_folder.h"

namespace medulla {

namespace fs = std::filesystem;

// A tool starts outside of the body, not farther away than the body is large.
static void requireWithinReach(const std::string& mesh, double metresPerUnit) {
  const double reach = kToolReach / 3;
  for (const Eigen::Vector3d& x : readMesh(mesh, metresPerUnit).vertices)
    if (x.lpNorm<Eigen::Infinity>() > reach)
      throw std::runtime_error(
          fmt::format("{}: reaches {:.3g} m from the origin, expected at most {:.3g} m, which a tool "
                      "can work in; is --unit right?",
                      mesh, x.lpNorm<Eigen::Infinity>(), reach));
}

// What is no plain character becomes one stroke, however many bytes it has; nor are there two hyphens, which would end
// a comment in XML.
static std::string nameOf(const std::string& mesh) {
  std::string out;
  for (const char c : plainName(fs::path(mesh).stem().string()))
    if ((c != '_' && c != '-') || (!out.empty() && out.back() != c)) out += c;
  out.resize(std::min(out.size(), kLongestName));
  if (!out.empty() && out.back() == '_') out.pop_back();
  return out.empty() ? "organ" : out;
}

int runNew(const NewOptions& options) {
  const std::string name = nameOf(options.build.meshes[0]);
  const fs::path folder = options.folder;
  const auto file = [&](const char* ending) { return (folder / (name + ending)).string(); };
  const std::string scenePath = file(".xml"), trajectoryPath = file(".csv"), modelPath = file(".model.xml");
  const auto requireFree = [](const std::string& path) {
    if (fileExists(path)) throw std::runtime_error(path + ": exists already; nothing was written");
  };
  requireWithinReach(options.build.meshes[0], metresPerUnit(options.build.unit));
  const OutputFolder made(options.folder);
  const FolderLock lock(options.folder, options.folder, "another run is making a scene there");
  for (const std::string& path : {scenePath, trajectoryPath, modelPath}) requireFree(path);
  BuildOptions build = options.build;
  build.output = modelPath;
  std::vector<std::string> written{modelPath};  // or not yet
  try {
    runBuild(build);
    const StarterScene starter = starterScene(name, readModel(modelPath));
    const std::pair<std::string, std::string> files[] = {{trajectoryPath, starter.trajectory},
                                                         {scenePath, starter.scene}};
    for (const auto& [path, text] : files) {
      requireFree(path);
      writeFile(path, text);
      written.push_back(path);
    }
    fmt::print("scene {}\n", scenePath);
    flushResults();
  } catch (...) {
    std::error_code missing;
    for (const std::string& path : written) fs::remove(path, missing);
    throw;
  }
  tell("next: medulla render {}\n", shellWord(scenePath));
  return 0;
}

}  // namespace medulla
