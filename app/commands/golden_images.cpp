#include "app/commands/golden_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <set>

#include "app/files/output_file.h"
#include "app/files/text.h"
#include "app/files/text_file.h"

namespace medulla {

namespace fs = std::filesystem;

namespace {

std::vector<std::string> filesOf(const fs::path& folder, const std::string& extension) {
  std::vector<std::string> paths;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == extension) paths.push_back(entry.path().string());
  std::sort(paths.begin(), paths.end());
  return paths;
}

StrayImage lookInto(const std::string& path) {
  StrayImage image{path, stemOf(path), "", ""};
  try {
    std::vector<PngText> texts;
    readPng(path, &texts);
    const std::string scene = textOf(texts, kSceneKey);
    if (!scene.empty()) image.scene = normalised(fs::path(path).parent_path() / scene).string();
  } catch (const std::runtime_error& error) {
    image.fault = error.what();
  }
  return image;
}

std::vector<StrayImage> imagesCalled(const std::string& folder, const std::function<bool(const std::string&)>& wanted) {
  std::vector<StrayImage> images;
  for (const std::string& path : filesOf(folder, ".png"))
    if (wanted(stemOf(path))) images.push_back(lookInto(path));
  return images;
}

// Where all that is to be updated are files of scenes.
std::vector<std::string> updatedScenes(const GoldenOptions& options) {
  std::vector<std::string> paths;
  for (const std::string& name : options.update)
    if (fs::path(name).extension() == ".xml") paths.push_back(name);
  if (paths.size() != options.update.size()) return {};
  std::set<fs::path> taken;  // said twice, it is asked for once
  std::erase_if(paths, [&](const std::string& path) { return !taken.insert(placeOf(path)).second; });
  return paths;
}

// One that cannot be read is told where the others are compared; it is all there is to tell where it is alone.
std::vector<std::string> scenesNamedIn(const std::string& folder) {
  std::set<std::string> known;
  std::string fault;
  for (const StrayImage& image : strayImages(folder, {})) {
    if (!image.scene.empty()) known.insert(image.scene);
    if (fault.empty()) fault = image.fault;
  }
  std::error_code failure;
  const fs::directory_iterator readable(folder, failure);
  if (failure) throw std::runtime_error(fmt::format("{}: {}", folder, failure.message()));
  if (known.empty() && !fault.empty()) throw std::runtime_error(fault);
  if (known.empty())
    throw std::runtime_error(
        folder + ": no golden image here names its scene: expected a SCENE, or --update SCENE to make them");
  return {known.begin(), known.end()};
}

std::vector<std::string> chosenScenes(const GoldenOptions& options) {
  for (const std::string& scene : options.scenes)
    if (!fileExists(scene)) throw std::runtime_error(scene + ": does not exist, expected a scene file (XML)");
  if (!options.scenes.empty()) return options.scenes;
  if (std::vector<std::string> updated = updatedScenes(options); !updated.empty()) return updated;
  if (!options.folder.empty()) return scenesNamedIn(options.folder);
  std::vector<std::string> paths = filesOf("scenes", ".xml");
  if (paths.empty()) throw std::runtime_error("no scene named and none found: expected scenes/*.xml in this folder");
  return paths;
}

}  // namespace

std::string textOf(const std::vector<PngText>& texts, const std::string& key) {
  for (const PngText& t : texts)
    if (t.keyword == key) return t.text;
  return {};
}

std::string stemOf(const std::string& path) {
  return fs::path(path).stem().string();
}

std::string goldenFolderOf(const std::string& scene, const GoldenOptions& options) {
  if (!options.folder.empty()) return options.folder;
  return (normalised(fs::absolute(scene)).parent_path().parent_path() / "golden_images").string();
}

std::vector<std::string> goldenScenes(const GoldenOptions& options) {
  std::vector<std::string> scenes = chosenScenes(options);
  std::set<std::string> taken;
  for (const std::string& scene : scenes)
    if (!taken.insert((fs::path(goldenFolderOf(scene, options)) / stemOf(scene)).string()).second)
      throw std::runtime_error(
          fmt::format("{}: two scenes of the name {} for one folder of golden images", scene, stemOf(scene)));
  return scenes;
}

bool namesScene(const std::string& name, const std::string& scene) {
  return name == stemOf(scene) || sameFile(name, scene);
}

bool namesMomentOf(const std::string& name, const std::string& scene) {
  const std::string prefix = stemOf(scene) + "_";
  return name.starts_with(prefix) && name.size() > prefix.size() &&
         name.find_first_not_of("0123456789", prefix.size()) == std::string::npos;
}

std::vector<StrayImage> formerMoments(const std::string& scene, const std::string& folder,
                                      const std::vector<std::string>& known) {
  std::vector<StrayImage> images = imagesCalled(
      folder, [&](const std::string& name) { return namesMomentOf(name, scene) && !isOneOf(name, known); });
  std::erase_if(images, [&](const StrayImage& image) { return image.fault.empty() && !sameFile(image.scene, scene); });
  return images;
}

void requireNameFree(const std::string& scene, const std::string& folder) {
  for (const StrayImage& image :
       imagesCalled(folder, [&](const std::string& name) { return namesMomentOf(name, scene); }))
    if (fileExists(image.scene) && !sameFile(image.scene, scene))
      throw std::runtime_error(fmt::format("{}: two scenes of the name {} for one folder of golden images: {} is of {}",
                                           scene, stemOf(scene), image.path, image.scene));
}

std::vector<StrayImage> strayImages(const std::string& folder, const std::vector<std::string>& known) {
  return imagesCalled(folder, [&](const std::string& name) { return !isOneOf(name, known); });
}

bool sameFile(const std::string& a, const std::string& b) {
  if (a.empty() || b.empty()) return false;
  return placeOf(a) == placeOf(b);
}

}  // namespace medulla
