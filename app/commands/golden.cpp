#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <filesystem>
#include <fstream>
#include <set>

#include "app/commands/golden_images.h"
#include "app/files/golden_report.h"
#include "app/files/output_file.h"
#include "app/files/text.h"
#include "app/files/text_file.h"
#include "app/interrupt.h"
#include "app/progress.h"
#include "app/standard_streams.h"
#include "app/tool_fields.h"
#include "physics/content_hash.h"
#include "render/flip.h"
#include "render/output_folder.h"

namespace medulla {

namespace {

namespace fs = std::filesystem;

// What a golden image says of itself besides its scene: what it was rendered with, which decides the tier of the gate;
// and hashes of the state, of the bodies and behind a blank of the tools as they are shown, which tell drift of physics
// and haptics from drift of the pixels.
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
  for (std::size_t k = 0; k < state.tools.size(); ++k)
    visitToolNumbers(state.inputs[k], state.tools[k], [&hash](const std::string&, double x) { hash.add(x); });
  return fmt::format("{:016x}", hash.value());
}

// What differs from the stored text; empty: nothing.
std::string stateChange(const std::string& stored, const Moment& moment) {
  if (!stored.starts_with(moment.bodies + " ")) return "state differs";
  return stored == moment.state() ? "" : "state of the tools differs";
}

std::string processorName() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name")) return line.substr(std::min(line.find(": ") + 2, line.size()));
  return "unknown processor";
}

std::runtime_error withoutMoments(const std::string& path) {
  return std::runtime_error(path + ": names no golden moments: expected <output golden=\"...\"/>");
}

std::vector<Moment> momentsOf(const Scene& scene) {
  std::vector<Moment> moments;
  for (const int picture : goldenPictures(scene)) {
    Moment moment;
    moment.frame = picture;
    moment.name = fmt::format("{}_{}", stemOf(scene.path), picture);
    moments.push_back(std::move(moment));
  }
  return moments;
}

