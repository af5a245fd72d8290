#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>

#include "app/commands/commands.h"
#include "app/files/golden_report.h"
#include "app/files/output_file.h"
#include "app/files/text.h"
#include "app/interrupt.h"
#include "physics/content_hash.h"
#include "render/flip.h"

namespace medulla {

namespace {

namespace fs = std::filesystem;

// What a golden image says of itself: its scene, relative to its folder; what it was rendered with, which decides the
// tier of the gate; and hashes of the state, of the bodies and behind a blank of the tools as they are shown, which
// tell drift of physics and haptics from drift of the pixels. Older images have the first alone.
constexpr const char* kSceneKey = "medulla:scene";
constexpr const char* kRendererKey = "medulla:renderer";
constexpr const char* kProcessorKey = "medulla:processor";
constexpr const char* kStateKey = "medulla:state";

struct Moment {
  int frame = 0;
  std::string name, bodies, tools;  // <scene>_<frame>; hashes of the state when it was drawn
  Image image;
  std::string state() const { return bodies + " " + tools; }
};

// Of all that a picture shows of its tools: the dynamics' hash sees of these only what they did to the bodies.
std::string toolsHash(const PictureState& state) {
  NumberHash hash;
  const auto add = [&](const auto& numbers) {
    for (const double x : numbers) hash.add(x);
  };
  for (std::size_t k = 0; k < state.tools.size(); ++k) {
    const ToolState& tool = state.tools[k];
    add(state.inputs[k].worldFromTool.coeffs());
    hash.add(state.inputs[k].grip);
    for (const Eigen::Vector3d& v : {tool.device, tool.proxy, tool.force}) add(v);
    for (const bool flag : {tool.inContact, tool.holding}) hash.add(std::uint64_t{flag});
  }
  return fmt::format("{:016x}", hash.value());
}

// What differs from the stored text; empty: nothing.
std::string stateChange(const std::string& stored, const Moment& moment) {
  const std::size_t blank = stored.find(' ');
  if (stored.substr(0, blank) != moment.bodies) return "state differs";
  if (blank != std::string::npos && stored.substr(blank + 1) != moment.tools) return "state of the tools differs";
  return "";
}

std::string textOf(const std::vector<PngText>& texts, const std::string& key) {
  for (const PngText& t : texts)
    if (t.keyword == key) return t.text;
  return {};
}

std::string stemOf(const std::string& path) {
  return fs::path(path).stem().string();
}

std::string processorName() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name")) return line.substr(std::min(line.find(": ") + 2, line.size()));
  return "unknown processor";
}

std::vector<std::string> filesOf(const fs::path& folder, const std::string& extension) {
  std::vector<std::string> paths;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == extension) paths.push_back(entry.path().string());
  std::sort(paths.begin(), paths.end());
  return paths;
}

// A folder of golden images knows its scenes; without one they are those of the current folder's scenes/.
std::vector<std::string> scenesOf(const GoldenOptions& options) {
  if (!options.scenes.empty()) return options.scenes;
  std::vector<std::string> paths;
  for (const std::string& name : options.update)
    if (fs::path(name).extension() == ".xml") paths.push_back(name);
  const bool all = !paths.empty() && paths.size() == options.update.size();
  std::set<fs::path> taken;  // said twice, it is asked for once
  std::erase_if(paths,
                [&](const std::string& path) { return !taken.insert(fs::absolute(path).lexically_normal()).second; });
  if (all) return paths;
  if (options.folder.empty()) {
    paths = filesOf("scenes", ".xml");
    if (paths.empty()) throw std::runtime_error("no scene named and none found: expected scenes/*.xml in this folder");
    return paths;
  }
  std::set<std::string> known;
  for (const std::string& image : filesOf(options.folder, ".png")) {
    std::vector<PngText> texts;
    readPng(image, &texts);
    const std::string scene = textOf(texts, kSceneKey);
    if (!scene.empty()) known.insert((fs::path(options.folder) / scene).lexically_normal().string());
  }
  if (known.empty())
    throw std::runtime_error(
        options.folder + ": no golden image here names its scene: expected a SCENE, or --update SCENE to make them");
  return {known.begin(), known.end()};
}

std::string folderOf(const std::string& scene, const GoldenOptions& options) {
  if (!options.folder.empty()) return options.folder;
  return (fs::absolute(scene).parent_path().parent_path() / "golden_images").lexically_normal().string();
}

