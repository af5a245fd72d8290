#include "app/command_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "app/commands/commands.h"
#include "app/commands/rest_watch.h"
#include "app/enum_names.h"
#include "app/files/number_text.h"
#include "app/files/output_file.h"
#include "app/files/text.h"
#include "app/interrupt.h"
#include "app/verbs.h"
#include "render/video_writer.h"

namespace medulla {

namespace {

constexpr const char* kIntroduction =
    "Medulla renders deformable organs without a display: soft bodies made of filling spheres,\n"
    "pressed, pulled and grabbed by a recorded or scripted haptic trajectory.\n\n"
    "  medulla render scenes/gallbladder.xml -o gallbladder.mp4   draw a scene into a video\n"
    "  medulla replay scenes/gallbladder.xml --log run.csv        run it without pictures\n"
    "  medulla new organ.obj -o organ                             make a scene around your own mesh\n"
    "  medulla build organ.obj -o organ.model.xml --spheres 12    make a model of it alone\n"
    "  medulla check organ/organ.xml                              find mistakes without running\n"
    "  medulla golden                                             compare with the golden images";

constexpr const char* kExitCodes =
    "Results go to standard output as \"name value [unit]\" lines, everything else to standard error.\n"
    "Exit codes: 0 done, 1 input or run failed, 2 wrong usage, 3 mismatch, 4 not at rest in\n"
    "time, 130 interrupted.";

std::optional<std::pair<int, int>> splitPair(const std::string& text, char separator) {
  const std::size_t at = text.find(separator);
  if (at == std::string::npos) return std::nullopt;
  const auto a = parseNumber<int>(text.substr(0, at)), b = parseNumber<int>(text.substr(at + 1));
  if (!a || !b) return std::nullopt;
  return std::make_pair(*a, *b);
}

// From [TOOL=]FILE.
std::map<std::string, std::string> filesByTool(const std::string& option, const std::vector<std::string>& words) {
  std::map<std::string, std::string> out;
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    const bool named = equals != std::string::npos;
    if (equals == word.size() - 1) usageError(option, word, "a file behind the =");
    const bool isFirst =
        out.try_emplace(named ? word.substr(0, equals) : "", named ? word.substr(equals + 1) : word).second;
    if (!isFirst) usageError(option, word, "one file per tool");
  }
  return out;
}

void addOverrides(CLI::App& command, RunArguments& a) {
  command
      .add_option("--set", a.sets, "replace one value of the scene, e.g. body.gallbladder.surface=skin (repeatable)")
      ->type_name("PATH=VALUE")
      ->allow_extra_args(false);
  command
      .add_option("--trajectory", a.trajectories,
                  "read a tool's motion from another file: a trajectory (CSV), or XML that describes a recording of "
                  "another program (repeatable)")
      ->type_name("[TOOL=]FILE")
      ->allow_extra_args(false);
}

void addRunOptions(CLI::App& command, RunArguments& a) {
  command
      .add_option("--embree", a.embree,
                  "how Embree runs: isa=sse2|sse4.2|avx|avx2|avx512, threads=N; the results are the same")
      ->type_name("KEY=VALUE,...");
  command.add_option("--log", a.log, "write a CSV row per dynamics frame: tools, forces, volume, energies")
      ->type_name("FILE");
  command.add_option("--log-rate", a.logRate, "rows of the log: per dynamics frame or per servo tick")
      ->check(CLI::IsMember({"frame", "tick"}))
      ->capture_default_str();
  command
      .add_option("--frame-times", a.frameTimes,
                  "write what servo and dynamics took, ms per dynamics frame (CSV); for medulla plot")
      ->type_name("FILE");
  command
      .add_option("--record", a.records,
                  "write a tool's motion and force, tick by tick, as a trajectory; read back by --trajectory it gives "
                  "the same hash (repeatable)")
      ->type_name("[TOOL=]FILE")
      ->allow_extra_args(false);
  command
      .add_option("--surface-at", a.surfaces, "write the bodies' surfaces at time T (s) or \"end\" as OBJ (repeatable)")
      ->type_name("T FILE.obj")
      ->type_size(2)
      ->allow_extra_args(false);
}

EmbreeSettings embreeSettings(const std::string& text) {
  EmbreeSettings settings;
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find(',', start), text.size()), equals = text.find('=', start);
    const std::string key = text.substr(start, std::min(equals, end) - start);
    const std::string value = equals < end ? text.substr(equals + 1, end - equals - 1) : "";
    const int threads = key == "threads" ? parseNumber<int>(value).value_or(0) : 0;
    if (threads >= 1 && threads <= 64)
      settings.threads = threads;
    else if (key == "isa" && isEmbreeIsa(value))
      settings.isa = value;
    else
      usageError("--embree", text,
                 "isa=sse2, sse4.2, avx, avx2 or avx512, as far as this processor has it, or threads=1 to 64");
    start = end + 1;
  }
  return settings;
}

}  // namespace

