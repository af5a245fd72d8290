#include <fmt/format.h>

#include <chrono>

#include "app/commands/commands.h"
#include "app/progress.h"

namespace medulla {

int runReplay(const RunOptions& options) {
  const LoadedScene loaded = loadRun(options);
  requireDistinctOutputs(loaded, options);
  Simulation simulation(loaded);
  Progress progress("replay", loaded.scene.duration, "s");
  const double cpuStart = processCpuSeconds();
  const auto start = std::chrono::steady_clock::now();
  const std::vector<Result> forces = runToEnd(loaded, options, simulation, [&] { progress.update(simulation.time()); });
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::vector<Result> results = runResults(simulation, processCpuSeconds() - cpuStart, wall);
  if (options.untilRest) results.insert(results.begin(), {"rest_at", fmt::format("{:.6g}", simulation.time()), "s"});
  results.insert(results.end(), forces.begin(), forces.end());
  printResults(results);
  return 0;
}

}  // namespace medulla
