#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "app/commands/commands.h"
#include "app/interrupt.h"

namespace medulla {

namespace {

namespace fs = std::filesystem;

// What a golden image was rendered with: decides which tier of the gate applies.
constexpr const char* kRendererKey = "medulla:renderer";
constexpr const char* kStateKey = "medulla:state";

struct Moment {
  int frame = 0;
  std::string name, state;  // <scene>_<frame>; state hash when it was drawn
  Image image;
};

std::vector<std::string> allScenes() {
  std::vector<std::string> paths;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("scenes", error))
    if (entry.path().extension() == ".xml") paths.push_back(entry.path().string());
  if (paths.empty()) throw std::runtime_error("no scene named and none found: expected scenes/*.xml in this folder");
  std::sort(paths.begin(), paths.end());
  return paths;
}

std::vector<Moment> renderMoments(const std::string& path, const std::string& context, std::string& renderedWith) {
  RunOptions run;
  run.scene = path;
  const LoadedScene loaded = loadRun(run);
  const Scene& scene = loaded.scene;
  Simulation simulation(loaded);
  Renderer renderer({.width = scene.width, .height = scene.height, .context = context});
  renderedWith = renderer.description();
  const SceneView view(loaded, simulation.current(), renderer);
  if (scene.goldenTimes.empty())
    throw std::runtime_error(path + ": names no golden moments: expected <output golden=\"...\"/>");
  const int pictures = static_cast<int>(std::ceil(scene.duration * scene.fps - 1e-9));
  std::vector<Moment> moments;
  for (double time : scene.goldenTimes) {
    Moment moment;
    moment.frame = std::min(static_cast<int>(std::lround(time * scene.fps)), pictures - 1);
    moment.name = fmt::format("{}_{}", fs::path(path).stem().string(), moment.frame);
    moments.push_back(std::move(moment));
  }
  std::sort(moments.begin(), moments.end(), [](const Moment& a, const Moment& b) { return a.frame < b.frame; });
  PictureState state;
  Picture picture;
  std::size_t next = 0;
  while (!simulation.finished() && next < moments.size()) {
    checkInterrupt();
    simulation.advanceFrame();
    const double end = simulation.record().start + simulation.record().duration;
    for (; next < moments.size() && moments[next].frame / scene.fps <= end + 1e-9; ++next) {
      stateAt(simulation.record(), moments[next].frame / scene.fps, state);
      view.compose(state, {}, picture);
      renderer.render(picture, moments[next].image);
      moments[next].state = fmt::format("{:016x}", simulation.world().stateHash());
    }
  }
  return moments;
}

std::string textOf(const std::vector<PngText>& texts, const std::string& key) {
  for (const PngText& t : texts)
    if (t.keyword == key) return t.text;
  return {};
}

// Says on standard output how the picture compares; true when it passes.
bool passes(const Moment& moment, const std::string& goldenPath, const std::string& renderedWith,
            const GoldenOptions& options) {
  const auto fail = [&](const std::string& why) {
    fmt::print("{} failed: {}\n", moment.name, why);
    return false;
  };
  if (!fs::exists(goldenPath)) return fail(goldenPath + " does not exist");
  std::vector<PngText> texts;
  const Image golden = readPng(goldenPath, &texts);
  if (golden.width != moment.image.width || golden.height != moment.image.height)
    return fail(
        fmt::format("size {}x{}, golden {}x{}", moment.image.width, moment.image.height, golden.width, golden.height));
  const ImageDifference d = compareImages(moment.image, golden);
  // Same renderer and same state: the very same bytes. Another Mesa, instruction set or mathematical library: within
  // the noise of those, which a missing shadow or the next picture of the video exceeds.
  const bool sameRenderer = textOf(texts, kRendererKey) == renderedWith;
  const bool sameState = textOf(texts, kStateKey) == moment.state;
  const bool exact = sameRenderer && sameState;
  const std::string figures =
      fmt::format("{:.4f} % of pixels over 4, {} over 16, PSNR {:.1f} dB; state {}, renderer {}", d.overFourPercent,
                  d.overSixteen, d.psnr, sameState ? "as stored" : "differs", sameRenderer ? "as stored" : "differs");
  if (exact ? d.equal : withinTolerance(d)) {
    fmt::print("{} ok: {}\n", moment.name, d.equal ? "equal" : figures);
    return true;
  }
  fs::create_directories(options.failures);
  writePng(fmt::format("{}/{}_actual.png", options.failures, moment.name), moment.image);
  writePng(fmt::format("{}/{}_difference.png", options.failures, moment.name),
           amplifiedDifference(moment.image, golden));
  return fail(fmt::format("{}; see {}/{}_*.png", figures, options.failures, moment.name));
}

std::string repeatingCommand(const std::string& path, const GoldenOptions& options) {
  std::string command = "medulla golden " + path;
  if (!options.images.empty()) command += " --images " + options.images;
  if (options.context != "auto") command += " --context " + options.context;
  return command + " --failures " + options.failures;
}

}  // namespace

int runGolden(const GoldenOptions& options) {
  const std::vector<std::string> scenes = options.scenes.empty() ? allScenes() : options.scenes;
  bool allPass = true;
  for (const std::string& path : scenes) {
    std::string renderedWith;
    const std::vector<Moment> moments = renderMoments(path, options.context, renderedWith);
    const fs::path folder = options.images.empty() ? fs::absolute(path).parent_path().parent_path() / "golden_images"
                                                   : fs::path(options.images);
    bool scenePasses = true;
    for (const Moment& moment : moments) {
      const std::string goldenPath = (folder / (moment.name + ".png")).string();
      if (options.update) {
        fs::create_directories(folder);
        writePng(goldenPath, moment.image, {{kRendererKey, renderedWith}, {kStateKey, moment.state}});
        fmt::print("{} written\n", goldenPath);
      } else {
        scenePasses = passes(moment, goldenPath, renderedWith, options) && scenePasses;
      }
    }
    if (!scenePasses) fmt::print(stderr, "repeat with: {}\n", repeatingCommand(path, options));
    allPass = allPass && scenePasses;
  }
  return allPass ? 0 : 3;
}

}  // namespace medulla