void usageError(const std::string& option, const std::string& value, const std::string& expected) {
  throw CLI::ValidationError(value.empty() ? option : option + " " + value, "expected " + expected);
}

template <typename T>
static CLI::Validator within(double low, double high, const std::string& what) {
  const std::string expected =
      what + (std::isinf(high) ? fmt::format(" of {:g} or more", low) : fmt::format(" from {:g} to {:g}", low, high));
  return CLI::Validator(
      [=](const std::string& word) {
        const std::optional<T> value = parseNumber<T>(word);
        return value && low <= *value && *value <= high ? "" : fmt::format("{}: expected {}", word, expected);
      },
      std::isinf(high) ? "" : fmt::format("in [{:g} - {:g}]", low, high));
}

CLI::Validator numberFrom(double low, double high, const std::string& what) {
  return within<double>(low, high, what);
}

CLI::Validator wholeNumberFrom(int low, int high) {
  return within<int>(low, high, "a whole number");
}

void addSceneOptions(CLI::App& command, RunArguments& a) {
  command.add_option("SCENE", a.scene, "scene file (XML)")->required();
  addOverrides(command, a);
}

RunOptions runOptions(const RunArguments& a) {
  RunOptions options;
  options.embree = embreeSettings(a.embree);
  options.scene = a.scene;
  for (const std::string& set : a.sets) {
    const std::size_t equals = set.find('=');
    if (equals == std::string::npos || equals == 0) usageError("--set", set, "PATH=VALUE");
    options.overrides.push_back({set.substr(0, equals), set.substr(equals + 1)});
  }
  options.trajectories = filesByTool("--trajectory", a.trajectories);
  options.records = filesByTool("--record", a.records);
  options.logPath = a.log;
  options.logEveryTick = a.logRate == "tick";
  if (options.logEveryTick && a.log.empty()) usageError("--log-rate", a.logRate, "--log FILE with it");
  options.frameTimesPath = a.frameTimes;
  for (const auto& request : a.surfaces) {
    SurfaceRequest r;
    r.path = request.at(1);
    if (!r.path.ends_with(".obj")) usageError("--surface-at", r.path, "a file that ends in .obj");
    if (request[0] != "end") {
      r.time = parseNumber<double>(request[0]);
      if (!r.time) usageError("--surface-at", request[0], "a time in seconds or \"end\"");
    }
    options.surfaces.push_back(std::move(r));
  }
  return options;
}

void addContext(CLI::App& command, std::string& context) {
  command.add_option("--context", context, "how to draw off screen")
      ->check(CLI::IsMember({"auto", "osmesa", "egl"}))
      ->capture_default_str();
}

namespace {

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
    usageError("--show", joined(a.show, ","), error.what());
  }
  const auto isTissue = [](ViewKind kind) { return kind == ViewKind::tissue; };
  if (namesModelPart(a.show) && std::all_of(view.panels.begin(), view.panels.end(), isTissue))
    usageError("--show", joined(a.show, ","), "--view model, both or tissue,model with it: skins hide the model");
}

