#include "app/command_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "app/commands/commands.h"
#include "app/commands/rest_watch.h"
#include "app/files/number_text.h"
#include "app/files/text.h"
#include "app/interrupt.h"
#include "app/standard_streams.h"
#include "app/verbs.h"

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

// From [TOOL=]FILE.
std::map<std::string, std::string> filesByTool(const std::string& option, const std::vector<std::string>& words) {
  std::map<std::string, std::string> out;
  for (const std::string& word : words) {
    const NamedFile file = namedFile(option, word);
    if (!out.try_emplace(file.name, file.path).second) usageError(option, word, "one file per tool");
  }
  return out;
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

NamedFile namedFile(const std::string& option, const std::string& word) {
  const std::size_t equals = word.find('=');
  if (equals == std::string::npos) return {"", word};
  if (equals + 1 == word.size()) usageError(option, word, "a file behind the =");
  if (equals == 0) usageError(option, word, "a name of the scene before the =");
  return {word.substr(0, equals), word.substr(equals + 1)};
}

void usageError(const std::string& option, const std::string& value, const std::string& expected) {
  throw CLI::ValidationError(value.empty() ? option : option + " " + value, "expected " + expected);
}

void refuseOtherKinds(const std::string& option, const std::string& path, const std::string& ending) {
  constexpr std::string_view kinds[] = {".xml", ".xsd", ".csv",  ".cache", ".obj",  ".off",  ".ply", ".stl",
                                        ".mp4", ".gif", ".webm", ".png",   ".webp", ".html", ".svg", ".md",
                                        ".c",   ".h",   ".cpp",  ".py",    ".sh",   ".json", ".yml"};
  const std::string own = lowered(std::filesystem::path(path).extension().string());
  if (own == ending || path.starts_with("/dev/")) return;  // streams, pipes and devices
  if (isOneOf(own, kinds)) usageError(option, path, "a file that ends in " + ending);
  std::error_code unknown;
  if (std::filesystem::is_regular_file(path, unknown))
    usageError(option, path, "a file that ends in " + ending + ", or one that does not exist yet");
}

template <typename T>
static CLI::Validator within(double low, double high, const std::string& what) {
  const std::string expected =
      what + (std::isinf(high) ? fmt::format(" of {:g} or more", low) : fmt::format(" from {:g} to {:g}", low, high));
  return CLI::Validator(
      [=](std::string& word) -> std::string {
        const std::optional<T> value = parseNumber<T>(word);
        if (!value || !(low <= *value && *value <= high)) return fmt::format("{}: expected {}", word, expected);
        word = fmt::format("{}", *value);  // for transform(): CLI11 would take 010 for octal
        return {};
      },
      std::isinf(high) ? "" : fmt::format("in [{:g} - {:g}]", low, high));
}

CLI::Validator numberFrom(double low, double high, const std::string& what) {
  return within<double>(low, high, what);
}

CLI::Validator wholeNumberFrom(int low, int high) {
  return within<int>(low, high, "a whole number");
}

void addOverrides(CLI::App& command, RunArguments& a) {
  command
      .add_option("--set", a.sets,
                  "replace one value of the scene: element[.name].attribute, children behind their parent, e.g. "
                  "clock.duration=4, body.gallbladder.surface=skin, body.liver.links.torsion=2 (repeatable)")
      ->type_name("PATH=VALUE")
      ->allow_extra_args(false);
  command
      .add_option("--trajectory", a.trajectories,
                  "read a tool's motion from another file: a trajectory (CSV), or XML that describes a recording of "
                  "another program (repeatable)")
      ->type_name("[TOOL=]FILE")
      ->allow_extra_args(false);
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
  for (const auto& [tool, path] : options.records) refuseOtherKinds("--record", path, ".csv");
  refuseOtherKinds("--log", a.log, ".csv");
  refuseOtherKinds("--frame-times", a.frameTimes, ".csv");
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

// CLI11 would say that all words were not expected, the first of them last.
void requireCommand(const CLI::App& app, const std::string& word) {
  std::vector<std::string> known;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    known.push_back(command->get_name());
  if (word.starts_with('-') || isOneOf(word, known)) return;
  throw CLI::ParseError("there is no command \"" + word + "\"; " + hintOfNames(word, known),
                        CLI::ExitCodes::ExtrasError);
}

// An empty word, or an option with nothing behind its =, would be taken for one that was not given; what stands behind
// -o= for a name with a = before it.
void requireWords(const std::vector<std::string>& words) {
  for (std::size_t k = 0; k < words.size(); ++k) {
    const std::string& word = words[k];
    if (word.starts_with("-o="))
      throw CLI::ParseError(word + ": expected -o " + word.substr(3) + " or --output=" + word.substr(3),
                            CLI::ExitCodes::ConversionError);
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
    if (!name.starts_with("--") || isOneOf(name, known)) continue;
    throw CLI::ParseError("medulla " + command.get_name() + " has no option " + name + "; " + hintOfNames(name, known),
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
    tell("medulla: {} (see medulla {}--help)\n", error.what(), command);
    return 2;
  }
  std::fputs(app.help().c_str(), stderr);
  return 2;
}

}  // namespace

int runCommandLine(int argc, char** argv) {
  openStandardStreams();
  watchInterrupts();
  try {
    const int code = dispatch(argc, argv);
    flushResults();
    return code;
  } catch (const Interrupted&) {
    std::fputs("medulla: interrupted, nothing unfinished has its final name\n", stderr);
    return 130;
  } catch (const NotAtRest& error) {
    tell("medulla: {}\n", error.what());
    return 4;
  } catch (const std::bad_alloc&) {
    tell("medulla: out of memory: {} {}\n", argc > 1 ? argv[1] : "", argc > 2 ? argv[2] : "");
    return 1;
  } catch (const std::system_error& error) {
    endWhereReaderLeft(error.code().value());  // results of more than a buffer are written before they are flushed
    tell("medulla: {}\n", error.what());
    return 1;
  } catch (const std::exception& error) {
    tell("medulla: {}\n", error.what());
    return 1;
  }
}

}  // namespace medulla