// Two scenes of one name would share their images.
void requireDistinctNames(const std::vector<std::string>& scenes, const GoldenOptions& options) {
  std::set<std::string> taken;
  for (const std::string& scene : scenes)
    if (!taken.insert((fs::path(folderOf(scene, options)) / stemOf(scene)).string()).second)
      throw std::runtime_error(
          fmt::format("{}: two scenes of the name {} for one folder of golden images", scene, stemOf(scene)));
}

// NAME of --update: a scene by file or name, or one of its moments.
bool namesScene(const std::string& name, const std::string& scene) {
  return name == stemOf(scene) || fs::path(name).lexically_normal() == fs::path(scene).lexically_normal();
}
bool namesMomentOf(const std::string& name, const std::string& scene) {
  const std::string prefix = stemOf(scene) + "_";
  return name.starts_with(prefix) && name.size() > prefix.size() &&
         name.find_first_not_of("0123456789", prefix.size()) == std::string::npos;
}

std::vector<Moment> momentsOf(const Scene& scene) {
  if (scene.goldenTimes.empty())
    throw std::runtime_error(scene.path + ": names no golden moments: expected <output golden=\"...\"/>");
  std::vector<Moment> moments;
  for (const double time : scene.goldenTimes) {
    Moment moment;
    moment.frame = std::min(static_cast<int>(std::lround(time * scene.fps)), pictureCount(scene) - 1);
    moment.name = fmt::format("{}_{}", stemOf(scene.path), moment.frame);
    moments.push_back(std::move(moment));
  }
  return moments;
}

std::vector<Moment> renderMoments(const std::string& path, const std::string& context, std::string& renderedWith) {
  RunOptions run;
  run.scene = path;
  const LoadedScene loaded = loadRun(run);
  const Scene& scene = loaded.scene;
  std::vector<Moment> moments = momentsOf(scene);
  Simulation simulation(loaded);
  Renderer renderer(rendererSettings(scene.width, scene.height, context, Quality::standard));
  renderedWith = renderer.description();
  const SceneView view(loaded, simulation.current(), renderer);
  std::vector<double> times;
  times.reserve(moments.size());
  for (const Moment& moment : moments) times.push_back(moment.frame / scene.fps);
  PictureTimes pictures(times, 0);
  Picture picture;
  while (!simulation.finished()) {
    checkInterrupt();
    simulation.advanceFrame();
    pictures.afterFrame(simulation, [&](int k, const PictureState& state) {
      view.compose(state, ViewKind::tissue, {}, picture);
      renderer.render(picture, moments[k].image);
      moments[k].bodies = fmt::format("{:016x}", simulation.world().stateHash());
      moments[k].tools = toolsHash(state);
    });
    if (!moments.back().bodies.empty()) break;
  }
  return moments;
}

GoldenResult compare(const Moment& moment, const std::string& goldenPath, const std::string& renderedWith) {
  GoldenResult r;
  r.name = moment.name;
  if (!fs::exists(goldenPath)) {
    r.verdict = goldenPath + " does not exist";
    return r;
  }
  std::vector<PngText> texts;
  Image golden = readPng(goldenPath, &texts);
  r.stored = {textOf(texts, kRendererKey), textOf(texts, kProcessorKey)};
  if (golden.width != moment.image.width || golden.height != moment.image.height) {
    r.verdict =
        fmt::format("size {}x{}, golden {}x{}", moment.image.width, moment.image.height, golden.width, golden.height);
    return r;
  }
  const ImageDifference d = compareImages(moment.image, golden);
  // Same renderer and same state: the very same bytes. Another Mesa, instruction set or mathematical library: within
  // the noise of those, which a missing shadow or the next picture of the video exceeds.
  const bool sameRenderer = r.stored.renderer == renderedWith;
  const std::string change = stateChange(textOf(texts, kStateKey), moment);
  r.passed = sameRenderer && change.empty() ? d.equal : withinTolerance(d);
  if (d.equal) {
    r.verdict = "equal";
    return r;
  }
  r.verdict = fmt::format("{:.4f} % of pixels over 4, {} over 16, PSNR {:.1f} dB, FLIP {:.5f}; {}, renderer {}",
                          d.overFourPercent, d.overSixteen, d.psnr, flipMean(moment.image, golden),
                          change.empty() ? "state as stored" : change, sameRenderer ? "as stored" : "differs");
  r.expected = std::move(golden);
  r.actual = moment.image;
  return r;
}

