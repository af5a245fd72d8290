#include <fmt/format.h>

#include <filesystem>

#include "app/commands/run.h"
#include "app/files/output_file.h"
#include "app/files/text_file.h"
#include "app/motion_sources.h"
#include "physics/content_hash.h"
#include "physics/model/build.h"

// What a run reads and writes, and what tells it from others.
namespace medulla {

std::vector<std::string> inputFiles(const Scene& scene) {
  std::vector<std::string> inputs{scene.path};
  for (const SceneBody& body : scene.bodies) {
    inputs.push_back(body.modelPath);
    for (const SceneFix& fix : body.fixes) inputs.push_back(fix.nodes.verticesPath);
    for (const SceneLoad& load : body.loads) inputs.insert(inputs.end(), {load.nodes.verticesPath, load.forcesPath});
    if (body.referencePath.empty()) continue;
    inputs.push_back(body.referencePath);
    inputs.push_back(std::filesystem::path(body.referencePath).replace_extension(".time").string());
  }
  for (const SceneStatic& item : scene.statics) inputs.push_back(item.meshPath);
  for (const SceneTool& tool : scene.tools) inputs.insert(inputs.end(), {tool.trajectoryPath, tool.recordingPath});
  std::erase(inputs, "");
  return inputs;
}

std::vector<std::string> outputFiles(const RunOptions& options) {
  std::vector<std::string> outputs{options.logPath, options.cacheToWrite, options.frameTimesPath};
  for (const auto& [tool, path] : options.records) outputs.push_back(path);
  for (const SurfaceRequest& request : options.surfaces) outputs.push_back(request.path);
  std::erase(outputs, "");
  return outputs;
}

void requireDistinctOutputs(const LoadedScene& loaded, const RunOptions& options,
                            const std::vector<std::string>& pictures) {
  std::vector<std::string> outputs = pictures;
  for (const std::string& path : outputFiles(options)) outputs.push_back(path);
  requireDistinctFiles(outputs, inputFiles(loaded.scene));
}

// The scene counts by what it says, the files that it names by their bytes: where they lie does not matter. Meshes
// count by what was read, too: those of glTF have their vertices in files that only their reader knows of.
static std::uint64_t runHash(const LoadedScene& loaded, std::uint64_t scene) {
  // Until rest nothing sleeps, whatever the scene says.
  std::uint64_t hash = contentHash(fmt::format("{} {} {:016x} {}", MEDULLA_VERSION, MEDULLA_MOTION_SOURCES, scene,
                                               loaded.scene.dynamics.sleepAfter));
  for (const std::string& path : inputFiles(loaded.scene))
    if (path != loaded.scene.path && fileExists(path)) hash = contentHash(readBytes(path), hash);
  for (const TriangleMesh& mesh : loaded.statics) hash = contentHash(fmt::format("{:016x}", hashMesh(mesh)), hash);
  return hash;
}

std::uint64_t motionHash(const LoadedScene& loaded) {
  return runHash(loaded, loaded.scene.motionHash);
}

std::uint64_t pictureHash(const LoadedScene& loaded) {
  return runHash(loaded, loaded.scene.contentHash);
}

CacheLayout cacheLayout(const LoadedScene& loaded) {
  CacheLayout layout;
  layout.motionHash = motionHash(loaded);
  layout.fps = loaded.scene.fps;
  for (const SceneBody& body : loaded.scene.bodies)
    layout.bodies.push_back(
        {body.name, static_cast<int>(body.model->spheres.size()), static_cast<int>(body.model->restNodes.size())});
  for (const SceneTool& tool : loaded.scene.tools) layout.tools.push_back(tool.name);
  return layout;
}

}  // namespace medulla
