#include "app/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>

#include "app/commands/commands.h"
#include "app/files/number_text.h"
#include "app/interrupt.h"

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

// A verb with what it does once its words are parsed: options that contradict each other are usage errors, too.
struct Verb {
  CLI::App* command;
  std::function<int()> run;
};

std::optional<std::pair<int, int>> splitPair(const std::string& text, char separator) {
  const std::size_t at = text.find(separator);
  if (at == std::string::npos) return std::nullopt;
  const auto a = parseNumber<int>(text.substr(0, at)), b = parseNumber<int>(text.substr(at + 1));
  if (!a || !b) return std::nullopt;
  return std::make_pair(*a, *b);
}

[[noreturn]] void usageError(const std::string& option, const std::string& value, const std::string& expected) {
  throw CLI::ValidationError(option + " " + value, "expected " + expected);
}

// Options as typed; turned into RunOptions after parsing.
struct RunArguments {
  std::string scene, log, logRate = "frame", embree;
  std::vector<std::string> sets, trajectories;
  std::vector<std::vector<std::string>> surfaces;
};

void addSceneOptions(CLI::App& command, RunArguments& a) {
  command.add_option("SCENE", a.scene, "scene file (XML)")->required();
  command
      .add_option("--set", a.sets, "replace one value of the scene, e.g. body.gallbladder.surface=skin (repeatable)")
      ->type_name("PATH=VALUE")
      ->allow_extra_args(false);
  command.add_option("--trajectory", a.trajectories, "read a tool's motion from another file (repeatable)")
      ->type_name("[TOOL=]FILE")
      ->allow_extra_args(false);
}

