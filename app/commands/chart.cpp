#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include "app/commands/commands.h"
#include "app/files/chart_file.h"
#include "app/files/gnuplot.h"
#include "app/files/output_file.h"
#include "app/interrupt.h"
#include "app/progress.h"

namespace medulla {

namespace {

namespace fs = std::filesystem;

// What is charted, a curve each: overrides of the scene, in which * stands for every body.
struct ChartMethod {
  std::string name;
  std::vector<SceneOverride> overrides;
};
const std::vector<ChartMethod>& chartMethods() {
  static const std::vector<ChartMethod> methods = {
      {"full", {{"body.*.surface", "full"}}},
      {"contact", {{"body.*.surface", "contact"}}},
      {"skin", {{"body.*.surface", "skin"}}},
      {"springs", {{"body.*.links", "springs"}}},
      {"implicit", {{"dynamics.integrator", "implicit"}}},
      {"implicit_2", {{"dynamics.integrator", "implicit"}, {"dynamics.order", "2"}}},
  };
  return methods;
}

// The scene with one method, model and step.
struct ChartRun {
  std::string curve;
  RunOptions options;
  int spheres = 0;
  double step = 0;  // s
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

// The override that puts "[BODY=]FILE" in the place of a model. Overrides are relative to the scene, words on the
// command line to where it was typed.
SceneOverride modelOverride(const std::string& model, const Scene& scene) {
  const std::size_t equals = model.find('=');
  if (equals == std::string::npos && scene.bodies.size() != 1)
    throw std::runtime_error(
        fmt::format("--models {}: the scene has {} bodies, write BODY=FILE", model, scene.bodies.size()));
  const std::string body = equals == std::string::npos ? scene.bodies[0].name : model.substr(0, equals);
  const std::string path = equals == std::string::npos ? model : model.substr(equals + 1);
  if (!fs::exists(path)) throw std::runtime_error(fmt::format("--models {}: {} does not exist", model, path));
  return {fmt::format("body.{}.model", body), fs::absolute(path).string()};
}

int spheresOf(const LoadedScene& loaded) {
  std::size_t count = 0;
  for (const auto& model : loaded.models) count += model->spheres.size();
  return static_cast<int>(count);
}

// Nodes are compared by number: models must be of the same meshes.
void requireSameMeshes(const LoadedScene& a, const LoadedScene& b) {
  for (std::size_t k = 0; k < a.models.size(); ++k)
    if (a.models[k]->restNodes != b.models[k]->restNodes)
      throw std::runtime_error(fmt::format("the model {} is of another mesh than {}: expected the same nodes",
                                           b.scene.bodies[k].modelPath, a.scene.bodies[k].modelPath));
}

// Every run of the chart; the reference last: the first method on the most spheres, at half of the smallest step.
std::vector<ChartRun> planRuns(const ChartOptions& options, const LoadedScene& base) {
  std::vector<std::vector<SceneOverride>> models;
  for (const std::string& model : options.models) models.push_back({modelOverride(model, base.scene)});
  if (models.empty()) models.push_back({});
  std::set<int> substeps;
  for (const double step : options.steps)
    substeps.insert(std::max(1, static_cast<int>(std::lround(1 / (step * base.scene.dynamicsRate)))));
  std::vector<ChartRun> runs;
  ChartRun reference;
  const auto add = [&](ChartRun run, int count) {
    run.options.overrides.push_back({"dynamics.substeps", fmt::format("{}", count)});
    run.step = 1 / (base.scene.dynamicsRate * count);
    runs.push_back(std::move(run));
  };
  for (const std::string& name : options.methods) {
    const auto method = std::find_if(chartMethods().begin(), chartMethods().end(),
                                     [&](const ChartMethod& m) { return m.name == name; });
    for (const std::vector<SceneOverride>& model : models) {
      ChartRun run{name, options.run, 0, 0};
      for (const auto& overrides : {expanded(method->overrides, base.scene), model})
        run.options.overrides.insert(run.options.overrides.end(), overrides.begin(), overrides.end());
      const LoadedScene loaded = loadRun(run.options);
      requireSameMeshes(base, loaded);
      run.spheres = spheresOf(loaded);
      if (models.size() > 1) run.curve += fmt::format("_{}_spheres", run.spheres);
      if (name == options.methods[0] && run.spheres > reference.spheres) reference = run;
      for (const int count : substeps) add(run, count);
    }
  }
  add(reference, 2 * *substeps.rbegin());
  return runs;
}

// Where a run is compared: at the scene's golden times and at the end.
std::vector<RecordedFrame> framesToRecord(const Scene& scene) {
  std::vector<RecordedFrame> out;
  for (const double time : scene.goldenTimes) out.push_back({time, {}});
  if (out.empty() || out.back().time < scene.duration) out.push_back({scene.duration, {}});
  return out;
}

Outcome execute(const ChartRun& run, const std::function<void(double)>& progress) {
  const LoadedScene loaded = loadRun(run.options);
  Outcome out;
  out.point.curve = run.curve;
  out.point.spheres = run.spheres;
  out.point.step = run.step;
  out.moments = framesToRecord(loaded.scene);
  Simulation simulation(loaded);
  const double start = processCpuSeconds();
  while (!simulation.finished() && !out.point.failedAt) {
    checkInterrupt();
    try {
      simulation.advanceFrame();
      recordFrames(simulation, simulation.finished(), out.moments);
    } catch (const std::runtime_error&) {  // the state is not finite any more
      out.point.failedAt = simulation.totals().simulated;
    }
    progress(simulation.totals().simulated);
  }
  out.point.cpu = (processCpuSeconds() - start) / simulation.totals().simulated;
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

// m, of the node that is farthest from where it lies at rest.
double largestDisplacement(const LoadedScene& loaded, const std::vector<RecordedFrame>& moments) {
  double squared = 0;
  for (const RecordedFrame& m : moments)
    for (std::size_t b = 0; b < m.frame.bodies.size(); ++b)
      for (std::size_t i = 0; i < m.frame.bodies[b].nodes.size(); ++i) {
        const Eigen::Vector3d rest = loaded.scene.bodies[b].worldFromModel * loaded.models[b]->restNodes[i];
        squared = std::max(squared, (m.frame.bodies[b].nodes[i] - rest).squaredNorm());
      }
  return std::sqrt(squared);
}

struct Deviation {
  double largest = 0, sum = 0;  // m, m2
  std::size_t count = 0;
  void add(const DynamicsFrame& a, const DynamicsFrame& b) {
    for (std::size_t k = 0; k < a.bodies.size(); ++k)
      for (std::size_t i = 0; i < a.bodies[k].nodes.size(); ++i) {
        const double squared = (a.bodies[k].nodes[i] - b.bodies[k].nodes[i]).squaredNorm();
        largest = std::max(largest, std::sqrt(squared));
        sum += squared;
        ++count;
      }
  }
  double rms() const { return std::sqrt(sum / static_cast<double>(count)); }
};

void measureErrors(Outcome& run, const Outcome& reference, double displacement) {
  if (run.point.failedAt) return;
  Deviation all, end;
  for (std::size_t k = 0; k < run.moments.size(); ++k) all.add(run.moments[k].frame, reference.moments[k].frame);
  end.add(run.moments.back().frame, reference.moments.back().frame);
  const double percent = 100 / displacement;
  run.point.errorMax = percent * all.largest;
  run.point.errorRms = percent * all.rms();
  run.point.endErrorMax = percent * end.largest;
  run.point.endErrorRms = percent * end.rms();
}

std::vector<ChartPoint> executeAll(const std::vector<ChartRun>& runs, const LoadedScene& base, double& displacement) {
  Progress progress("chart", base.scene.duration * static_cast<double>(runs.size()), "s");
  double done = 0;
  const auto update = [&](double simulated) { progress.update(done + simulated); };
  const Outcome reference = execute(runs.back(), update);
  if (reference.point.failedAt)
    throw std::runtime_error(
        fmt::format("the reference run with substeps of {:.3g} ms is not finite at {:.6g} s: use "
                    "smaller --steps",
                    1e3 * runs.back().step, *reference.point.failedAt));
  displacement = largestDisplacement(base, reference.moments);
  if (!(displacement > 0)) throw std::runtime_error("nothing moves in this scene: no error can be stated");
  std::vector<ChartPoint> points;
  for (std::size_t k = 0; k + 1 < runs.size(); ++k) {
    done += base.scene.duration;
    Outcome run = executeQuickest(runs[k], base.scene.duration, update);
    measureErrors(run, reference, displacement);
    points.push_back(run.point);
  }
  markFront(points);
  return points;
}

std::vector<Result> chartResults(const std::vector<ChartPoint>& points, const ChartRun& reference,
                                 double displacement) {
  const auto failed = std::count_if(points.begin(), points.end(), [](const ChartPoint& p) { return bool(p.failedAt); });
  std::vector<Result> results = {{"runs", fmt::format("{}", points.size()), ""},
                                 {"failed", fmt::format("{}", failed), ""},
                                 {"reference_step", fmt::format("{:.4g}", reference.step), "s"},
                                 {"reference_spheres", fmt::format("{}", reference.spheres), ""},
                                 {"largest_displacement", fmt::format("{:.4g}", displacement), "m"}};
  // Time at equal accuracy: the cheapest run of each curve that is good enough.
  for (const double percent : {1.0, 2.0, 5.0, 10.0}) {
    std::map<std::string, double> cheapest;
    for (const ChartPoint& p : points) {
      if (p.failedAt || p.errorMax > percent) continue;
      const auto [known, isNew] = cheapest.try_emplace(p.curve, p.cpu);
      if (!isNew) known->second = std::min(known->second, p.cpu);
    }
    for (const auto& [curve, cpu] : cheapest)
      results.push_back({fmt::format("{}.cpu_at_{}%", curve, percent), fmt::format("{:.4g}", cpu), "s/s"});
  }
  return results;
}

}  // namespace

std::vector<std::string> chartMethodNames() {
  std::vector<std::string> out;
  for (const ChartMethod& method : chartMethods()) out.push_back(method.name);
  return out;
}

int runChart(const ChartOptions& options) {
  const LoadedScene base = loadRun(options.run);
  const std::string csv = (fs::path(options.folder) / "chart.csv").string(),
                    script = (fs::path(options.folder) / "chart.gnuplot").string(),
                    picture = (fs::path(options.folder) / "chart.svg").string();
  std::error_code error;
  const bool made = fs::create_directories(options.folder, error);
  if (error) throw std::runtime_error(fmt::format("{}: cannot be made: {}", options.folder, error.message()));
  try {
    requireDistinctOutputs(base, options.run, {csv, script, picture});
    const std::vector<ChartRun> runs = planRuns(options, base);
    double displacement = 0;
    const std::vector<ChartPoint> points = executeAll(runs, base, displacement);
    writeChart(csv, points);
    writeText(script, chartScript(base.scene.name, points));
    if (const std::optional<std::string> svg = runGnuplot(script)) {
      writeText(picture, *svg);
    } else {
      fmt::print(stderr, "no chart.svg: gnuplot is not installed (Debian package gnuplot-nox); then: gnuplot {} > {}\n",
                 script, picture);
    }
    printResults(chartResults(points, runs.back(), displacement));
  } catch (...) {
    if (made) fs::remove(options.folder, error);  // if it is empty again
    throw;
  }
  return 0;
}

}  // namespace medulla
