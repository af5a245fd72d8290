#include "app/commands/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <set>

#include "app/commands/rest_watch.h"
#include "app/files/log_file.h"
#include "app/files/output_file.h"
#include "app/files/state_cache.h"
#include "app/files/surface_file.h"
#include "app/files/text_file.h"
#include "app/files/trajectory_file.h"
#include "app/force_comparison.h"
#include "app/interrupt.h"
#include "app/motion_sources.h"
#include "physics/content_hash.h"

namespace medulla {

void recordFrames(const Simulation& simulation, bool last, std::vector<RecordedFrame>& moments) {
  const double start = simulation.previous().time, end = simulation.current().time;
  for (RecordedFrame& m : moments) {
    const bool due = m.time <= end + 1e-9 || last;
    if (!due || !m.frame.bodies.empty()) continue;
    const double alpha = std::clamp((m.time - start) / (end - start), 0.0, 1.0);
    blendFrames(simulation.previous(), simulation.current(), alpha, m.frame);
  }
}

CacheLayout cacheLayout(const LoadedScene& loaded) {
  CacheLayout layout;
  layout.motionHash = motionHash(loaded);
  layout.fps = loaded.scene.fps;
  for (const SceneBody& body : loaded.scene.bodies)
    layout.bodies.push_back(
        {body.name, static_cast<int>(body.model->spheres.size()), static_cast<int>(body.model->restNodes.size())});
  for (const SceneTool& tool : loaded.scene.tools) layout.tools.push_back(tool.name);
  return layout;
}

// With every tool named, and known.
static std::map<std::string, std::string> filesOfTools(const std::string& option, const Scene& scene,
                                                       const std::map<std::string, std::string>& files) {
  std::map<std::string, std::string> out;
  for (const auto& [name, path] : files) {
    if (name.empty() && scene.tools.size() != 1)
      throw std::runtime_error(
          fmt::format("{} {}: the scene has {} tools, write TOOL=FILE", option, path, scene.tools.size()));
    const std::string tool = name.empty() ? scene.tools[0].name : name;
    if (std::none_of(scene.tools.begin(), scene.tools.end(), [&](const SceneTool& t) { return t.name == tool; }))
      throw std::runtime_error(fmt::format("{} {}={}: the scene has no tool \"{}\"", option, name, path, name));
    if (!out.try_emplace(tool, path).second)
      throw std::runtime_error(
          fmt::format("{} {}={}: another file is named for this tool, expected one file per tool", option, tool, path));
  }
  return out;
}

LoadedScene loadRun(const RunOptions& options) {
  Scene scene = readScene(options.scene, options.overrides);
  const auto trajectories = filesOfTools("--trajectory", scene, options.trajectories);
  return loadScene(std::move(scene), trajectories);
}

namespace {

// Surfaces asked for, kept until the run is through: a run that fails later overwrites nothing.
class SurfaceRecorder {
 public:
  SurfaceRecorder(const LoadedScene& loaded, const RunOptions& options) {
    for (const SurfaceRequest& request : options.surfaces) {
      const double time = request.time.value_or(loaded.scene.duration);
      if (!(time >= 0 && time <= loaded.scene.duration))
        throw std::runtime_error(
            fmt::format("--surface-at {}: expected a time from 0 to {} s or \"end\"", time, loaded.scene.duration));
      requireWritable({request.path});
      moments_.push_back({time, {}});
      paths_.push_back(request.path);
    }
  }
  void afterFrame(const Simulation& simulation, bool last) { recordFrames(simulation, last, moments_); }
  void write(const Simulation& simulation) const {
    for (std::size_t k = 0; k < paths_.size(); ++k)
      writeSurface(paths_[k], simulation.world().bodies(), moments_[k].frame);
  }

 private:
  std::vector<RecordedFrame> moments_;
  std::vector<std::string> paths_;  // one each
};

class CacheRecorder {
 public:
  CacheRecorder(const LoadedScene& loaded, const RunOptions& options)
      : pictures_(pictureTimes(loaded.scene, 0, pictureCount(loaded.scene)), 0) {
    if (!options.cacheToWrite.empty()) file_.emplace(options.cacheToWrite, cacheLayout(loaded));
  }
  void afterFrame(const Simulation& simulation) {
    if (!file_) return;
    pictures_.afterFrame(simulation,
                         [&](int, const PictureState& state) { file_->write(state, simulation.world().stateHash()); });
  }
  void commit(const Simulation& simulation) {
    if (file_) file_->commit(simulation.world().stateHash());
  }

