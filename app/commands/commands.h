#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/commands/run.h"
#include "app/scene_view.h"
#include "physics/model/build.h"

// One function per verb of the command line; each returns the exit code and throws std::runtime_error for bad input.
namespace medulla {

struct BuildOptions {
  std::vector<std::string> meshes;             // at least one
  std::vector<std::string> fine;               // none, or one per mesh
  std::string unit = "m", output, reportPath;  // output: the model, of several meshes a folder for NAME.model.xml each
  BuildSettings settings;                      // spheres: of all meshes together
};
int runBuild(const BuildOptions& options);

struct NewOptions {
  BuildOptions build;  // its output is chosen here
  std::string folder;
};
int runNew(const NewOptions& options);

int runCheck(const RunOptions& options);

// What a model or scene file holds, told apart by its root element.
int runInfo(const std::string& path);

int runReplay(const RunOptions& options);

struct RenderOptions {
  RunOptions run;
  std::vector<std::string> outputs;  // FILE.mp4 or a folder for numbered PNG files
  ViewOptions view;
  std::optional<std::pair<int, int>> size;    // pixels
  std::optional<double> fps;                  // Hz
  std::optional<std::pair<int, int>> frames;  // [first, last)
  std::string context = "auto";
};
int runRender(const RenderOptions& options);

struct GoldenOptions {
  std::vector<std::string> scenes;  // empty: every scenes/*.xml under the current folder
  std::string images;               // empty: golden_images beside the scene's folder
  std::string failures = "out/golden";
  std::string context = "auto";
  bool update = false;
};
int runGolden(const GoldenOptions& options);

int printVersion();

}  // namespace medulla
