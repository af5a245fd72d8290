#include <fmt/format.h>

#include "app/commands/commands.h"
#include "app/live_servo.h"
#include "app/progress.h"
#include "app/standard_streams.h"

namespace medulla {

static std::vector<Result> liveResults(const LiveReport& live) {
  const auto micros = [](double seconds) { return fmt::format("{:.1f}", 1e6 * seconds); };
  return {{"servo_ticks", fmt::format("{}", live.ticks), ""},
          {"servo_cpu_p50", micros(live.cpuMedian), "us"},
          {"servo_cpu_p99.9", micros(live.cpu999), "us"},
          {"servo_cpu_max", micros(live.cpuMax), "us"},
          {"servo_late", fmt::format("{}", live.lateTicks), "ticks"},
          {"servo_latest", fmt::format("{:.3g}", 1e3 * live.latest), "ms"},
          {"surface_stood", fmt::format("{}", live.standingTicks), "ticks"}};
}

static void tellLive(const LiveReport& report, const RunTotals& totals) {
  if (report.lateTicks > 0 || report.standingTicks > 0)
    tell(
        "medulla: {} of {} ticks woke more than a tick late, up to {:.3g} ms; in {} the surface stood still "
        "because the dynamics was late: these are in no log, recording or total\n",
        report.lateTicks, report.ticks, 1e3 * report.latest, report.standingTicks);
  constexpr double kApart = 50;  // %; below, short touches
  if (totals.impulseMismatch() > kApart)
    tell(
        "note: the impulses that hand and tissue got differ by {:.3g} %: what a body does is felt two and a half "
        "dynamics frames later here, and one that is light and free may flutter; <clock dynamics> sets their rate\n",
        totals.impulseMismatch());
}

int runReplay(const RunOptions& options) {
  const LoadedScene loaded = loadRun(options);
  requireDistinctOutputs(loaded, options);
  Simulation simulation(loaded, options.embree);
  Progress progress("replay", loaded.scene.duration, "s");
  const double cpuStart = processCpuSeconds();
  const double start = wallSeconds();
  std::optional<LiveServo> live;
  LiveReport report;
  RunHooks hooks;
  if (options.realtime) {
    live.emplace(simulation);
    hooks.advance = [&] { live->advanceFrame(); };
  }
  hooks.afterFrame = [&] { progress.update(simulation.time()); };
  hooks.ended = [&] {
    if (live) report = live->stop();
    progress.end();
  };
  const std::vector<Result> forces = runToEnd(loaded, options, simulation, hooks);
  const double wall = wallSeconds() - start;
  std::vector<Result> results = runResults(simulation, processCpuSeconds() - cpuStart, wall);
  if (options.untilRest) results.insert(results.begin(), {"rest_at", fmt::format("{:.6g}", simulation.time()), "s"});
  results.insert(results.end(), forces.begin(), forces.end());
  if (live) {
    const std::vector<Result> more = liveResults(report);
    results.insert(results.end(), more.begin(), more.end());
    tellLive(report, simulation.totals());
  }
  printResults(results);
  return 0;
}

}  // namespace medulla
