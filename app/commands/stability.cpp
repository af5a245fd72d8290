#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "app/commands/commands.h"
#include "app/files/gnuplot.h"
#include "app/files/output_file.h"
#include "app/files/stability_file.h"
#include "app/progress.h"
#include "app/torture.h"

namespace medulla {

namespace {

namespace fs = std::filesystem;

constexpr const char* kMapTrial = "stiffness_1";  // stretched by half and let go

BodyDescription bodyOf(const LoadedScene& loaded) {
  const SceneBody& b = loaded.scene.bodies.at(0);
  BodyDescription out;
  out.name = b.name;
  out.model = loaded.models.at(0);
  out.tissue = b.tissue;
  out.factors = b.factors;
  out.surface = b.surface;
  out.links = b.links;
  out.fixed = b.fixed;
  out.fixedNodes = b.fixedNodes;
  return out;
}

StabilityPoint tryOne(const BodyDescription& body, const TortureMethod& method, const std::string& trial, double step) {
  const TortureOutcome outcome = torture(body, method, trial, step);
  StabilityPoint out;
  out.method = method.name;
  out.trial = trial;
  out.step = step;
  out.young = body.tissue.young;
  out.survived = outcome.survived;
  out.recoveredAt = outcome.recoveredAt;
  out.energyRatio = outcome.largestEnergy / outcome.startEnergy;
  return out;
}

std::vector<Result> resultsOf(const std::vector<StabilityPoint>& map, const std::vector<StabilityPoint>& trials) {
  std::vector<Result> out;
  for (const TortureMethod& method : tortureMethods()) {
    const auto count = [&](const std::vector<StabilityPoint>& points, const char* what, const auto& counts) {
      const auto ofMethod = [&](const StabilityPoint& p) { return p.method == method.name; };
      const auto all = std::count_if(points.begin(), points.end(), ofMethod);
      const auto good = std::count_if(points.begin(), points.end(),
                                      [&](const StabilityPoint& p) { return ofMethod(p) && counts(p); });
      out.push_back({fmt::format("{}.{}", method.name, what), fmt::format("{}/{}", good, all), ""});
    };
    const auto survived = [](const StabilityPoint& p) { return p.survived; };
    const auto recovered = [](const StabilityPoint& p) { return p.recoveredAt.has_value(); };
    count(map, "map_survived", survived);
    count(map, "map_recovered", recovered);
    count(trials, "trials_survived", survived);
    count(trials, "trials_recovered", recovered);
  }
  return out;
}

}  // namespace

int runStability(const StabilityOptions& options) {
  const LoadedScene loaded = loadRun(options.run);
  const BodyDescription body = bodyOf(loaded);
  const fs::path folder = options.folder;
  const std::string script = (folder / "stability.gnuplot").string();
  std::error_code error;
  const bool made = fs::create_directories(folder, error);
  if (error) throw std::runtime_error(fmt::format("{}: cannot be made: {}", options.folder, error.message()));
  try {
    const auto& methods = tortureMethods();
    const std::vector<std::string> trials = tortureTrials();
    const std::size_t count =
        methods.size() * (options.young.size() * options.steps.size() + trials.size() * options.trialSteps.size());
    Progress progress("stability", static_cast<double>(count), "trials");
    double done = 0;
    std::vector<StabilityPoint> map, tortured;
    std::vector<StableStep> limit;
    for (const double young : options.young) {
      BodyDescription other = body;
      other.tissue.young = young;
      limit.push_back({young, explicitLimit(other)});
      for (const TortureMethod& method : methods) {
        for (const double step : options.steps) {
          map.push_back(tryOne(other, method, kMapTrial, step));
          map.back().trial.clear();
          progress.update(++done);
        }
      }
    }
    for (const TortureMethod& method : methods) {
      for (const std::string& trial : trials) {
        for (const double step : options.trialSteps) {
          tortured.push_back(tryOne(body, method, trial, step));
          progress.update(++done);
        }
      }
    }
    writeStability((folder / "map.csv").string(), map);
    writeStability((folder / "trials.csv").string(), tortured);
    const std::string text = stabilityScript(loaded.scene.name, map, tortured, limit);
    writeText(script, text);
    if (const std::optional<std::string> svg = runGnuplot(text)) {
      writeText((folder / "stability.svg").string(), *svg);
    } else {
      fmt::print(stderr, "no stability.svg: gnuplot is not installed (Debian package gnuplot-nox); then: gnuplot {}\n",
                 script);
    }
    printResults(resultsOf(map, tortured));
  } catch (...) {
    if (made) fs::remove(folder, error);  // if it is empty again
    throw;
  }
  return 0;
}

}  // namespace medulla
