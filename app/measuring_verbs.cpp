#include <algorithm>
#include <memory>
#include <thread>

#include "app/commands/commands.h"
#include "app/files/number_text.h"
#include "app/torture.h"
#include "app/verbs.h"

// The verbs that hold pictures, logs, methods, steps and models against each other.
namespace medulla {

namespace {

struct ChartArguments {
  RunArguments run;
  ChartOptions options;
  std::vector<std::string> steps = {"0.1", "0.2", "0.5", "1", "2", "5", "10", "20"}, models;
};

CLI::Validator stepFrom(const std::string& what) {
  return numberFrom(1e-3, 50, what);
}

CLI::Validator stepOrAuto() {
  const auto check = [step = stepFrom("auto, or milliseconds")](std::string& word) {
    return word == "auto" ? std::string() : step(word);
  };
  return CLI::Validator(check, "");
}

// In units of `unit`; options have checked them.
std::vector<double> numbersOf(const std::vector<std::string>& words, double unit) {
  std::vector<double> out;
  out.reserve(words.size());
  for (const std::string& word : words) out.push_back(unit * parseNumber<double>(word).value());
  return out;
}

// Who names a method or a step twice wants one curve of it.
template <class T>
void dropRepeats(std::vector<T>& list) {
  std::vector<T> once;
  for (const T& item : list)
    if (std::find(once.begin(), once.end(), item) == once.end()) once.push_back(item);
  list = std::move(once);
}

CLI::Option* addList(CLI::App& command, const char* name, std::vector<std::string>& values, const CLI::Validator& check,
                     const char* help) {
  return command.add_option(name, values, help)
      ->check(check)
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
}

ChartOptions chartOptions(const ChartArguments& a) {
  ChartOptions options = a.options;
  options.run = runOptions(a.run);
  std::vector<std::string> given = a.steps;
  const bool chosen = std::erase(given, "auto") > 0;
  options.steps = numbersOf(given, 1e-3);
  if (chosen) options.steps.push_back(0);
  dropRepeats(options.steps);
  dropRepeats(options.methods);
  for (const std::string& word : a.models) options.models.push_back(namedFile("--models", word));
  return options;
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
  options.steps = numbersOf(a.steps, 1e-3);
  options.trialSteps = numbersOf(a.trialSteps, 1e-3);
  options.young = numbersOf(a.young, 1);
  for (std::vector<double>* list : {&options.steps, &options.trialSteps, &options.young}) dropRepeats(*list);
  dropRepeats(options.methods);
  return options;
}

}  // namespace

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
  addList(
      *c, "--steps", a.steps, stepOrAuto(),
      "substeps to run with, ms; the nearest whole shares of a dynamics frame are taken; auto: as long as each run's "
      "stability estimate allows")
      ->type_name("MS,MS,...|auto");
  a.options.methods = chartMethodsOfAnyModel();
  addList(*c, "--methods", a.options.methods, CLI::IsMember(chartMethodNames()),
          "curves; where no body names a reference it is a run of the first method at half of the smallest step");
  c->add_option("--models", a.models,
                "models of the same mesh with other numbers of spheres, for curves of their own (repeatable)")
      ->type_name("[BODY=]FILE")
      ->allow_extra_args(false);
  return {c, [arguments] { return runChart(chartOptions(*arguments)); }};
}

Verb addStability(CLI::App& app) {
  const auto arguments = std::make_shared<StabilityArguments>();
  StabilityArguments& a = *arguments;
  CLI::App* c = app.add_subcommand(
      "stability",
      "torture a scene's first body, which a <fix> holds, by every method and step, and draw what survives");
  addSceneOptions(*c, a.run);
  c->add_option("-o,--output", a.options.folder,
                "folder for map.csv, trials.csv, stability.gnuplot and stability.svg; made where missing")
      ->type_name("DIR")
      ->required();
  for (const TortureMethod& method : tortureMethods()) a.options.methods.push_back(method.name);
  addList(*c, "--methods", a.options.methods, CLI::IsMember(a.options.methods), "integrators, a panel each");
  addList(*c, "--steps", a.steps, stepFrom("milliseconds"), "steps of the map, ms")->type_name("MS,MS,...");
  addList(*c, "--young", a.young, numberFrom(1e-3, 1e12, "Pa"), "stiffnesses of the map, Pa")->type_name("PA,PA,...");
  addList(*c, "--trial-steps", a.trialSteps, stepFrom("milliseconds"), "steps of the trials, ms")
      ->type_name("MS,MS,...");
  a.options.threads = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1U, 64U));
  c->add_option("--threads", a.options.threads, "trials that run side by side; the results are the same")
      ->transform(wholeNumberFrom(1, 64))
      ->capture_default_str();
  return {c, [arguments] { return runStability(stabilityOptions(*arguments)); }};
}

Verb addGolden(CLI::App& app) {
  const auto options = std::make_shared<GoldenOptions>();
  GoldenOptions& o = *options;
  CLI::App* c = app.add_subcommand("golden", "render the scenes' golden moments and compare with the stored images");
  c->add_option("SCENE", o.scenes, "scene files (default: those that the images in --dir name, or scenes/*.xml)");
  c->add_option("--dir", o.folder, "folder of the golden images (default: golden_images beside the scene's folder)")
      ->type_name("DIR");
  c->add_option(
       "--update", o.update,
       "store what is drawn now: of a scene, by file or name, whose images of former moments are removed, or of "
       "one moment, such as liver_45 (repeatable)")
      ->type_name("NAME")
      ->allow_extra_args(false);
  c->add_option("--failures", o.failures, "where report.html and the pictures that fail go")
      ->type_name("DIR")
      ->capture_default_str();
  addContext(*c, o.context);
  return {c, [options] { return runGolden(*options); }};
}

Verb addCompare(CLI::App& app) {
  const auto options = std::make_shared<CompareOptions>();
  CompareOptions& o = *options;
  CLI::App* c =
      app.add_subcommand("compare", "say where two logs or two state caches differ first; exit code 3 where they do");
  c->add_option("A", o.a, "log (CSV) or state cache of a run")->required();
  c->add_option("B", o.b, "another")->required();
  c->add_option("--tolerance", o.tolerance,
                "differences that do not count, as a share of the column's largest value; 0: every field is the same "
                "text")
      ->check(numberFrom(0, kEndless))
      ->capture_default_str();
  return {c, [options] { return runCompare(*options); }};
}

Verb addPlot(CLI::App& app) {
  const auto options = std::make_shared<PlotOptions>();
  CLI::App* c = app.add_subcommand(
      "plot",
      "draw a log over time: force, penetration, volume, energies, modelled nodes; contact and grab are shaded");
  c->add_option("LOG", options->log, "log of a run (CSV)")->required();
  c->add_option("--frame-times", options->frameTimes, "draw also what frames took: the file of replay --frame-times")
      ->type_name("FILE");
  c->add_option("-o,--output", options->output, "picture to write")->type_name("FILE.png|FILE.svg")->required();
  return {c, [options] { return runPlot(*options); }};
}

}  // namespace medulla
