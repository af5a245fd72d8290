#pragma once

#include <string>
#include <vector>

#include "app/commands/commands.h"
#include "render/image.h"

// Which scenes a folder of golden images belongs to, and which of its images belong to a scene.
namespace medulla {

// The text of a golden image that names its scene, relative to the image's folder.
inline constexpr const char* kSceneKey = "medulla:scene";

std::string textOf(const std::vector<PngText>& texts, const std::string& key);  // empty: none of that key

std::string stemOf(const std::string& path);  // the file's name without its ending
std::string goldenFolderOf(const std::string& scene, const GoldenOptions& options);

// Those that the options name, else those that the images of their folder name, else the current folder's
// scenes/*.xml. Throws std::runtime_error where there are none, where one that is named does not exist, and where two
// would share their images.
std::vector<std::string> goldenScenes(const GoldenOptions& options);

// NAME of --update: a scene by file or name; what can be one of its moments by name.
bool namesScene(const std::string& name, const std::string& scene);
bool namesMomentOf(const std::string& name, const std::string& scene);

// A stored image that is compared with nothing.
struct StrayImage {
  std::string path, name;
  std::string scene;  // as a path from here; empty: it names none
  std::string fault;  // why it cannot be read; empty: it can
};

// Of those in the folder that are not called as one of `known`, the images that are called as moments of the scene and
// cannot be read, or were stored for it: moments that it no longer has.
std::vector<StrayImage> formerMoments(const std::string& scene, const std::string& folder,
                                      const std::vector<std::string>& known);
// Throws std::runtime_error where the folder holds such images that were stored for another scene, which is still
// there.
void requireNameFree(const std::string& scene, const std::string& folder);
// All images of the folder that are not called as one of `known`.
std::vector<StrayImage> strayImages(const std::string& folder, const std::vector<std::string>& known);

bool sameFile(const std::string& a, const std::string& b);  // by their paths; they need not exist

}  // namespace medulla