std::vector<Moment> renderMoments(const std::string& path, const std::string& context) {
  RunOptions run;
  run.scene = path;
  const LoadedScene loaded = loadRun(run);
  const Scene& scene = loaded.scene;
  std::vector<Moment> moments = momentsOf(scene);
  if (moments.empty()) throw withoutMoments(path);
  Simulation simulation(loaded);
  Renderer renderer(rendererSettings(scene.width, scene.height, context, Quality::standard));
  const SceneView view(loaded, simulation.current(), renderer);
  std::vector<double> times;
  times.reserve(moments.size());
  for (const Moment& moment : moments) times.push_back(moment.frame / scene.fps);
  PictureTimes pictures(times, 0);
  Picture picture;
  Progress progress(stemOf(path), times.back(), "s");
  while (!simulation.finished()) {
    checkInterrupt();
    simulation.advanceFrame();
    progress.update(simulation.time());
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

// Without OpenGL nothing can be compared, whatever the scene.
std::string drawnWith(const GoldenOptions& options) {
  return Renderer(rendererSettings(kPictureSideMin, kPictureSideMin, options.context, Quality::draft)).description();
}

std::vector<std::string> namesOf(const std::vector<Moment>& moments) {
  std::vector<std::string> names;
  names.reserve(moments.size());
  for (const Moment& m : moments) names.push_back(m.name);
  return names;
}

GoldenResult compare(const Moment& moment, const std::string& scene, const std::string& goldenPath,
                     const std::string& renderedWith) {
  GoldenResult r;
  r.name = moment.name;
  r.scene = scene;
  r.actual = moment.image;  // until it is equal
  if (!fileExists(goldenPath)) {
    r.verdict = fmt::format("{} does not exist: --update {} stores it", goldenPath, shellWord(scene));
    return r;
  }
  std::vector<PngText> texts;
  Image golden;
  try {
    golden = readPng(goldenPath, &texts);
  } catch (const std::runtime_error& error) {
    r.verdict = error.what();
    return r;
  }
  r.stored = {textOf(texts, kRendererKey), textOf(texts, kProcessorKey)};
  if (golden.width != moment.image.width || golden.height != moment.image.height) {
    r.verdict =
        fmt::format("size {}x{}, golden {}x{}", moment.image.width, moment.image.height, golden.width, golden.height);
    r.expected = std::move(golden);
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
    r.actual = {};
    return r;
  }
  r.verdict = fmt::format("{:.4f} % of pixels over 4, {} over 16, PSNR {:.1f} dB, FLIP {:.5f}; {}, renderer {}",
                          d.overFourPercent, d.overSixteen, d.psnr, flipMean(moment.image, golden),
                          change.empty() ? "state as stored" : change, sameRenderer ? "as stored" : "differs");
  r.expected = std::move(golden);
  return r;
}

std::string repeatingCommand(const std::string& path, const GoldenOptions& options) {
  std::string command = "medulla golden " + shellWord(path);
  if (!options.folder.empty()) command += " --dir " + shellWord(options.folder);
  if (options.context != "auto") command += " --context " + options.context;
  return command + " --failures " + shellWord(options.failures);
}

// ---- Storing anew ----------------------------------------------------------------------------------------

// What an update does to a folder.
struct Update {
  std::string folder;
  std::vector<std::pair<std::string, std::string>> written;  // path, bytes
  std::vector<std::string> removed;                          // paths
};

Update updateOf(const std::string& path, const GoldenOptions& options, const std::string& renderedWith) {
  Update update;
  update.folder = goldenFolderOf(path, options);
  requireNameFree(path, update.folder);
  // A link to a scene is a scene of its own name.
  const fs::path called = fs::absolute(path);
  const fs::path place = placeOf(called.parent_path().string()) / called.filename();
  const std::string scene = place.lexically_proximate(placeOf(update.folder)).string();
  const bool whole = std::any_of(options.update.begin(), options.update.end(),
                                 [&](const std::string& name) { return namesScene(name, path); });
  const bool none = momentsOf(readScene(path)).empty();  // any more: what is stored goes
  const std::vector<Moment> moments = none ? std::vector<Moment>{} : renderMoments(path, options.context);
  for (const Moment& m : moments) {
    if (!whole && !isOneOf(m.name, options.update)) continue;
    update.written.emplace_back(fmt::format("{}/{}.png", update.folder, m.name),
                                encodePng(m.image, {{kSceneKey, scene},
                                                    {kRendererKey, renderedWith},
                                                    {kProcessorKey, processorName()},
                                                    {kStateKey, m.state()}}));
  }
  if (!whole) return update;
  for (const StrayImage& image : formerMoments(path, update.folder, namesOf(moments)))
    if (image.fault.empty()) update.removed.push_back(image.path);
  if (none && update.removed.empty()) throw withoutMoments(path);
  return update;
}

// All images are whole before the first takes its name: of a full disk nothing is seen.
void apply(const std::vector<Update>& updates) {
  std::deque<OutputFile> files;
  for (const Update& update : updates)
    for (const auto& [path, bytes] : update.written) {
      files.emplace_back(path).write(bytes);
      files.back().finish();
    }
  for (OutputFile& file : files) file.commit();
  for (const Update& update : updates) {
    for (const auto& [path, bytes] : update.written) fmt::print("{} written\n", path);
    for (const std::string& path : update.removed) {
      std::error_code error;
      if (!fs::remove(path, error) && error) throw std::runtime_error(path + ": cannot be removed: " + error.message());
      fmt::print("{} removed: no moment of its scene\n", path);
    }
  }
}

// All scenes are drawn before anything is stored: one that cannot be drawn leaves the folder as it was.
int updateImages(const std::vector<std::string>& scenes, const GoldenOptions& options) {
  std::set<std::string> chosen;
  for (const std::string& name : options.update) {
    const auto scene = std::find_if(scenes.begin(), scenes.end(), [&](const std::string& path) {
      return namesScene(name, path) || namesMomentOf(name, path);
    });
    if (scene == scenes.end())
      throw std::runtime_error(
          fmt::format("--update {}: neither one of the scenes of this call ({}) nor a moment of one; each to be "
                      "updated takes an --update",
                      name, joined(scenes, ", ")));
    const std::vector<std::string> known = namesOf(momentsOf(readScene(*scene)));
    if (!namesScene(name, *scene) && !isOneOf(name, known))
      throw std::runtime_error(fmt::format("--update {}: {} has no such moment", name, *scene));
    const std::string folder = goldenFolderOf(*scene, options);
    for (const std::string& moment : known)
      if (fs::is_directory(folder)) requireWritable({fmt::format("{}/{}.png", folder, moment)});
    chosen.insert(*scene);
  }
  const std::string renderedWith = drawnWith(options);
  std::vector<Update> updates;
  updates.reserve(chosen.size());
  for (const std::string& path : chosen) {
    try {
      updates.push_back(updateOf(path, options, renderedWith));
    } catch (const NotFinite& e) {
      throw std::runtime_error((chosen.size() > 1 ? path + ": " : "") + e.what());
    }
  }
  apply(updates);
  return 0;
}

// ---- Comparing -------------------------------------------------------------------------------------------

// Behind a moment's name, of pictures in the folder of failures.
constexpr const char *kActualEnding = "_actual.png", *kDifferenceEnding = "_difference.png";

struct Comparison {
  std::string renderedWith;
  std::vector<GoldenResult> results;
};

void add(GoldenResult result, Comparison& comparison) {
  fmt::print("{} {}: {}\n", result.name, result.passed ? "ok" : "failed", result.verdict);
  comparison.results.push_back(std::move(result));
}

void addFailure(const std::string& name, const std::string& scene, const std::string& verdict, Comparison& comparison) {
  GoldenResult result;
  result.name = name;
  result.scene = scene;
  result.verdict = verdict;
  add(std::move(result), comparison);
}

// What a former run left of the scene in the folder of failures, also of moments that it no longer has.
void removeEarlierFailures(const std::string& scene, const std::string& folder) {
  std::error_code failure;
  std::vector<fs::path> earlier;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, failure))
    for (const std::string ending : {kActualEnding, kDifferenceEnding}) {
      const std::string file = entry.path().filename().string();
      if (file.ends_with(ending) && namesMomentOf(file.substr(0, file.size() - ending.size()), scene))
        earlier.push_back(entry.path());
    }
  for (const fs::path& path : earlier) fs::remove(path, failure);
}

