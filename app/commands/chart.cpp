#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "app/commands/chart_errors.h"
#include "app/commands/commands.h"
#include "app/files/chart_picture.h"
#include "app/files/gnuplot.h"
#include "app/files/output_file.h"
#include "app/files/sphere_chart.h"
#include "app/files/text.h"
#include "app/interrupt.h"
#include "app/progress.h"
#include "app/standard_streams.h"
#include "physics/model/build_report.h"
#include "render/output_folder.h"

namespace medulla {

namespace {

namespace fs = std::filesystem;

// What is charted, a curve each: overrides of the scene, in which * stands for every body.
struct ChartMethod {
  std::string name;
  std::vector<SceneOverride> overrides;
  bool needsIdentified = false;  // a network in the model
};
const std::vector<ChartMethod>& chartMethods() {
  // Each says all that it is named after, so that it is that in any scene.
  static const SceneOverride kExplicit{"dynamics.integrator", "explicit"}, kFirstOrder{"dynamics.order", "1"},
      kImplicit{"dynamics.integrator", "implicit"};
  static const std::vector<ChartMethod> methods = {
      {"full", {kExplicit, kFirstOrder, {"body.*.surface", "full"}}},
      {"contact", {kExplicit, kFirstOrder, {"body.*.surface", "contact"}}},
      {"skin", {kExplicit, kFirstOrder, {"body.*.surface", "skin"}}},
      {"springs", {kExplicit, kFirstOrder, {"body.*.links", "springs"}}},
      {"implicit", {kImplicit, kFirstOrder}},
      {"implicit_2", {kImplicit, {"dynamics.order", "2"}}},
      {"identified", {kExplicit, kFirstOrder, {"body.*.links", "identified"}}, true},
  };
  return methods;
}

// The scene with one method, model and step.
struct ChartRun {
  std::string curve;
  RunOptions options;
  int spheres = 0;
  double step = 0;                    // s
  std::size_t method = 0, model = 0;  // in the order in which they were asked for
  int style = -1;                     // of the method; -1: of one model among several
};

struct Outcome {
  ChartPoint point;
  std::vector<RecordedFrame> moments;
};

std::vector<SceneOverride> expanded(const std::vector<SceneOverride>& overrides, const Scene& scene) {
  std::vector<SceneOverride> out;
  for (const SceneOverride& o : overrides) {
    const std::size_t star = o.path.find('*');
    if (star == std::string::npos) {
      out.push_back(o);
      continue;
    }
    for (const SceneBody& body : scene.bodies)
      out.push_back({o.path.substr(0, star) + body.name + o.path.substr(star + 1), o.value});
  }
  return out;
}

// The override that puts a file in the place of a model. Overrides are relative to the scene, words on the command line
// to where it was typed.
SceneOverride modelOverride(const NamedFile& model, const Scene& scene) {
  std::vector<std::string> names;
  for (const SceneBody& b : scene.bodies) names.push_back(b.name);
  const std::string body = meantName("--models", model, names, "body");
  if (!fs::exists(model.path)) throw std::runtime_error(fmt::format("--models {} does not exist", model.path));
  return {fmt::format("body.{}.model", body), fs::absolute(model.path).string()};
}

int spheresOf(const LoadedScene& loaded) {
  std::size_t count = 0;
  for (const SceneBody& body : loaded.scene.bodies) count += body.model->spheres.size();
  return static_cast<int>(count);
}

// Nodes are compared by number: models must be of the same meshes.
void requireSameMeshes(const LoadedScene& a, const LoadedScene& b) {
  for (std::size_t k = 0; k < a.scene.bodies.size(); ++k)
    if (a.scene.bodies[k].model->restNodes != b.scene.bodies[k].model->restNodes)
      throw std::runtime_error(fmt::format("the model {} is of another mesh than {}: expected the same nodes",
                                           b.scene.bodies[k].modelPath, a.scene.bodies[k].modelPath));
}

int chosenSubsteps(LoadedScene loaded) {
  loaded.scene.dynamics.substeps = 0;
  return makeWorld(loaded).substepsPerFrame();
}

// Of the methods that are drawn where none were asked for one may not fit the scene, as a skin of a body that is glued
// by less than half of any sphere's surface: it is left out, with a note. Throws what loading throws of any other.
std::optional<LoadedScene> loadMethod(const ChartRun& run, const ChartOptions& options) {
  const bool mayBeLeftOut = run.method > 0 && options.methods == chartMethodsOfAnyModel();
  try {
    return loadRun(run.options);
  } catch (const std::runtime_error& error) {
    if (!mayBeLeftOut && !options.models.empty())
      throw std::runtime_error(fmt::format("with --models {}: {}", options.models[run.model].path, error.what()));
    if (!mayBeLeftOut) throw;
    tell("note: no curve of {}: {}\n", run.curve, error.what());
    return {};
  }
}

// Of steps that are whole shares of a dynamics frame, the one that is nearest: how many it has.
int nearestSubsteps(double step, double rate) {
  const int fewer = static_cast<int>(std::clamp(1 / (step * rate), 1., 1e9)), more = fewer + 1;
  const auto off = [&](int substeps) { return std::abs(1 / (rate * substeps) - step); };
  return off(fewer) <= off(more) ? fewer : more;
}

// `substeps`: per dynamics frame.
void addRun(const LoadedScene& base, ChartRun run, int substeps, std::vector<ChartRun>& runs) {
  if (substeps > kMostSubsteps)
    throw std::runtime_error(
        fmt::format("{} asks for {} substeps per dynamics frame: expected at most {}; raise clock.dynamics, or lower "
                    "Young's modulus",
                    run.curve, substeps, kMostSubsteps));
  run.options.overrides.push_back({"dynamics.substeps", fmt::format("{}", substeps)});
  run.step = 1 / (base.scene.dynamicsRate * substeps);
  runs.push_back(std::move(run));
}

// A model has curves of its own: by its spheres, by its file's name where those are alike, or else by its place.
void nameCurveApart(const std::vector<ChartRun>& runs, const ChartOptions& options, ChartRun& run) {
  if (options.models.size() < 2) return;
  run.style = -1;
  const auto isTaken = [&] {
    return std::any_of(runs.begin(), runs.end(),
                       [&](const ChartRun& r) { return r.curve == run.curve && r.model != run.model; });
  };
  run.curve += fmt::format("_{}_spheres", run.spheres);
  if (isTaken()) run.curve += "_" + plainName(fs::path(options.models[run.model].path).stem().string());
  if (isTaken()) run.curve += fmt::format("_{}", run.model + 1);
}

std::set<int> substepsOf(const ChartOptions& options, const LoadedScene& loaded) {
  std::set<int> out;
  for (const double step : options.steps)
    out.insert(step > 0 ? nearestSubsteps(step, loaded.scene.dynamicsRate) : chosenSubsteps(loaded));
  return out;
}

void noteMergedSteps(const std::vector<double>& steps, double rate) {
  std::map<int, std::vector<std::string>> asked;  // by substeps
  for (const double step : steps)
    if (step > 0) asked[nearestSubsteps(step, rate)].push_back(fmt::format("{:.6g}", 1e3 * step));
  for (const auto& [substeps, of] : asked)
    if (of.size() > 1)
      tell("chart: note: steps of {} ms are one: the nearest whole share of a dynamics frame is {:.6g} ms\n",
           joined(of, " and "), 1e3 / (rate * substeps));
}

// Every run of the chart. Where the scene names no reference there is one more, the reference, last: the first method
// on the most spheres, at half of the smallest step.
std::vector<ChartRun> planRuns(const ChartOptions& options, const LoadedScene& base) {
  std::vector<std::vector<SceneOverride>> models;
  for (const NamedFile& model : options.models) models.push_back({modelOverride(model, base.scene)});
  if (models.empty()) models.push_back({});
  std::vector<ChartRun> runs;
  int mostSubsteps = 0;
  ChartRun reference;
  for (std::size_t number = 0; number < options.methods.size(); ++number) {
    const std::string& name = options.methods[number];
    const auto method = std::find_if(chartMethods().begin(), chartMethods().end(),
                                     [&](const ChartMethod& m) { return m.name == name; });
    for (std::size_t k = 0; k < models.size(); ++k) {
      ChartRun run{name, options.run, 0, 0, number, k};
      for (const auto& overrides : {expanded(method->overrides, base.scene), models[k]})
        run.options.overrides.insert(run.options.overrides.end(), overrides.begin(), overrides.end());
      const std::optional<LoadedScene> loaded = loadMethod(run, options);
      if (!loaded) break;
      requireSameMeshes(base, *loaded);
      run.spheres = spheresOf(*loaded);
      run.style = static_cast<int>(method - chartMethods().begin());
      nameCurveApart(runs, options, run);
      if (number == 0 && run.spheres > reference.spheres) reference = run;
      const std::set<int> all = substepsOf(options, *loaded);
      for (const int substeps : all) addRun(base, run, substeps, runs);
      mostSubsteps = std::max(mostSubsteps, *all.rbegin());
    }
  }
  if (!namesReference(base)) addRun(base, reference, 2 * mostSubsteps, runs);
  return runs;
}

// Where a run is compared: at the scene's golden times and at the end; with a reference at the end alone.
std::vector<RecordedFrame> framesToRecord(const LoadedScene& loaded) {
  const Scene& scene = loaded.scene;
  std::vector<RecordedFrame> out;
  if (!namesReference(loaded))
    for (const double time : scene.goldenTimes) out.push_back({time, {}});
  if (out.empty() || out.back().time < scene.duration) out.push_back({scene.duration, {}});
  return out;
}

// Of the body whose volume has changed most.
double farthestVolumeRatio(const World& world) {
  double out = 1;
  for (int b = 0; b < static_cast<int>(world.bodies().size()); ++b)
    if (std::abs(world.volumeRatio(b) - 1) > std::abs(out - 1)) out = world.volumeRatio(b);
  return out;
}

Outcome execute(const ChartRun& run, const std::function<void(double)>& progress) {
  const LoadedScene loaded = loadRun(run.options);
  Outcome out;
  out.point.curve = run.curve;
  out.point.style = run.style;
  out.point.spheres = run.spheres;
  out.point.step = run.step;
  out.moments = framesToRecord(loaded);
  std::optional<Simulation> simulation;
  const double start = processCpuSeconds();
  std::optional<double> settled;                     // when bodies had
  double simulated = 1 / loaded.scene.dynamicsRate;  // at least a frame is tried
  try {
    simulation.emplace(loaded);  // bodies settle
    settled = processCpuSeconds();
    while (!simulation->finished()) {
      checkInterrupt();
      simulated = simulation->time() + 1 / loaded.scene.dynamicsRate;
      simulation->advanceFrame();
      recordFrames(*simulation, simulation->finished(), out.moments);
      progress(simulated);
    }
    out.point.volumeRatio = farthestVolumeRatio(simulation->world());
  } catch (const NotFinite&) {
    out.point.failedAt = simulation ? simulated : 0;
  }
  out.point.cpu = (processCpuSeconds() - settled.value_or(start)) / simulated;
  return out;
}

// Short runs again, as results are the same: the quickest is the one that nothing else disturbed.
Outcome executeQuickest(const ChartRun& run, double duration, const std::function<void(double)>& progress) {
  constexpr double kEnough = 0.2;  // s of CPU time
  constexpr int kMost = 5;
  Outcome out = execute(run, progress);
  double spent = out.point.cpu * duration;
  for (int k = 1; k < kMost && spent < kEnough && !out.point.failedAt; ++k) {
    const double cpu = execute(run, progress).point.cpu;
    spent += cpu * duration;
    out.point.cpu = std::min(out.point.cpu, cpu);
  }
  return out;
}

// The run that all others are measured against, the last one planned, leaves the list.
ChartTruth runReference(std::vector<ChartRun>& runs, const LoadedScene& base,
                        const std::function<void(double)>& progress) {
  const ChartRun run = runs.back();
  runs.pop_back();
  const Outcome reference = execute(run, progress);
  if (reference.point.failedAt)
    throw std::runtime_error(
        fmt::format("the reference run with substeps of {:.3g} ms is not finite at {:.6g} s: use "
                    "smaller --steps",
                    1e3 * run.step, *reference.point.failedAt));
  ChartTruth truth = truthOfRun(base, reference.moments);
  truth.step = run.step;
  truth.spheres = run.spheres;
  if (run.style < 0) {
    truth.ownCurve = run.curve;
    tell("note: all is measured against the model of {} spheres: it has no error of its own but of steps\n",
         run.spheres);
  }
  return truth;
}

// What a simulated second takes, in explicit steps, for the progress bar alone.
double workPerSecond(const ChartRun& run) {
  constexpr double kImplicit = 30;  // explicit ones per implicit one: a guess, it goes with the spheres
  const bool implicit = std::any_of(run.options.overrides.begin(), run.options.overrides.end(),
                                    [](const SceneOverride& o) { return o.value == "implicit"; });
  return (implicit ? kImplicit : 1) / run.step;
}

std::vector<ChartPoint> executeAll(std::vector<ChartRun> runs, const LoadedScene& base, ChartTruth& truth) {
  double work = 0, done = 0, perSecond = 0;  // perSecond: of the run that goes on
  for (const ChartRun& run : runs) work += workPerSecond(run) * base.scene.duration;
  Progress progress("chart", work, "steps");
  const auto update = [&](double simulated) { progress.update(done + perSecond * simulated); };
  if (namesReference(base)) {
    truth = truthOfReferences(base);
  } else {
    perSecond = workPerSecond(runs.back());
    truth = runReference(runs, base, update);
    done += perSecond * base.scene.duration;
  }
  std::vector<ChartPoint> points;
  for (const ChartRun& run : runs) {
    perSecond = workPerSecond(run);
    Outcome out = executeQuickest(run, base.scene.duration, update);
    done += perSecond * base.scene.duration;
    if (truth.cost == ChartCost::ofTheCase) out.point.cpu *= base.scene.duration;
    if (!out.point.failedAt) measureErrors(base, truth, out.moments, out.point);
    points.push_back(out.point);
  }
  points.insert(points.end(), truth.ownRuns.begin(), truth.ownRuns.end());
  markFront(points);
  return points;
}

std::vector<Result> chartResults(const std::vector<ChartPoint>& points, const ChartTruth& truth) {
  const auto failed = std::count_if(points.begin(), points.end(), [](const ChartPoint& p) { return bool(p.failedAt); });
  const bool perSecond = truth.cost == ChartCost::perSimulatedSecond;
  std::vector<Result> results = {{"runs", fmt::format("{}", points.size() - truth.ownRuns.size()), ""},
                                 {"failed", fmt::format("{}", failed), ""}};
  if (perSecond) {
    results.push_back({"reference_step", fmt::format("{:.4g}", truth.step), "s"});
    results.push_back({"reference_spheres", fmt::format("{}", truth.spheres), ""});
  }
  results.push_back({"largest_displacement", fmt::format("{:.4g}", truth.displacement), "m"});
  // Time at equal accuracy: the cheapest run of each curve that is good enough.
  for (const double percent : {1.0, 2.0, 5.0, 10.0}) {
    std::map<std::string, double> cheapest;
    for (const ChartPoint& p : points) {
      if (p.failedAt || p.errorMax > percent || p.curve == truth.ownCurve) continue;
      const auto [known, isNew] = cheapest.try_emplace(p.curve, p.cpu);
      if (!isNew) known->second = std::min(known->second, p.cpu);
    }
    for (const auto& [curve, cpu] : cheapest)
      results.push_back(
          {fmt::format("{}.cpu_at_{}%", curve, percent), fmt::format("{:.4g}", cpu), perSecond ? "s/s" : "s"});
  }
  return results;
}

// Per model how well its balls fit, and the first method's run at the smallest step that did not fail. Points come in
// the order of the runs.
std::vector<SphereChartRow> sphereRows(const ChartOptions& options, const LoadedScene& base,
                                       const std::vector<ChartRun>& runs, const std::vector<ChartPoint>& points,
                                       const ChartTruth& truth) {
  std::vector<SphereChartRow> rows;
  for (std::size_t m = 0; m < options.models.size(); ++m) {
    RunOptions run = options.run;
    run.overrides.push_back(modelOverride(options.models[m], base.scene));
    const LoadedScene loaded = loadRun(run);
    SphereChartRow row;
    row.spheres = spheresOf(loaded);
    for (const SceneBody& body : loaded.scene.bodies) {
      const BuildReport report = measureModel(*body.model);
      row.gapMax = std::max(row.gapMax, report.gapMax);
      row.gapMean = std::max(row.gapMean, report.gapMean);
    }
    for (std::size_t k = 0; k < std::min(runs.size(), points.size()); ++k) {
      const ChartPoint& p = points[k];
      if (runs[k].method != 0 || runs[k].model != m || p.failedAt || p.nodes > 0) continue;
      if (row.step > 0 && row.step <= p.step) continue;
      row.step = p.step;
      row.cpu = p.cpu;
      row.errorMax = p.errorMax;
      row.errorRms = p.errorRms;
      row.isReference = p.curve == truth.ownCurve;
    }
    rows.push_back(row);
  }
  std::sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.spheres < b.spheres; });
  return rows;
}

}  // namespace