RenderOptions renderOptions(const RenderArguments& a, const std::string& scene) {
  RenderOptions options;
  options.run = runOptions(a.run);
  options.run.scene = scene;
  options.run.logPath = fileOf(scene, a.run.log);
  options.run.frameTimesPath = fileOf(scene, a.run.frameTimes);
  for (SurfaceRequest& surface : options.run.surfaces) surface.path = fileOf(scene, surface.path);
  for (auto& [tool, path] : options.run.records) path = fileOf(scene, path);
  options.cacheToRead = fileOf(scene, a.cache);
  for (const std::string& output : a.outputs) options.outputs.push_back(fileOf(scene, output));
  if (options.outputs.empty()) options.outputs = {fileOf(scene, a.still.empty() ? "{scene}.mp4" : "{scene}.png")};
  readView(a, options.view);
  readPictures(a, options);
  if (options.still) options.quality = Quality::best;
  if (!a.quality.empty()) options.quality = valueNamed<Quality>(a.quality);
  options.context = a.context;
  options.resume = a.resume;
  options.timings = a.timings;
  return options;
}

// Each scene has files of its own, and a run that takes up another draws nothing twice.
void checkRender(const RenderArguments& a) {
  std::vector<std::string> files = a.outputs;
  for (const std::string& more : {a.run.log, a.run.frameTimes, a.cache})
    if (!more.empty()) files.push_back(more);
  for (const auto& surface : a.run.surfaces) files.push_back(surface.at(1));
  files.insert(files.end(), a.run.records.begin(), a.run.records.end());
  for (const std::string& file : files)
    if (a.scenes.size() > 1 && file.find("{scene}") == std::string::npos)
      usageError("of several scenes", file, "a name with {scene} in it, which becomes each file's name");
  const bool asksForRun = !a.run.log.empty() || !a.run.frameTimes.empty() || !a.run.surfaces.empty() ||
                          !a.run.records.empty() || std::find(a.show.begin(), a.show.end(), "force") != a.show.end();
  if (!a.cache.empty() && asksForRun)
    usageError("--cache", a.cache,
               "no --log, --frame-times, --surface-at, --record or --show force: nothing is simulated, and a cache has "
               "pictures only, no ticks");
  if (!a.resume) return;
  if (a.outputs.empty() || !a.still.empty()) usageError("--resume", "", "-o DIR: folders of PNG files can be resumed");
  for (const std::string& output : a.outputs)
    if (isVideoName(output)) usageError("--resume", output, "a folder: videos are made in one go");
}

// What an earlier write met is told as well: flushing again would succeed.
void flushResults() {
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
    throw std::runtime_error("standard output cannot be written");
}

