#include "app/commands/run.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>

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

// Surfaces asked for, written when the run has passed their time.
class SurfaceWriter {
 public:
  SurfaceWriter(const LoadedScene& loaded, const RunOptions& options) : loaded_(&loaded) {
    for (const SurfaceRequest& request : options.surfaces) {
      const double time = request.time.value_or(loaded.scene.duration);
      if (time < 0 || time > loaded.scene.duration)
        throw std::runtime_error(fmt::format("--surface-at {}: expected a time from 0 to {} s or \"end\"", time,
                                             loaded.scene.duration));
      pending_.push_back({time, std::make_unique<OutputFile>(request.path)});
    }
  }
  void afterFrame(const Simulation& simulation) {
    const double end = simulation.time(), start = simulation.previous().time;
    for (Pending& p : pending_) {
      if (p.written || (p.time > end + 1e-9 && !simulation.finished())) continue;
      DynamicsFrame frame;
      blendFrames(simulation.previous(), simulation.current(), std::clamp((p.time - start) / (end - start), 0.0, 1.0),
                  frame);
      writeSurfaces(*p.file, *loaded_, frame);
      p.written = true;
    }
  }
  void commit() {
    for (Pending& p : pending_) p.file->commit();
  }

 private:
  struct Pending {
    double time;
    std::unique_ptr<OutputFile> file;
    bool written = false;
  };
  const LoadedScene* loaded_;
  std::vector<Pending> pending_;
};

}  // namespace

void runToEnd(const LoadedScene& loaded, const RunOptions& options, Simulation& simulation,
              const std::function<void()>& afterFrame) {
  SurfaceWriter surfaces(loaded, options);
  std::unique_ptr<LogFile> log;
  if (!options.logPath.empty()) log = std::make_unique<LogFile>(options.logPath, loaded.scene, options.logEveryTick);
  while (!simulation.finished()) {
    checkInterrupt();
    simulation.advanceFrame();
    if (log) log->append(simulation);
    surfaces.afterFrame(simulation);
    afterFrame();
  }
  if (log) log->commit();
  surfaces.commit();
}

void printTotals(const Simulation& simulation, double cpuSeconds, double wallSeconds) {
  const RunTotals& totals = simulation.totals();
  fmt::print("simulated {:.6g} s\n", totals.simulated);
  fmt::print("cpu {:.4g} s\n", cpuSeconds);
  fmt::print("realtime {:.4g} x\n", wallSeconds > 0 ? totals.simulated / wallSeconds : 0);
  fmt::print("substeps {}\n", totals.substeps);
  fmt::print("ticks {}\n", totals.ticks);
  fmt::print("force_max {:.5g} N\n", totals.forceMax);
  fmt::print("volume_ratio_min {:.5g}\n", totals.volumeRatioMin);
  fmt::print("volume_ratio_max {:.5g}\n", totals.volumeRatioMax);
  fmt::print("impulse_mismatch {:.4g} %\n", totals.impulseMismatch());
  fmt::print("hash {:016x}\n", simulation.world().stateHash());
}

}  // namespace medulla
