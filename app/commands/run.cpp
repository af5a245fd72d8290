#include "app/commands/run.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <filesystem>

#include "app/files/log_file.h"
#include "app/files/surface_file.h"
#include "app/interrupt.h"

namespace medulla {

double processCpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

void recordFrames(const Simulation& simulation, bool last, std::vector<RecordedFrame>& moments) {
  const double start = simulation.previous().time, end = simulation.current().time;
  for (RecordedFrame& m : moments) {
    const bool due = m.time <= end + 1e-9 || last;
    if (!due || !m.frame.bodies.empty()) continue;
    const double alpha = std::clamp((m.time - start) / (end - start), 0.0, 1.0);
    blendFrames(simulation.previous(), simulation.current(), alpha, m.frame);
  }
}

LoadedScene loadRun(const RunOptions& options) {
  Scene scene = readScene(options.scene, options.overrides);
  std::map<std::string, std::string> trajectories;
  for (const auto& [name, path] : options.trajectories) {
    if (name.empty() && scene.tools.size() != 1)
      throw std::runtime_error(
          fmt::format("--trajectory {}: the scene has {} tools, write TOOL=FILE", path, scene.tools.size()));
    trajectories[name.empty() ? scene.tools[0].name : name] = path;
  }
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
      const OutputFile writableAtAll(request.path);
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

// Whether a scene has come to rest.
class RestWatch {
 public:
  explicit RestWatch(const LoadedScene& loaded) {
    for (const SceneBody& body : loaded.scene.bodies)
      for (const DeadLoad& load : body.deadLoads) busyUntil_ = std::max(busyUntil_, load.to);
    for (const Trajectory& motion : loaded.trajectories) busyUntil_ = std::max(busyUntil_, motion.samples.back().time);
  }
  void afterFrame(const Simulation& simulation) {
    const World& world = simulation.world();
    fastest_ = 0;
    for (std::size_t b = 0; b < world.bodies().size(); ++b) {
      const double speed = world.nodeSpeed(static_cast<int>(b));
      if (speed <= fastest_) continue;
      fastest_ = speed;
      body_ = world.bodies()[b].name;
    }
    const double time = simulation.time();
    if (!(fastest_ < kStill) || time < busyUntil_) movedAt_ = time;
    atRest_ = time - movedAt_ >= kStillFor - 1e-9;
  }
  bool atRest() const { return atRest_; }
  [[noreturn]] void fail(double time) const {
    throw NotAtRest(fastest_ < kStill
                        ? fmt::format("not at rest: loads or tools act up to the end at {:.6g} s, or nearly", time)
                        : fmt::format("not at rest at {:.6g} s: a node of body '{}' moves at {:.3g} m/s, expected less "
                                      "than {:.0e} m/s",
                                      time, body_, fastest_, kStill));
  }

 private:
  static constexpr double kStill = 1e-5, kStillFor = 0.1;  // m/s, s
  double busyUntil_ = 0, movedAt_ = 0, fastest_ = 0;
  std::string body_;
  bool atRest_ = false;
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

}  // namespace

void requireDistinctOutputs(const LoadedScene& loaded, const RunOptions& options,
                            const std::vector<std::string>& pictures) {
  const Scene& scene = loaded.scene;
  std::vector<std::string> inputs{options.scene}, outputs = pictures;
  for (const SceneBody& body : scene.bodies) {
    inputs.insert(inputs.end(), {body.modelPath, body.referencePath});
    if (!body.referencePath.empty())
      inputs.push_back(std::filesystem::path(body.referencePath).replace_extension(".time").string());
  }
  for (const SceneStatic& item : scene.statics)
    if (!item.meshPath.empty()) inputs.push_back(item.meshPath);
  for (const SceneTool& tool : scene.tools) inputs.push_back(tool.trajectoryPath);
  for (const SceneBody& body : scene.bodies) {
    for (const SceneFix& fix : body.fixes) inputs.push_back(fix.nodes.verticesPath);
    for (const SceneLoad& load : body.loads) inputs.insert(inputs.end(), {load.nodes.verticesPath, load.forcesPath});
  }
  outputs.push_back(options.logPath);
  for (const SurfaceRequest& request : options.surfaces) outputs.push_back(request.path);
  requireDistinctFiles(outputs, inputs);
}

void runToEnd(const LoadedScene& loaded, const RunOptions& options, Simulation& simulation,
              const std::function<void()>& afterFrame, const std::function<void()>& finish,
              const std::function<void()>& advance) {
  SurfaceRecorder surfaces(loaded, options);
  LogRecorder log(loaded, options);
  RestWatch rest(loaded);
  for (const BodyOverlap& o : simulation.world().startOverlaps())
    fmt::print(stderr, "warning: bodies '{}' and '{}' overlap by {:.2g} mm at the start\n",
               loaded.scene.bodies[o.body0].name, loaded.scene.bodies[o.body1].name, 1e3 * o.depth);
  for (bool last = false; !last;) {
    checkInterrupt();
    if (advance)
      advance();
    else
      simulation.advanceFrame();
    if (options.untilRest) rest.afterFrame(simulation);
    if (options.untilRest && !rest.atRest() && simulation.finished()) rest.fail(simulation.time());
    last = simulation.finished() || rest.atRest();
    log.afterFrame(simulation);
    surfaces.afterFrame(simulation, last);
    afterFrame();
  }
  if (finish) finish();
  log.commit();
  surfaces.write(simulation);
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