int runRenders(const RenderArguments& a) {
  checkRender(a);
  std::vector<RenderOptions> all;
  for (const std::string& scene : a.scenes) all.push_back(renderOptions(a, scene));
  std::vector<std::string> files;
  for (const RenderOptions& options : all) files.insert(files.end(), options.outputs.begin(), options.outputs.end());
  if (all.size() > 1) {
    requireDistinctFiles(files, a.scenes);
    for (const RenderOptions& options : all) readScene(options.run.scene, options.run.overrides);  // before any film
  }
  for (const RenderOptions& options : all) {
    runRender(options);
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
  CLI::Option* frames = c->add_option("--frames", a.frames, "only pictures A to B-1, counted from 0")->type_name("A:B");
  c->add_option("--still", a.still, "one picture at time T (s) into FILE.png")
      ->check(numberFrom(0, kEndless, "a time in seconds"))
      ->type_name("T")
      ->excludes(frames);
  c->add_option("--cache", a.cache,
                "draw the states that replay --cache wrote instead of simulating; these lack the ticks of --show force")
      ->type_name("FILE");
  addContext(*c, a.context);
}

Verb addRender(CLI::App& app) {
  const auto arguments = std::make_shared<RenderArguments>();
  RenderArguments& a = *arguments;
  CLI::App* c = app.add_subcommand("render", "run scenes and draw them into videos or numbered PNG files");
  c->add_option("SCENE", a.scenes, "scene files (XML)")->required();
  addOverrides(*c, a.run);
  addRunOptions(*c, a.run);
  c->add_option("-o,--output", a.outputs,
                "FILE.mp4, .webm, .gif or .webp, or a folder for PNG files; {scene} in it is the scene file's name "
                "without its ending; repeatable (default: {scene}.mp4)")
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
      ->type_name("FILE");
  c->add_flag("--realtime", a->realtime,
              "run against the clock: the servo in a thread of its own at its rate, the dynamics in another; tells CPU "
              "times of ticks, and which came late");
  c->add_flag(
      "--until-rest", a->untilRest,
      "end when no body has moved for a swing of its slowest mode and no load is still growing; exit code 4 and no "
      "files where that is not before the scene's duration");
  return {c, [a] {
            RunOptions options = runOptions(a->run);
            options.untilRest = a->untilRest;
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
  const auto path = std::make_shared<std::string>();
  CLI::App* c = app.add_subcommand("info", "tell what is in a model, a scene, a trajectory or a recording");
  c->add_option("FILE", *path, "model, scene or recording (XML), or trajectory (CSV)")->required();
  return {c, [path] { return runInfo(*path); }};
}

// CLI11 would say that all words were not expected, the first of them last.
void requireCommand(const CLI::App& app, const std::string& word) {
  std::vector<std::string> known;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    known.push_back(command->get_name());
  if (word.starts_with('-') || std::find(known.begin(), known.end(), word) != known.end()) return;
  throw CLI::ParseError("there is no command \"" + word + "\"; did you mean " + nearestName(word, known) + "?",
                        CLI::ExitCodes::ExtrasError);
}

// An empty word, or an option with nothing behind its =, would be taken for one that was not given.
void requireWords(const std::vector<std::string>& words) {
  for (std::size_t k = 0; k < words.size(); ++k) {
    const std::string& word = words[k];
    if (!word.empty() && !(word.starts_with("--") && word.find('=') == word.size() - 1)) continue;
    const std::string name = !word.empty() ? word : k > 0 ? words[k - 1] + " ''" : "''";
    throw CLI::ParseError(name + ": is empty, expected a value", CLI::ExitCodes::ConversionError);
  }
}

// CLI11 would complain of what stands behind a misspelt option, or of too many meshes where it has a value.
void requireOptions(const CLI::App& command, const std::vector<std::string>& words) {
  std::vector<std::string> known;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  for (const std::string& word : words) {
    if (word == "--") return;
    const std::string name = word.substr(0, word.find('='));
    if (!name.starts_with("--") || std::find(known.begin(), known.end(), name) != known.end()) continue;
    throw CLI::ParseError(
        "medulla " + command.get_name() + " has no option " + name + "; did you mean " + nearestName(name, known) + "?",
        CLI::ExitCodes::ExtrasError);
  }
}

int dispatch(int argc, char** argv) {
  CLI::App app(kIntroduction, "medulla");
  app.footer(kExitCodes);
  app.require_subcommand(0, 1);
  app.get_formatter()->column_width(34);
  bool version = false;
  app.add_flag("--version", version, "version, and those of Mesa, Embree and the compiler");
  std::vector<Verb> verbs;
  for (const auto add : {addRender, addReplay, addCheck, addInfo, addBuild, addNew, addGolden, addCompare, addPlot,
                         addChart, addStability})
    verbs.push_back(add(app));
  std::string command;  // with a space behind it
  try {
    const std::vector<std::string> words(argv + 1, argv + std::max(argc, 1));
    if (!words.empty()) requireCommand(app, words[0]);
    for (const Verb& verb : verbs) {
      if (words.empty() || verb.command->get_name() != words[0]) continue;
      command = words[0] + " ";
      requireWords(words);
      requireOptions(*verb.command, words);
    }
    app.parse(argc, argv);
    if (version) return printVersion();
    for (const Verb& verb : verbs)
      if (verb.command->parsed()) return verb.run();
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "medulla: %s (see medulla %s--help)\n", error.what(), command.c_str());
    return 2;
  }
  std::fputs(app.help().c_str(), stderr);
  return 2;
}

}  // namespace

int runCommandLine(int argc, char** argv) {
  watchInterrupts();
  try {
    const int code = dispatch(argc, argv);
    flushResults();
    return code;
  } catch (const Interrupted&) {
    std::fputs("medulla: interrupted, nothing unfinished has its final name\n", stderr);
    return 130;
  } catch (const NotAtRest& error) {
    std::fprintf(stderr, "medulla: %s\n", error.what());
    return 4;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "medulla: out of memory: %s %s\n", argc > 1 ? argv[1] : "", argc > 2 ? argv[2] : "");
    return 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "medulla: %s\n", error.what());
    return 1;
  }
}

}  // namespace medulla
