#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "app/commands/commands.h"
#include "app/files/model_file.h"
#include "app/files/output_file.h"
#include "app/starter_scene.h"

namespace medulla {

namespace fs = std::filesystem;

// Names of bodies and scenes are letters, digits, _ and -; those of mesh files may be anything.
static std::string nameFrom(const std::string& meshPath) {
  std::string name = fs::path(meshPath).stem().string();
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return !((c < 128 && std::isalnum(c)) || c == '_' || c == '-'); },
      '_');
  return name;
}

int runNew(const NewOptions& options) {
  const std::string name = nameFrom(options.build.meshes[0]);
  const fs::path folder = options.folder;
  const auto file = [&](const char* ending) { return (folder / (name + ending)).string(); };
  const std::string scenePath = file(".xml"), trajectoryPath = file(".csv"), modelPath = file(".model.xml");
  for (const std::string& path : {scenePath, trajectoryPath, modelPath})
    if (fs::exists(path)) throw std::runtime_error(path + ": exists already; nothing was written");
  std::error_code error;
  const bool made = fs::create_directories(folder, error);
  if (error) throw std::runtime_error(fmt::format("{}: cannot be made: {}", options.folder, error.message()));
  BuildOptions build = options.build;
  build.output = modelPath;
  try {
    runBuild(build);
  } catch (...) {
    if (made) fs::remove(folder, error);  // empty again
    throw;
  }
  const StarterScene starter = starterScene(name, readModel(modelPath));
  writeText(trajectoryPath, starter.trajectory);
  writeText(scenePath, starter.scene);
  fmt::print("scene {}\n", scenePath);
  fmt::print(stderr, "next: medulla render {}\n", scenePath);
  return 0;
}

}  // namespace medulla
