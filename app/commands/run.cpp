#include "app/commands/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "app/commands/rest_watch.h"
#include "app/commands/run_notes.h"
#include "app/commands/run_recorders.h"
#include "app/files/text.h"
#include "app/interrupt.h"
#include "app/standard_streams.h"

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

std::string meantName(const std::string& option, const NamedFile& file, const std::vector<std::string>& names,
                      const std::string& kind) {
  const auto refuse = [&](const std::string& why) {
    const std::string word = file.name.empty() ? file.path : file.name + "=" + file.path;
    throw std::runtime_error(fmt::format("{} {}: the scene has {}", option, word, why));
  };
  if (names.empty()) refuse("no " + kind);
  if (file.name.empty() && names.size() > 1)
    refuse(fmt::format("{} {}, write NAME=FILE: one of {}", names.size(), kind == "body" ? "bodies" : kind + "s",
                       joined(names, ", ")));
  if (!file.name.empty() && !isOneOf(file.name, names))
    refuse(fmt::format("no {} \"{}\"; {}", kind, file.name, hintOfNames(file.name, names)));
  return file.name.empty() ? names[0] : file.name;
}

std::map<std::string, std::string> filesOfTools(const std::string& option, const Scene& scene,
                                                const std::map<std::string, std::string>& files) {
  std::vector<std::string> names;
  for (const SceneTool& t : scene.tools) names.push_back(t.name);
  std::map<std::string, std::string> out;
  for (const auto& [name, path] : files) {
    const std::string tool = meantName(option, {name, path}, names, "tool");
    if (!out.try_emplace(tool, path).second)
      throw std::runtime_error(
          fmt::format("{} {}={}: another file is named for this tool, expected one file per tool", option, tool, path));
  }
  return out;
}

LoadedScene loadRun(const RunOptions& options) {
  Scene scene = readScene(options.scene, options.overrides);
  // What sleeps lies still within a hundredth of its radius, maybe in mid-swing: rest is asked for closer.
  if (options.untilRest) scene.dynamics.sleepAfter = 0;
  const auto trajectories = filesOfTools("--trajectory", scene, options.trajectories);
  return loadScene(std::move(scene), trajectories);
}

std::vector<double> pictureTimes(const Scene& scene, int first, int last) {
  std::vector<double> times;
  times.reserve(std::max(0, last - first));
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

std::vector<Result> runToEnd(const LoadedScene& loaded, const RunOptions& options, Simulation& simulation,
                             const RunHooks& hooks) {
  RunRecorders recorders(loaded, options);
  std::optional<RestWatch> rest;
  if (options.untilRest) rest.emplace(loaded, simulation);
  printWarnings(loaded, options, simulation.world());
  for (bool last = false; !last;) {
    checkInterrupt();
    if (hooks.advance)
      hooks.advance();
    else
      simulation.advanceFrame();
    if (rest) rest->afterFrame(simulation);
    const bool isAtRest = rest && rest->atRest();
    if (rest && !isAtRest && simulation.finished()) rest->fail(!outputFiles(options).empty());
    last = simulation.finished() || isAtRest;
    recorders.afterFrame(simulation, last);
    if (hooks.afterFrame) hooks.afterFrame();
  }
  if (hooks.ended) hooks.ended();
  recorders.finish(simulation);
  if (hooks.finish) hooks.finish();
  recorders.commit(simulation);
  if (hooks.commit) hooks.commit();
  printNotes(loaded, simulation.totals(), simulation.world());
  return recorders.forceResults();
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