 private:
  std::optional<CacheWriter> file_;
  PictureTimes pictures_;
};

class LogRecorder {
 public:
  LogRecorder(const LoadedScene& loaded, const RunOptions& options) : everyTick_(options.logEveryTick) {
    if (options.logPath.empty()) return;
    std::vector<std::string> tools, bodies;
    for (const SceneTool& tool : loaded.scene.tools) tools.push_back(tool.name);
    for (const SceneBody& body : loaded.scene.bodies) bodies.push_back(body.name);
    file_.emplace(options.logPath, tools, bodies);
  }
  // Bodies and energies are those of the end of the dynamics frame, in rows of ticks too.
  void afterFrame(const Simulation& simulation) {
    if (!file_) return;
    const World& world = simulation.world();
    const ServoRecord& record = simulation.record();
    row_.bodies.resize(world.bodies().size());
    for (std::size_t b = 0; b < row_.bodies.size(); ++b) {
      row_.bodies[b].volumeRatio = world.volumeRatio(static_cast<int>(b));
      row_.bodies[b].dynamicNodes = world.dynamicNodes(static_cast<int>(b));
    }
    row_.energies = world.energies();
    row_.impulseMismatch = simulation.lastImpulseMismatch();
    const int ticks = static_cast<int>(record.tools.size()) - 1;
    for (int tick = everyTick_ ? 1 : ticks; tick <= ticks; ++tick) {
      row_.time = record.start + record.duration * tick / ticks;
      row_.tools = record.tools[tick];
      file_->write(row_);
    }
  }
  void commit() {
    if (file_) file_->commit();
  }

 private:
  bool everyTick_;
  std::optional<LogFile> file_;
  LogRow row_;
};

// What the tools consumed and felt, tick by tick: a file per tool that is asked for.
class MotionRecorder {
 public:
  MotionRecorder(const LoadedScene& loaded, const RunOptions& options) : files_(loaded.scene.tools.size()) {
    const auto records = filesOfTools("--record", loaded.scene, options.records);
    for (std::size_t k = 0; k < files_.size(); ++k)
      if (const auto found = records.find(loaded.scene.tools[k].name); found != records.end())
        files_[k] = std::make_unique<TrajectoryFile>(found->second);
  }
  void afterFrame(const Simulation& simulation) {
    const ServoRecord& record = simulation.record();
    for (std::size_t tick = record.start > 0 ? 1 : 0; tick < record.inputs.size(); ++tick)
      for (std::size_t k = 0; k < files_.size(); ++k)
        if (files_[k]) files_[k]->write(record.inputs[tick][k], record.tools[tick][k].force);
  }
  void commit() {
    for (const auto& file : files_)
      if (file) file->commit();
  }

 private:
  std::vector<std::unique_ptr<TrajectoryFile>> files_;  // one per tool
};

// CSV, a row per dynamics frame: t in s, what servo, dynamics and the surface's renewal took in ms.
class FrameTimesRecorder {
 public:
  explicit FrameTimesRecorder(const RunOptions& options) {
    if (options.frameTimesPath.empty()) return;
    file_.emplace(options.frameTimesPath);
    file_->write("t,servo,dynamics,surface\n");
  }
  void afterFrame(const Simulation& simulation) {
    if (!file_) return;
    const FrameTimes& times = simulation.times();
    file_->write(fmt::format("{:.6g},{:.4g},{:.4g},{:.4g}\n", simulation.time(), 1e3 * times.servo,
                             1e3 * times.dynamics, 1e3 * times.surface));
  }
  void commit() {
    if (file_) file_->commit();
  }