std::vector<std::string> chartMethodNames() {
  std::vector<std::string> out;
  for (const ChartMethod& method : chartMethods()) out.push_back(method.name);
  return out;
}

std::vector<std::string> chartMethodsOfAnyModel() {
  std::vector<std::string> out;
  for (const ChartMethod& method : chartMethods())
    if (!method.needsIdentified) out.push_back(method.name);
  return out;
}

int runChart(const ChartOptions& options) {
  const LoadedScene base = loadRun(options.run);
  const std::string chart = (fs::path(options.folder) / "chart").string(),
                    spheres = (fs::path(options.folder) / "spheres").string();
  const OutputFolder folder(options.folder);
  const FolderLock lock(options.folder, options.folder, "another run is drawing a chart there");
  noteMergedSteps(options.steps, base.scene.dynamicsRate);
  std::vector<std::string> outputs;
  for (const std::string& stem : options.models.size() > 1 ? std::vector{chart, spheres} : std::vector{chart})
    for (const char* ending : {".csv", ".gnuplot", ".svg"}) outputs.push_back(stem + ending);
  requireDistinctOutputs(base, options.run, outputs);
  for (const NamedFile& model : options.models) requireDistinctFiles(outputs, {model.path});
  requireWritable(outputs);
  ChartTruth truth;
  const std::vector<ChartRun> runs = planRuns(options, base);
  const std::vector<ChartPoint> points = executeAll(runs, base, truth);
  writeChart(chart + ".csv", points, truth.cost);
  drawByGnuplot(chart, chartScript(base.scene.name, points, truth.cost));
  if (options.models.size() > 1) {
    const std::vector<SphereChartRow> rows = sphereRows(options, base, runs, points, truth);
    writeSphereChart(spheres + ".csv", rows, truth.cost);
    drawByGnuplot(spheres, sphereChartScript(base.scene.name, rows, truth.cost));
  }
  printResults(chartResults(points, truth));
  return 0;
}

}  // namespace medulla