void addRunOptions(CLI::App& command, RunArguments& a) {
  addSceneOptions(command, a);
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

RunOptions runOptions(const RunArguments& a) {
  RunOptions options;
  options.embree = embreeSettings(a.embree);
  options.scene = a.scene;
  for (const std::string& set : a.sets) {
    const std::size_t equals = set.find('=');
    if (equals == std::string::npos || equals == 0) usageError("--set", set, "PATH=VALUE");
    options.overrides.push_back({set.substr(0, equals), set.substr(equals + 1)});
  }
  for (const std::string& t : a.trajectories) {
    const std::size_t equals = t.find('=');
    if (equals == std::string::npos)
      options.trajectories[""] = t;
    else
      options.trajectories[t.substr(0, equals)] = t.substr(equals + 1);
  }
  options.logPath = a.log;
  options.logEveryTick = a.logRate == "tick";
  for (const auto& request : a.surfaces) {
    SurfaceRequest r;
    r.path = request.at(1);
    if (request[0] != "end") {
      r.time = parseNumber<double>(request[0]);
      if (!r.time) usageError("--surface-at", request[0], "a time in seconds or \"end\"");
    }
    options.surfaces.push_back(std::move(r));
  }
  return options;
}

struct RenderArguments {
  RunArguments run;
  std::vector<std::string> outputs;
  std::string view = "tissue", size, fps, frames, context = "auto";
  std::vector<std::string> show;
};

RenderOptions renderOptions(const RenderArguments& a) {
  RenderOptions options;
  options.run = runOptions(a.run);
  options.outputs = a.outputs;
  if (options.outputs.empty()) options.outputs = {std::filesystem::path(a.run.scene).stem().string() + ".mp4"};
  options.view.view = a.view == "model" ? ViewKind::model : a.view == "both" ? ViewKind::both : ViewKind::tissue;
  options.view.showProxy = std::find(a.show.begin(), a.show.end(), "proxy") != a.show.end();
  if (!a.size.empty()) {
    options.size = splitPair(a.size, 'x');
    const auto valid = [](int n) { return n >= 16 && n <= 8192 && n % 2 == 0; };
    if (!options.size || !valid(options.size->first) || !valid(options.size->second))
      usageError("--size", a.size, "WIDTHxHEIGHT, even numbers from 16 to 8192");
  }
  if (!a.frames.empty()) {
    options.frames = splitPair(a.frames, ':');
    if (!options.frames) usageError("--frames", a.frames, "A:B, whole numbers, B excluded");
  }
  if (!a.fps.empty()) {
    options.fps = parseNumber<double>(a.fps);
    if (!options.fps || *options.fps < 1 || *options.fps > 240) usageError("--fps", a.fps, "a number from 1 to 240");
  }
  options.context = a.context;
  return options;
}

Verb addRender(CLI::App& app) {
  const auto arguments = std::make_shared<RenderArguments>();
  RenderArguments& a = *arguments;
  CLI::App* c = app.add_subcommand("render", "run a scene and draw it into a video or numbered PNG files");
  addRunOptions(*c, a.run);
  c->add_option("-o,--output", a.outputs,
                "FILE.mp4, or a folder for PNG files; repeatable (default: SCENE's name + .mp4)")
      ->type_name("FILE.mp4|DIR")
      ->allow_extra_args(false);
  c->add_option("--view", a.view, "skin; or spheres, links and attachments; or both")
      ->check(CLI::IsMember({"tissue", "model", "both"}))
      ->capture_default_str();
  c->add_option("--show", a.show, "draw also: proxy (proxy sphere, device and the spring between them)")
      ->check(CLI::IsMember({"proxy"}))
      ->allow_extra_args(false);
  c->add_option("--size", a.size, "picture size in pixels (default: the scene's)")->type_name("WxH");
  c->add_option("--fps", a.fps, "pictures per second, 1 to 240 (default: the scene's)");
  c->add_option("--frames", a.frames, "only pictures A to B-1, counted from 0")->type_name("A:B");
  c->add_option("--context", a.context, "how to draw off screen")
      ->check(CLI::IsMember({"auto", "osmesa", "egl"}))
      ->capture_default_str();
  return {c, [arguments] { return runRender(renderOptions(*arguments)); }};
}

Verb addReplay(CLI::App& app) {
  struct Arguments {
    RunArguments run;
    bool untilRest = false, realtime = false;
  };
  const auto a = std::make_shared<Arguments>();
  CLI::App* c = app.add_subcommand("replay", "run a scene without pictures, as fast as it goes, and print its results");
  addRunOptions(*c, a->run);
  c->add_flag("--realtime", a->realtime,
              "run against the clock: the servo in a thread of its own at its rate, the dynamics in another; tells CPU "
              "times of ticks, and which came late");
  c->add_flag(
      "--until-rest", a->untilRest,
      "end when every surface node is slower than 1e-5 m/s and no load is still growing; exit code 4 where that "
      "is not before the scene's duration");
  return {c, [a] {
            RunOptions options = runOptions(a->run);
            options.untilRest = a->untilRest;
            options.realtime = a->realtime;
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
  CLI::App* c = app.add_subcommand("info", "tell what is in a model or a scene");
  c->add_option("FILE", *path, "model or scene file (XML)")->required();
  return {c, [path] { return runInfo(*path); }};
}

struct BuildArguments {
  BuildOptions options;
  std::string method = "cover";
};

BuildOptions buildOptions(const BuildArguments& a) {
  BuildOptions options = a.options;
  options.settings.method = a.method == "cover" ? BuildMethod::cover : BuildMethod::skeleton;
  const BuildSettings& s = options.settings;
  for (const auto& [name, value] : {std::pair("--gap", s.gap), std::pair("--overshoot", s.overshoot.value_or(0))})
    if (value > 0 && s.method != BuildMethod::cover)
      usageError(name, fmt::format("{}", value), "together with --method cover");
  if (!options.fine.empty() && options.fine.size() != options.meshes.size())
    usageError("--fine", options.fine.back(),
               fmt::format("one for each of {} meshes, not {}", options.meshes.size(), options.fine.size()));
  return options;
}

Verb addBuild(CLI::App& app) {
  const auto arguments = std::make_shared<BuildArguments>();
  BuildArguments& a = *arguments;
  CLI::App* c = app.add_subcommand("build", "make a model of filling spheres from each closed triangle mesh");
  c->add_option("MESH", a.options.meshes, "closed surface: OBJ, OFF, STL, PLY, ...; one body each")->required();
  c->add_option("-o,--output", a.options.output,
                "model file to write; for several meshes a folder, where each becomes MESH.model.xml")
      ->type_name("MODEL.xml|DIR")
      ->required();
  CLI::Option* spheres =
      c->add_option(
           "--spheres", a.options.settings.spheres,
           "number of filling spheres; of several meshes together: shared out so that the largest gap, in metres, "
           "is about the same for all")
          ->check(CLI::Range(1, spheresMax))
          ->capture_default_str();
  c->add_option(
       "--gap", a.options.settings.gap,
       "instead of a number: the fewest spheres, of each mesh, that leave no wider gap between the surface and "
       "the nearest sphere, in % of the bounding box's diagonal")
      ->check(CLI::Range(0.01, 99.0))
      ->type_name("PERCENT")
      ->excludes(spheres);
  c->add_option(
       "--overshoot", a.options.settings.overshoot,
       "how far spheres may stick out of the surface, in % of the bounding box's diagonal: they fill more, and "
       "bodies touch by so much too early instead of sinking in by the gap [4.2 / sqrt(spheres), or half the gap, 5 at "
       "most]")
      ->check(CLI::Range(0.0, 5.0))
      ->type_name("PERCENT");
  c->add_option("--method", a.method, "cover: balls chosen to fill the body; skeleton: the raw edge collapse")
      ->check(CLI::IsMember({"cover", "skeleton"}))
      ->capture_default_str();
  c->add_option("--unit", a.options.unit, "unit of the mesh files")
      ->check(CLI::IsMember({"m", "cm", "mm", "inch"}))
      ->capture_default_str();
  c->add_option("--fine", a.options.fine, "detailed shape that the drawn surface follows; of several meshes one each")
      ->type_name("MESH")
      ->allow_extra_args(false);
  c->add_option("--surface-mass", a.options.settings.surfaceMassFraction,
                "share of the mass that surface nodes carry; more allows larger substeps")
      ->check(CLI::Range(0.0, 0.4))
      ->capture_default_str();
  c->add_option("--render-levels", a.options.settings.renderLevels, "subdivisions of the mesh for the drawn surface")
      ->check(CLI::Range(0, 4))
      ->capture_default_str();
  c->add_option("--report", a.options.reportPath, "write the quality report as CSV too")->type_name("FILE.csv");
  return {c, [arguments] { return runBuild(buildOptions(*arguments)); }};
}

Verb addNew(CLI::App& app) {
  const auto options = std::make_shared<NewOptions>();
  NewOptions& o = *options;
  CLI::App* c = app.add_subcommand("new", "make a scene, a model and a trajectory around a mesh, ready to render");
  c->add_option("MESH", o.build.meshes, "closed surface: OBJ, OFF, STL, PLY, ...")->required()->expected(1);
  c->add_option("-o,--output", o.folder, "folder for NAME.xml, NAME.model.xml and NAME.csv; made where missing")
      ->type_name("DIR")
      ->required();
  c->add_option("--spheres", o.build.settings.spheres, "number of filling spheres")
      ->check(CLI::Range(1, spheresMax))
      ->capture_default_str();
  c->add_option("--unit", o.build.unit, "unit of the mesh file")
      ->check(CLI::IsMember({"m", "cm", "mm", "inch"}))
      ->capture_default_str();
  return {c, [options] { return runNew(*options); }};
}

Verb addGolden(CLI::App& app) {
  const auto options = std::make_shared<GoldenOptions>();
  GoldenOptions& o = *options;
  CLI::App* c = app.add_subcommand("golden", "render the scenes' golden moments and compare with the stored images");
  c->add_option("SCENE", o.scenes, "scene files (default: scenes/*.xml)");
  c->add_flag("--update", o.update, "store what is drawn now as the new golden images");
  c->add_option("--images", o.images, "folder of the golden images (default: golden_images beside the scene's folder)")
      ->type_name("DIR");
  c->add_option("--failures", o.failures, "where pictures that differ go")->type_name("DIR")->capture_default_str();
  c->add_option("--context", o.context, "how to draw off screen")
      ->check(CLI::IsMember({"auto", "osmesa", "egl"}))
      ->capture_default_str();
  return {c, [options] { return runGolden(*options); }};
}

struct CompareArguments {
  CompareOptions options;
  std::string tolerance = "0";
};

CompareOptions compareOptions(const CompareArguments& a) {
  CompareOptions options = a.options;
  const auto tolerance = parseNumber<double>(a.tolerance);
  if (!tolerance || *tolerance < 0) usageError("--tolerance", a.tolerance, "a number of 0 or more");
  options.tolerance = *tolerance;
  return options;
}

Verb addCompare(CLI::App& app) {
  const auto arguments = std::make_shared<CompareArguments>();
  CompareArguments& a = *arguments;
  CLI::App* c = app.add_subcommand("compare", "say where two logs differ first; exit code 3 where they do");
  c->add_option("A", a.options.a, "log of a run (CSV)")->required();
  c->add_option("B", a.options.b, "another")->required();
  c->add_option("--tolerance", a.tolerance,
                "differences that do not count, as a share of the column's largest value; 0: every field is the same "
                "text")
      ->capture_default_str();
  return {c, [arguments] { return runCompare(compareOptions(*arguments)); }};
}

struct ChartArguments {
  RunArguments run;
  ChartOptions options;
  std::vector<std::string> steps = {"0.1", "0.2", "0.5", "1", "2", "5", "10", "20"};
};

std::vector<double> numbersOf(const std::string& option, const std::vector<std::string>& words, double low, double high,
                              double unit, const std::string& expected) {
  std::vector<double> out;
  for (const std::string& word : words) {
    const auto value = parseNumber<double>(word);
    if (!value || *value < low || *value > high) usageError(option, word, expected);
    out.push_back(unit * *value);
  }
  return out;
}

std::vector<double> stepsOf(const std::string& option, const std::vector<std::string>& words) {
  return numbersOf(option, words, 1e-3, 50, 1e-3, "milliseconds from 0.001 to 50");
}

ChartOptions chartOptions(const ChartArguments& a) {
  ChartOptions options = a.options;
  options.run = runOptions(a.run);
  options.steps = stepsOf("--steps", a.steps);
  return options;
}

Verb addChart(CLI::App& app) {
  const auto arguments = std::make_shared<ChartArguments>();
  ChartArguments& a = *arguments;
  CLI::App* c =
      app.add_subcommand("chart", "run a scene by several methods and steps, and draw their time against their error");
  addSceneOptions(*c, a.run);
  c->add_option(
       "-o,--output", a.options.folder,
       "folder for chart.csv, .gnuplot and .svg, and of several --models spheres.csv, .gnuplot and .svg; made where "
       "missing")
      ->type_name("DIR")
      ->required();
  c->add_option("--steps", a.steps, "substeps to run with, ms; the nearest whole shares of a dynamics frame are taken")
      ->type_name("MS,MS,...")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  a.options.methods = chartMethodNames();
  c->add_option("--methods", a.options.methods,
                "curves; the first method's finest run is the reference where no body names one")
      ->check(CLI::IsMember(chartMethodNames()))
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  c->add_option("--models", a.options.models,
                "models of the same mesh with other numbers of spheres, for curves of their own (repeatable)")
      ->type_name("[BODY=]FILE")
      ->allow_extra_args(false);
  return {c, [arguments] { return runChart(chartOptions(*arguments)); }};
}

struct StabilityArguments {
  RunArguments run;
  StabilityOptions options;
  std::vector<std::string> steps = {"0.1", "0.5", "2", "10", "50"}, trialSteps = {"1", "10", "50"},
                           young = {"1e2", "1e3", "1e4", "1e5", "1e6", "1e7", "1e8", "1e9"};
};

StabilityOptions stabilityOptions(const StabilityArguments& a) {
  StabilityOptions options = a.options;
  options.run = runOptions(a.run);
  options.steps = stepsOf("--steps", a.steps);
  options.trialSteps = stepsOf("--trial-steps", a.trialSteps);
  options.young = numbersOf("--young", a.young, 1e-3, 1e12, 1, "Pa from 0.001 to 1e12");
  return options;
}

Verb addStability(CLI::App& app) {
  const auto arguments = std::make_shared<StabilityArguments>();
  StabilityArguments& a = *arguments;
  CLI::App* c =
      app.add_subcommand("stability", "torture a scene's first body by every method and step, and draw what survives");
  addSceneOptions(*c, a.run);
  c->add_option("-o,--output", a.options.folder,
                "folder for map.csv, trials.csv, stability.gnuplot and stability.svg; made where missing")
      ->type_name("DIR")
      ->required();
  const auto addList = [&](const char* name, std::vector<std::string>& values, const char* help, const char* type) {
    c->add_option(name, values, help)->type_name(type)->delimiter(',')->allow_extra_args(false)->capture_default_str();
  };
  addList("--steps", a.steps, "steps of the map, ms", "MS,MS,...");
  addList("--young", a.young, "stiffnesses of the map, Pa", "PA,PA,...");
  addList("--trial-steps", a.trialSteps, "steps of the trials, ms", "MS,MS,...");
  return {c, [arguments] { return runStability(stabilityOptions(*arguments)); }};
}

int dispatch(int argc, char** argv) {
  CLI::App app(kIntroduction, "medulla");
  app.footer(kExitCodes);
  app.require_subcommand(0, 1);
  app.get_formatter()->column_width(34);
  bool version = false;
  app.add_flag("--version", version, "version, and those of Mesa, Embree and the compiler");
  std::vector<Verb> verbs;
  for (const auto add :
       {addRender, addReplay, addCheck, addInfo, addBuild, addNew, addGolden, addCompare, addChart, addStability})
    verbs.push_back(add(app));
  try {
    app.parse(argc, argv);
    if (version) return printVersion();
    for (const Verb& verb : verbs)
      if (verb.command->parsed()) return verb.run();
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "medulla: %s (see medulla --help)\n", error.what());
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
    if (std::fflush(stdout) != 0) throw std::runtime_error("standard output cannot be written");
    return code;
  } catch (const Interrupted&) {
    std::fputs("medulla: interrupted, nothing unfinished was kept\n", stderr);
    return 130;
  } catch (const NotAtRest& error) {
    std::fprintf(stderr, "medulla: %s\n", error.what());
    return 4;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "medulla: %s\n", error.what());
    return 1;
  }
}

}  // namespace medulla