 private:
  std::optional<OutputFile> file_;
};

std::vector<Result> forceResults(const LoadedScene& loaded, const ForceComparison& forces) {
  std::vector<Result> out;
  const auto matches = forces.matches();
  for (std::size_t k = 0; k < matches.size(); ++k) {
    if (!matches[k]) continue;
    const ForceMatch& match = *matches[k];
    const auto add = [&](const char* name, double value, const char* unit) {
      out.push_back({fmt::format("{}.{}", loaded.scene.tools[k].name, name), fmt::format("{:.4g}", value), unit});
    };
    add("force_rms", match.rms, "N");
    add("force_peak", match.peak, "N");
    add("force_peak_measured", match.peakMeasured, "N");
    if (!match.lag) continue;
    add("force_lag", *match.lag, "s");
    add("force_correlation", match.correlation, "");
  }
  return out;
}

}  // namespace

// Every file that a run reads; some may be empty or missing.
static std::vector<std::string> inputFiles(const Scene& scene) {
  std::vector<std::string> inputs{scene.path};
  for (const SceneBody& body : scene.bodies) {
    inputs.push_back(body.modelPath);
    for (const SceneFix& fix : body.fixes) inputs.push_back(fix.nodes.verticesPath);
    for (const SceneLoad& load : body.loads) inputs.insert(inputs.end(), {load.nodes.verticesPath, load.forcesPath});
    if (body.referencePath.empty()) continue;
    inputs.push_back(body.referencePath);
    inputs.push_back(std::filesystem::path(body.referencePath).replace_extension(".time").string());
  }
  for (const SceneStatic& item : scene.statics) inputs.push_back(item.meshPath);
  for (const SceneTool& tool : scene.tools) inputs.insert(inputs.end(), {tool.trajectoryPath, tool.recordingPath});
  std::erase(inputs, "");
  return inputs;
}

static std::vector<std::string> outputFiles(const RunOptions& options) {
  std::vector<std::string> outputs{options.logPath, options.cacheToWrite, options.frameTimesPath};
  for (const auto& [tool, path] : options.records) outputs.push_back(path);
  for (const SurfaceRequest& request : options.surfaces) outputs.push_back(request.path);
  std::erase(outputs, "");
  return outputs;
}

void requireDistinctOutputs(const LoadedScene& loaded, const RunOptions& options,
                            const std::vector<std::string>& pictures) {
  std::vector<std::string> outputs = pictures;
  for (const std::string& path : outputFiles(options)) outputs.push_back(path);
  requireDistinctFiles(outputs, inputFiles(loaded.scene));
}

// The scene counts by what it says, the files that it names by their bytes: where they lie does not matter.
static std::uint64_t runHash(const LoadedScene& loaded, std::uint64_t scene) {
  std::uint64_t hash = contentHash(fmt::format("{} {} {:016x}", MEDULLA_VERSION, MEDULLA_MOTION_SOURCES, scene));
  for (const std::string& path : inputFiles(loaded.scene))
    if (path != loaded.scene.path && std::filesystem::exists(path)) hash = contentHash(readTextFile(path), hash);
  return hash;
}

std::uint64_t motionHash(const LoadedScene& loaded) {
  return runHash(loaded, loaded.scene.motionHash);
}

std::uint64_t pictureHash(const LoadedScene& loaded) {
  return runHash(loaded, loaded.scene.contentHash);
}

int pictureCount(const Scene& scene) {
  return static_cast<int>(std::ceil(scene.duration * scene.fps - 1e-9));
}

std::vector<double> pictureTimes(const Scene& scene, int first, int last) {
  std::vector<double> times;
  for (int k = first; k < last; ++k) times.push_back(k / scene.fps);
  return times;
}

void PictureTimes::afterFrame(const Simulation& simulation, const std::function<void(int, const PictureState&)>& each) {
  const double end = simulation.record().start + simulation.record().duration;
  for (; next_ < times_.size() && times_[next_] <= end + 1e-9; ++next_) {
    stateAt(simulation.record(), times_[next_], state_);
    each(firstNumber_ + static_cast<int>(next_), state_);
  }
}

// Scripted motions end before their scenes by intention, and the tool stands still from then on. What lies outside the
// scene is never seen, and a table whose clock begins late was likely cut out of a longer one.
static void printUnplayed(const LoadedScene& loaded) {
  constexpr double kLeast = 0.5, kShare = 0.05;  // s; of the motion
  const Scene& scene = loaded.scene;
  const bool isShortened = std::any_of(scene.overridden.begin(), scene.overridden.end(),
                                       [](const OverriddenAttribute& o) { return o.path == "clock.duration"; });
  for (std::size_t k = 0; k < loaded.trajectories.size(); ++k) {
    const SceneTool& tool = scene.tools[k];
    const double start = loaded.trajectories[k].samples.front().time, end = motionEnd(loaded.trajectories[k]);
    const double length = end - start;
    const double outside = length - std::max(0.0, std::min(end, scene.duration) - std::max(start, 0.0));
    if (tool.recordingPath.empty() && start > kLeast && length > 0)
      fmt::print(stderr, "note: tool '{}' stands still until {:.6g} s, where {} begins\n", tool.name, start,
                 tool.trajectoryPath);
    if (!isShortened && outside >= kLeast && outside > kShare * length)
      fmt::print(stderr,
                 "note: {:.4g} of {:.4g} s of the motion of tool '{}' are not played: the scene is 0 to {:.6g} s\n",
                 outside, length, tool.name, scene.duration);
  }
}

void printWarnings(const LoadedScene& loaded, const World& world) {
  const Scene& scene = loaded.scene;
  printUnplayed(loaded);
  for (const BodyOverlap& o : world.startOverlaps())
    fmt::print(stderr, "warning: bodies '{}' and '{}' overlap by {:.2g} mm at the start\n", scene.bodies[o.body0].name,
               scene.bodies[o.body1].name, 1e3 * o.depth);
  for (const SceneBody& body : scene.bodies)
    if (std::set<int>(body.fixedNodes.begin(), body.fixedNodes.end()).size() == body.model->restNodes.size())
      fmt::print(stderr, "note: every node of body '{}' is held\n", body.name);
  if (scene.dynamics.sleepAfter > 0 && scene.dynamics.integrator == Integrator::implicit)
    fmt::print(stderr, "warning: sleep_after has no effect: bodies sleep under the explicit integrator only\n");
}

// What a run came to that was hardly meant. A run that ends before a tool's motion does says nothing of the tool.
static void printNotes(const LoadedScene& loaded, const RunTotals& totals) {
  for (std::size_t k = 0; k < loaded.trajectories.size(); ++k) {
    if (motionEnd(loaded.trajectories[k]) > totals.simulated + 1e-9) continue;
    const std::string& name = loaded.scene.tools[k].name;
    const int closings = totals.closings[k];
    if (!totals.touched[k])
      fmt::print(stderr, "note: tool '{}' touched nothing in its whole motion\n", name);
    else if (closings > 0 && !totals.held[k])
      fmt::print(stderr, "note: tool '{}' closed {} and held nothing\n", name,
                 closings == 1 ? "once" : fmt::format("{} times", closings));
    else if (totals.beganClosed[k] && !totals.held[k])
      fmt::print(stderr, "note: tool '{}' was closed from the start and held nothing\n", name);
  }
  if (totals.volumeRatioMin <= 0)
    fmt::print(stderr,
               "note: a body was turned inside out (volume_ratio_min {:.3g}): its model is too coarse, its tissue too "
               "soft for what acts on it, or a step too long\n",
               totals.volumeRatioMin);
}

std::vector<Result> runToEnd(const LoadedScene& loaded, const RunOptions& options, Simulation& simulation,
                             const std::function<void()>& afterFrame, const std::function<void()>& finish,
                             const std::function<void()>& advance) {
  SurfaceRecorder surfaces(loaded, options);
  LogRecorder log(loaded, options);
  CacheRecorder cache(loaded, options);
  MotionRecorder motions(loaded, options);
  FrameTimesRecorder frameTimes(options);
  ForceComparison forces(loaded);
  RestWatch rest(loaded, simulation);
  printWarnings(loaded, simulation.world());
  for (bool last = false; !last;) {
    checkInterrupt();
    if (advance)
      advance();
    else
      simulation.advanceFrame();
    if (options.untilRest) rest.afterFrame(simulation);
    if (options.untilRest && !rest.atRest() && simulation.finished())
      rest.fail(simulation.time(), !outputFiles(options).empty());
    last = simulation.finished() || rest.atRest();
    // A servo that runs elsewhere hands over its rest first, a frame before the motion begins.
    if (simulation.record().start >= 0) {
      log.afterFrame(simulation);
      motions.afterFrame(simulation);
      forces.afterFrame(simulation);
    }
    frameTimes.afterFrame(simulation);
    surfaces.afterFrame(simulation, last);
    cache.afterFrame(simulation);
    afterFrame();
  }
  if (finish) finish();
  log.commit();
  cache.commit(simulation);
  motions.commit();
  frameTimes.commit();
  surfaces.write(simulation);
  printNotes(loaded, simulation.totals());
  return forceResults(loaded, forces);
}

std::vector<Result> runResults(const Simulation& simulation, double cpuSeconds, double wallSeconds) {
  const RunTotals& totals = simulation.totals();
  const PenetrationReport penetration = simulation.world().penetration();
  return {{"simulated", fmt::format("{:.6g}", totals.simulated), "s"},
          {"cpu", fmt::format("{:.4g}", cpuSeconds), "s"},
          {"realtime", fmt::format("{:.4g}", totals.simulated / std::max(wallSeconds, 1e-9)), "x"},
          {"substeps", fmt::format("{}", totals.substeps), ""},
          {"ticks", fmt::format("{}", totals.ticks), ""},
          {"force_max", fmt::format("{:.5g}", totals.forceMax), "N"},
          {"force_clamped", fmt::format("{}", totals.clampedTicks), "ticks"},
          {"grip_slips", fmt::format("{}", totals.gripSlips), ""},
          {"user_energy_max", fmt::format("{:.4g}", totals.userEnergyMax), "J"},
          {"volume_ratio_min", fmt::format("{:.5g}", totals.volumeRatioMin), ""},
          {"volume_ratio_max", fmt::format("{:.5g}", totals.volumeRatioMax), ""},
          {"impulse_mismatch", fmt::format("{:.4g}", totals.impulseMismatch()), "%"},
          {"penetration_max", fmt::format("{:.3g}", penetration.bodies), "%"},
          {"static_penetration_max", fmt::format("{:.3g}", penetration.statics), "%"},
          {"hash", fmt::format("{:016x}", simulation.world().stateHash()), ""}};
}

void printResults(const std::vector<Result>& results) {
  for (const Result& r : results)
    fmt::print("{} {}{}\n", r.name, r.value, r.unit.empty() ? std::string() : " " + r.unit);
}

}  // namespace medulla