void writeFailure(const GoldenResult& r, const std::string& folder) {
  if (r.passed) return;
  writePng(folder + "/" + r.name + kActualEnding, r.actual);
  if (hasDifference(r))
    writePng(folder + "/" + r.name + kDifferenceEnding, amplifiedDifference(r.actual, r.expected, kGain));
}

void compareScene(const std::string& path, const GoldenOptions& options, Comparison& comparison) {
  std::vector<Moment> moments;
  removeEarlierFailures(path, options.failures);
  try {
    moments = renderMoments(path, options.context);
  } catch (const std::runtime_error& error) {
    addFailure(stemOf(path), path, error.what(), comparison);
    return;
  }
  const std::string folder = goldenFolderOf(path, options);
  for (const Moment& m : moments) {
    add(compare(m, path, fmt::format("{}/{}.png", folder, m.name), comparison.renderedWith), comparison);
    writeFailure(comparison.results.back(), options.failures);
  }
  for (const StrayImage& image : formerMoments(path, folder, namesOf(moments))) {
    const std::string former = fmt::format("no moment of {}: --update {} removes it", path, stemOf(path));
    addFailure(image.name, path, image.fault.empty() ? former : image.fault, comparison);
  }
}

// What else lies in a folder that is compared as a whole: an image that cannot be read may be any scene's.
void compareRest(const std::vector<std::string>& scenes, const GoldenOptions& options, Comparison& comparison) {
  std::vector<std::string> known;
  for (const GoldenResult& r : comparison.results) known.push_back(r.name);
  std::set<std::string> folders;
  for (const std::string& path : scenes) folders.insert(goldenFolderOf(path, options));
  for (const std::string& folder : folders)
    for (const StrayImage& image : strayImages(folder, known)) {
      const bool isCompared = std::any_of(scenes.begin(), scenes.end(), [&](const std::string& path) {
        return sameFile(path, image.scene) && namesMomentOf(image.name, path);
      });
      if (!image.fault.empty())
        addFailure(image.name, "", image.fault, comparison);
      else if (!image.scene.empty() && !fileExists(image.scene) && !isCompared)
        addFailure(image.name, image.scene, fmt::format("its scene {} does not exist", image.scene), comparison);
      else if (!isCompared)
        tell("note: {} is compared with nothing: {}\n", image.path,
             image.scene.empty() ? "it names no scene" : "it is called as no moment of a scene here");
    }
}

int compareScenes(const std::vector<std::string>& scenes, const GoldenOptions& options) {
  Comparison comparison{drawnWith(options), {}};
  const auto failures = [&] {
    return std::count_if(comparison.results.begin(), comparison.results.end(),
                         [](const GoldenResult& r) { return !r.passed; });
  };
  for (const std::string& path : scenes) {
    const auto before = failures();
    compareScene(path, options, comparison);
    if (failures() > before) tell("repeat with: {}\n", repeatingCommand(path, options));
  }
  if (options.scenes.empty()) compareRest(scenes, options, comparison);
  const std::string report = options.failures + "/report.html";
  writeGoldenReport(report, comparison.results, {comparison.renderedWith, processorName()});
  fmt::print("report {}\n", report);
  return failures() > 0 ? 3 : 0;
}

}  // namespace

// Golden images have a folder of their own.
static void requireApart(const std::string& folder, const GoldenOptions& options) {
  std::error_code none;
  if (fs::exists(folder) && !fs::is_directory(folder)) throw std::runtime_error(folder + ": is no folder");
  if (fs::equivalent(folder, options.failures, none))
    throw std::runtime_error("--failures " + options.failures +
                             ": the golden images lie there, expected another folder");
}

int runGolden(const GoldenOptions& options) {
  const std::vector<std::string> scenes = goldenScenes(options);
  if (!options.update.empty()) return updateImages(scenes, options);
  for (const std::string& scene : scenes) requireApart(goldenFolderOf(scene, options), options);
  const OutputFolder made(options.failures);
  return compareScenes(scenes, options);
}

}  // namespace medulla