std::string repeatingCommand(const std::string& path, const GoldenOptions& options) {
  std::string command = "medulla golden " + shellWord(path);
  if (!options.folder.empty()) command += " --dir " + shellWord(options.folder);
  if (options.context != "auto") command += " --context " + options.context;
  return command + " --failures " + shellWord(options.failures);
}

void updateScene(const std::string& path, const GoldenOptions& options) {
  std::string renderedWith;
  const std::string folder = folderOf(path, options);
  const OutputFolder made(folder);
  const std::string scene = fs::proximate(fs::absolute(path), fs::absolute(folder)).string();
  const bool whole = std::any_of(options.update.begin(), options.update.end(),
                                 [&](const std::string& name) { return namesScene(name, path); });
  for (const Moment& m : renderMoments(path, options.context, renderedWith)) {
    if (!whole && std::find(options.update.begin(), options.update.end(), m.name) == options.update.end()) continue;
    const std::string image = fmt::format("{}/{}.png", folder, m.name);
    writePng(
        image, m.image,
        {{kSceneKey, scene}, {kRendererKey, renderedWith}, {kProcessorKey, processorName()}, {kStateKey, m.state()}});
    fmt::print("{} written\n", image);
  }
}

int update(const std::vector<std::string>& scenes, const GoldenOptions& options) {
  std::set<std::string> chosen;
  for (const std::string& name : options.update) {
    const auto scene = std::find_if(scenes.begin(), scenes.end(), [&](const std::string& path) {
      return namesScene(name, path) || namesMomentOf(name, path);
    });
    if (scene == scenes.end()) throw std::runtime_error("--update " + name + ": no such scene and no moment of one");
    const std::vector<Moment> moments = momentsOf(readScene(*scene));
    const bool known = namesScene(name, *scene) ||
                       std::any_of(moments.begin(), moments.end(), [&](const Moment& m) { return m.name == name; });
    if (!known) throw std::runtime_error(fmt::format("--update {}: {} has no such moment", name, *scene));
    chosen.insert(*scene);
  }
  for (const std::string& path : chosen) updateScene(path, options);
  return 0;
}

// Says on standard output how each moment compares; true when all pass.
bool compareScene(const std::string& path, const GoldenOptions& options, std::vector<GoldenResult>& results,
                  std::string& renderedWith) {
  bool allPass = true;
  for (const Moment& m : renderMoments(path, options.context, renderedWith)) {
    GoldenResult r = compare(m, fmt::format("{}/{}.png", folderOf(path, options), m.name), renderedWith);
    r.scene = path;
    fmt::print("{} {}: {}\n", r.name, r.passed ? "ok" : "failed", r.verdict);
    const std::string stem = options.failures + "/" + m.name, actual = stem + "_actual.png",
                      difference = stem + "_difference.png";
    std::error_code missing;
    for (const std::string& earlier : {actual, difference}) fs::remove(earlier, missing);  // of a run that failed
    if (!r.passed && !m.image.pixels.empty()) {
      writePng(actual, m.image);
      if (!r.expected.pixels.empty()) writePng(difference, amplifiedDifference(r.actual, r.expected));
    }
    allPass = allPass && r.passed;
    results.push_back(std::move(r));
  }
  if (!allPass) fmt::print(stderr, "repeat with: {}\n", repeatingCommand(path, options));
  return allPass;
}

}  // namespace

int runGolden(const GoldenOptions& options) {
  const std::vector<std::string> scenes = scenesOf(options);
  requireDistinctNames(scenes, options);
  if (!options.update.empty()) return update(scenes, options);
  const OutputFolder made(options.failures);
  bool allPass = true;
  std::string renderedWith;
  std::vector<GoldenResult> results;
  for (const std::string& path : scenes) allPass = compareScene(path, options, results, renderedWith) && allPass;
  const std::string report = options.failures + "/report.html";
  writeGoldenReport(report, results, {renderedWith, processorName()});
  fmt::print("report {}\n", report);
  return allPass ? 0 : 3;
}

}  // namespace medulla
