#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "app/commands/commands.h"
#include "app/enum_names.h"
#include "app/files/mesh_file.h"
#include "app/files/number_text.h"
#include "app/files/output_file.h"
#include "app/files/text.h"
#include "app/standard_streams.h"
#include "app/verbs.h"
#include "render/video_writer.h"

// The verbs that run a scene, draw it or tell what is in it.
namespace medulla {

namespace {

std::optional<std::pair<int, int>> splitPair(const std::string& text, char separator) {
  const std::size_t at = text.find(separator);
  if (at == std::string::npos) return std::nullopt;
  const auto a = parseNumber<int>(text.substr(0, at)), b = parseNumber<int>(text.substr(at + 1));
  if (!a || !b) return std::nullopt;
  return std::make_pair(*a, *b);
}

void addRunOptions(CLI::App& command, RunArguments& a) {
  command
      .add_option("--embree", a.embree,
                  "how Embree runs: isa=sse2|sse4.2|avx|avx2|avx512, threads=N; the results are the same")
      ->type_name("KEY=VALUE,...");
  command.add_option("--log", a.log, "write a CSV row per dynamics frame: tools, forces, volume, energies")
      ->type_name("FILE.csv");
  command.add_option("--log-rate", a.logRate, "rows of the log: per dynamics frame or per servo tick")
      ->check(CLI::IsMember({"frame", "tick"}))
      ->capture_default_str();
  command
      .add_option("--frame-times", a.frameTimes,
                  "write what servo and dynamics took, ms per dynamics frame (CSV); for medulla plot")
      ->type_name("FILE.csv");
  command
      .add_option("--record", a.records,
                  "write a tool's motion and force, tick by tick, as a trajectory; read back by --trajectory it gives "
                  "the same hash, but for --realtime (repeatable)")
      ->type_name("[TOOL=]FILE.csv")
      ->allow_extra_args(false);
  command
      .add_option("--surface-at", a.surfaces, "write the bodies' surfaces at time T (s) or \"end\" as OBJ (repeatable)")
      ->type_name("T FILE.obj")
      ->type_size(2)
      ->allow_extra_args(false);
}

struct RenderArguments {
  RunArguments run;
  std::vector<std::string> scenes, outputs;
  std::string size, fps, frames, still, quality, cache, context = "auto";
  std::vector<std::string> view = {"tissue"}, show;
  bool resume = false, timings = false;
};

// "{scene}" in the name of a file stands for the scene file's, without its ending: so several scenes have files of
// their own.
std::string fileOf(const std::string& scene, std::string path) {
  const std::string place = "{scene}", name = std::filesystem::path(scene).stem().string();
  for (std::size_t at = path.find(place); at != std::string::npos; at = path.find(place, at + name.size()))
    path.replace(at, place.size(), name);
  return path;
}

void readPictures(const RenderArguments& a, RenderOptions& options) {
  if (!a.size.empty()) {
    options.size = splitPair(a.size, 'x');
    if (!options.size)
      usageError("--size", a.size,
                 fmt::format("WIDTHxHEIGHT, numbers from {} to {}, even for videos", kPictureSideMin, kPictureSideMax));
  }
  if (!a.frames.empty()) {
    options.frames = splitPair(a.frames, ':');
    if (!options.frames) usageError("--frames", a.frames, "A:B, whole numbers, B excluded");
  }
  if (!a.fps.empty()) options.fps = parseNumber<double>(a.fps);
  if (!a.still.empty()) options.still = parseNumber<double>(a.still);
}

void readView(const RenderArguments& a, ViewOptions& view) {
  view.panels.clear();
  for (const std::string& name : a.view) view.panels.push_back(valueNamed<ViewKind>(name));
  try {
    view.shown = readShown(a.show);
  } catch (const std::invalid_argument& error) {
    throw CLI::ValidationError("--show " + joined(a.show, ","), error.what());
  }
  const auto isTissue = [](ViewKind kind) { return kind == ViewKind::tissue; };
  if (namesModelPart(a.show) && std::all_of(view.panels.begin(), view.panels.end(), isTissue))
    usageError("--show", joined(a.show, ","), "--view model, both or tissue,model with it: skins hide the model");
}

RenderOptions renderOptions(const RenderArguments& a, const std::string& scene) {
  RunArguments run = a.run;
  run.scene = scene;
  for (std::string* file : {&run.log, &run.frameTimes}) *file = fileOf(scene, *file);
  for (std::string& record : run.records) record = fileOf(scene, record);
  for (std::vector<std::string>& surface : run.surfaces) surface.at(1) = fileOf(scene, surface.at(1));
  RenderOptions options;
  options.run = runOptions(run);
  options.cacheToRead = fileOf(scene, a.cache);
  for (const std::string& output : a.outputs) options.outputs.push_back(fileOf(scene, output));
  if (options.outputs.empty()) options.outputs = {fileOf(scene, a.still.empty() ? "{scene}.mp4" : "{scene}.png")};
  readView(a, options.view);
  readPictures(a, options);
  if (options.still) options.quality = Quality::best;
  options.run.isExcerpt = options.still.has_value();
  if (!a.quality.empty()) options.quality = valueNamed<Quality>(a.quality);
  options.context = a.context;
  options.resume = a.resume;
  options.timings = a.timings;
  return options;
}

// What stands in braces is to be {scene}.
void checkPlaces(const std::string& file, bool several) {
  if (several && file.find("{scene}") == std::string::npos)
    usageError("of several scenes", file, "a name with {scene} in it, which becomes each file's name");
  for (std::size_t at = file.find('{'); at != std::string::npos; at = file.find('{', at + 1)) {
    const std::size_t end = file.find('}', at);
    if (end == std::string::npos) return;
    if (const std::string place = file.substr(at, end + 1 - at); place != "{scene}")
      usageError(place, "in " + file, "{scene}, which becomes the scene file's name");
  }
}

// Each scene has files of its own, and a run that takes up another draws nothing twice.
void checkRender(const RenderArguments& a) {
  std::vector<std::string> files = a.outputs;
  for (const std::string& more : {a.run.log, a.run.frameTimes, a.cache})
    if (!more.empty()) files.push_back(more);
  for (const auto& surface : a.run.surfaces) files.push_back(surface.at(1));
  files.insert(files.end(), a.run.records.begin(), a.run.records.end());
  for (const std::string& file : files) checkPlaces(file, a.scenes.size() > 1);
  const bool asksForRun = !a.run.log.empty() || !a.run.frameTimes.empty() || !a.run.surfaces.empty() ||
                          !a.run.records.empty() || isOneOf("force", a.show);
  if (!a.cache.empty() && asksForRun)
    usageError("--cache", a.cache,
               "no --log, --frame-times, --surface-at, --record or --show force: nothing is simulated, and a cache has "
               "pictures only, no ticks");
  if (!a.resume) return;
  if (a.outputs.empty() || !a.still.empty()) usageError("--resume", "", "-o DIR: folders of PNG files can be resumed");
  for (const std::string& output : a.outputs)
    if (isVideoName(output)) usageError("--resume", output, "a folder: videos are made in one go");
}

// Before any film, since what one run writes may be what another reads. Scenes that cannot be loaded show as well.
void requireDistinctRuns(const std::vector<RenderOptions>& all) {
  std::vector<std::string> outputs, inputs;
  const auto append = [](const std::vector<std::string>& files, std::vector<std::string>& to) {
    to.insert(to.end(), files.begin(), files.end());
  };
  for (const RenderOptions& options : all) {
    append(options.outputs, outputs);
    append(outputFiles(options.run), outputs);
    append(inputFiles(loadRun(options.run).scene), inputs);
    inputs.push_back(options.cacheToRead);
  }
  requireDistinctFiles(outputs, inputs);
}

int runRenders(const RenderArguments& a) {
  checkRender(a);
  std::vector<RenderOptions> all;
  for (const std::string& scene : a.scenes) all.push_back(renderOptions(a, scene));
  if (all.size() > 1) requireDistinctRuns(all);
  for (const RenderOptions& options : all) {
    try {
      runRender(options);
    } catch (const NotFinite& e) {
      throw std::runtime_error((all.size() > 1 ? options.run.scene + ": " : "") + e.what());
    }
    flushResults();
  }
  return 0;
}

void addPictureOptions(CLI::App* c, RenderArguments& a) {
  c->add_option("--view", a.view,
                "tissue: skins; model: what they hide; both: seen through; several stand side by side: tissue,model")
      ->delimiter(',')
      ->check(CLI::IsMember(namesOf(ViewKind{})))
      ->type_name("KIND,...")
      ->expected(1, 3)
      ->allow_extra_args(false)
      ->default_str("tissue");
  std::string parts = "draw also:";
  for (const ShownPart& part : shownParts()) parts += fmt::format(" {} ({}),", part.name, part.meaning);
  parts.back() = ';';
  parts += " of the model what is named [mesh,spheres,links]; force shows every tick, and is not drawn from a --cache";
  c->add_option("--show", a.show, parts)->delimiter(',')->type_name("PART,...")->allow_extra_args(false);
  c->add_option("--size", a.size,
                fmt::format("picture size in pixels, from {} to {}, of videos even numbers (default: the scene's)",
                            kPictureSideMin, kPictureSideMax))
      ->type_name("WxH");
  c->add_option(
       "--quality", a.quality,
       "draft: no shadows, jagged edges; standard; best: four times the pixels, averaged [standard; of a still "
       "best]")
      ->check(CLI::IsMember(namesOf(Quality{})));
  c->add_option("--fps", a.fps, "pictures per second, 1 to 240 (default: the scene's)")
      ->check(numberFrom(1, 240))
      ->type_name("HZ");
  CLI::Option* frames =
      c->add_option("--frames", a.frames,
                    "only pictures A to B-1, counted from 0; the run goes on to its end, for its log and hash")
          ->type_name("A:B");
  c->add_option("--still", a.still, "one picture at time T (s) into FILE.png")
      ->check(numberFrom(0, kEndless, "a time in seconds"))
      ->type_name("T")
      ->excludes(frames);
  c->add_option("--cache", a.cache,
                "draw the states that replay --cache wrote instead of simulating; these lack the ticks of --show force")
      ->type_name("FILE");
  addContext(*c, a.context);
}

}  // namespace

Verb addRender(CLI::App& app) {
  const auto arguments = std::make_shared<RenderArguments>();
  RenderArguments& a = *arguments;
  CLI::App* c = app.add_subcommand("render", "run scenes and draw them into videos or numbered PNG files");
  c->add_option("SCENE", a.scenes, "scene files (XML)")->required();
  addOverrides(*c, a.run);
  addRunOptions(*c, a.run);
  c->add_option("-o,--output", a.outputs,
                "FILE.mp4, .webm, .gif or .webp, or a folder for PNG files; {scene} in it is the scene file's name "
                "without its ending; repeatable (default: {scene}.mp4, of a still {scene}.png)")
      ->type_name("FILE|DIR")
      ->allow_extra_args(false);
  addPictureOptions(c, a);
  c->add_flag("--resume", a.resume,
              "take over the PNG files that an ended run of the same pictures left, and leave one's own");
  c->add_flag("--timings", a.timings, "tell at the end what took how long, on standard error");
  return {c, [arguments] { return runRenders(*arguments); }};
}

Verb addReplay(CLI::App& app) {
  struct Arguments {
    RunArguments run;
    std::string cache;
    bool untilRest = false, realtime = false;
  };
  const auto a = std::make_shared<Arguments>();
  CLI::App* c = app.add_subcommand("replay", "run a scene without pictures, as fast as it goes, and print its results");
  addSceneOptions(*c, a->run);
  addRunOptions(*c, a->run);
  c->add_option("--cache", a->cache,
                "write what every picture shows, for medulla render --cache; not the ticks of --show force")
      ->type_name("FILE.cache");
  c->add_flag("--realtime", a->realtime,
              "run against the clock: the servo in a thread of its own at its rate, the dynamics in another; tells CPU "
              "times of ticks, and which came late");
  c->add_flag("--until-rest", a->untilRest,
              "end when no body has moved for a swing of its slowest mode, no load is still growing and no tool moves "
              "any more; none sleeps before; "
              "exit code 4 and no files where that is not before the scene's duration");
  return {c, [a] {
            RunOptions options = runOptions(a->run);
            options.untilRest = a->untilRest;
            refuseOtherKinds("--cache", a->cache, ".cache");
            options.cacheToWrite = a->cache;
            options.realtime = a->realtime;
            if (a->realtime && !a->cache.empty())
              usageError("--cache", a->cache, "no --realtime: what pictures show is not recorded against the clock");
            return runReplay(options);
          }};
}

Verb addCheck(CLI::App& app) {
  const auto a = std::make_shared<RunArguments>();
  CLI::App* c = app.add_subcommand("check", "say whether a scene and all that it names can run");
  addSceneOptions(*c, *a);
  return {c, [a] { return runCheck(runOptions(*a)); }};
}

Verb addInfo(CLI::App& app) {
  const auto options = std::make_shared<InfoOptions>();
  CLI::App* c = app.add_subcommand("info", "tell what is in a file: mesh, model, scene, motion, log or state cache");
  c->add_option(
       "FILE", options->path,
       "mesh (OBJ, OFF, STL, PLY, ...), model, scene or recording (XML), trajectory or log (CSV), or state cache")
      ->required();
  const CLI::Option* unit = c->add_option("--unit", options->unit, "unit of a mesh file")
                                ->check(CLI::IsMember(lengthUnits()))
                                ->capture_default_str();
  return {c, [options, unit] {
            if (unit->count() > 0 && !isMeshFile(options->path))
              usageError("--unit", options->unit, "a mesh with it: other files are in metres");
            return runInfo(*options);
          }};
}

}  // namespace medulla
