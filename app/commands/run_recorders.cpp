#include "app/commands/run_recorders.h"

#include <fmt/format.h>

#include <deque>
#include <optional>
#include <stdexcept>

#include "app/files/log_file.h"
#include "app/files/number_text.h"
#include "app/files/output_file.h"
#include "app/files/state_cache.h"
#include "app/files/surface_file.h"
#include "app/files/trajectory_file.h"
#include "app/force_comparison.h"
#include "app/standard_streams.h"

namespace medulla {

namespace {

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
      requests_.push_back(request);
    }
  }
  void afterFrame(const Simulation& simulation, bool last) { recordFrames(simulation, last, moments_); }
  void finish(const Simulation& simulation) {
    for (std::size_t k = 0; k < requests_.size(); ++k) {
      OutputFile& file = files_.emplace_back(requests_[k].path);
      file.write(surfaceText(simulation.world().bodies(), moments_[k].frame));
      file.finish();
    }
  }
  void commit(const Simulation& simulation) {
    for (OutputFile& file : files_) file.commit();
    for (const SurfaceRequest& request : requests_)
      if (request.time.value_or(0) > simulation.time() + 1e-9)
        tell("note: {} is the shape at rest, at {:.6g} s: the run ended before {:.6g} s\n", request.path,
             simulation.time(), *request.time);
  }

 private:
  std::vector<RecordedFrame> moments_;
  std::vector<SurfaceRequest> requests_;  // one each
  std::deque<OutputFile> files_;          // likewise; many would be too many to be open
};

class CacheRecorder {
 public:
  CacheRecorder(const LoadedScene& loaded, const RunOptions& options) {
    if (options.cacheToWrite.empty()) return;
    file_.emplace(options.cacheToWrite, cacheLayout(loaded));
    pictures_.emplace(pictureTimes(loaded.scene, 0, pictureCount(loaded.scene)), 0);
  }
  void afterFrame(const Simulation& simulation) {
    if (!file_) return;
    pictures_->afterFrame(simulation,
                          [&](int, const PictureState& state) { file_->write(state, simulation.world().stateHash()); });
  }
  void finish(const Simulation& simulation) {
    if (file_) file_->finish(simulation.world().stateHash());
  }
  void commit() {
    if (file_) file_->commit();
  }

 private:
  std::optional<CacheWriter> file_;
  std::optional<PictureTimes> pictures_;
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
  void finish() {
    if (file_) file_->finish();
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
  void finish() {
    for (const auto& file : files_)
      if (file) file->finish();
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
    std::string row;
    appendNumber(row, simulation.time());
    row += fmt::format(",{:.4g},{:.4g},{:.4g}\n", 1e3 * times.servo, 1e3 * times.dynamics, 1e3 * times.surface);
    file_->write(row);
  }
  void finish() {
    if (file_) file_->finish();
  }
  void commit() {
    if (file_) file_->commit();
  }

 private:
  std::optional<OutputFile> file_;
};

}  // namespace

struct RunRecorders::Data {
  Data(const LoadedScene& scene, const RunOptions& options)
      : loaded(&scene),
        surfaces(scene, options),
        log(scene, options),
        cache(scene, options),
        motions(scene, options),
        frameTimes(options),
        forces(scene) {}

  const LoadedScene* loaded;
  SurfaceRecorder surfaces;
  LogRecorder log;
  CacheRecorder cache;
  MotionRecorder motions;
  FrameTimesRecorder frameTimes;
  ForceComparison forces;
};

RunRecorders::RunRecorders(const LoadedScene& loaded, const RunOptions& options)
    : data_(std::make_unique<Data>(loaded, options)) {}
RunRecorders::~RunRecorders() = default;

void RunRecorders::afterFrame(const Simulation& simulation, bool last) {
  // A servo that runs elsewhere hands over its rest first, a frame before the motion begins.
  if (simulation.record().start >= 0) {
    data_->log.afterFrame(simulation);
    data_->motions.afterFrame(simulation);
    data_->forces.afterFrame(simulation);
  }
  data_->frameTimes.afterFrame(simulation);
  data_->surfaces.afterFrame(simulation, last);
  data_->cache.afterFrame(simulation);
}

void RunRecorders::finish(const Simulation& simulation) {
  data_->log.finish();
  data_->cache.finish(simulation);
  data_->motions.finish();
  data_->frameTimes.finish();
  data_->surfaces.finish(simulation);
}

void RunRecorders::commit(const Simulation& simulation) {
  data_->log.commit();
  data_->cache.commit();
  data_->motions.commit();
  data_->frameTimes.commit();
  data_->surfaces.commit(simulation);
}

std::vector<Result> RunRecorders::forceResults() const {
  std::vector<Result> out;
  const auto matches = data_->forces.matches();
  for (std::size_t k = 0; k < matches.size(); ++k) {
    if (!matches[k]) continue;
    const ForceMatch& match = *matches[k];
    const auto add = [&](const char* name, double value, const char* unit) {
      out.push_back(
          {fmt::format("{}.{}", data_->loaded->scene.tools[k].name, name), fmt::format("{:.4g}", value), unit});
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

}  // namespace medulla
