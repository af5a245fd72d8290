#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <mutex>
#include <optional>
#include <thread>

#include "app/commands/commands.h"
#include "app/files/gnuplot.h"
#include "app/files/output_file.h"
#include "app/files/stability_file.h"
#include "app/files/text.h"
#include "app/files/text_file.h"
#include "app/files/trial_journal.h"
#include "app/interrupt.h"
#include "app/progress.h"
#include "app/standard_streams.h"
#include "app/torture.h"
#include "render/output_folder.h"

namespace medulla {

namespace {

namespace fs = std::filesystem;

constexpr const char* kMapTrial = "stiffness_1";  // stretched by half and let go

// A trial and, once it is known, how it ended.
struct PlannedTrial {
  BodyDescription body;
  TortureMethod method;
  std::string trial;
  double steps = 0;  // at most
  StabilityPoint point;
};

std::vector<TortureMethod> methodsOf(const StabilityOptions& options) {
  std::vector<TortureMethod> out;
  for (const TortureMethod& method : tortureMethods())
    if (isOneOf(method.name, options.methods)) out.push_back(method);
  return out;
}

// Adds a trial by every method at every step; `name` is what tables call it.
void planTrials(const BodyDescription& body, const std::string& trial, const std::string& name,
                const std::vector<TortureMethod>& methods, const std::vector<double>& steps,
                std::vector<PlannedTrial>& plan) {
  std::vector<double> counts;
  counts.reserve(steps.size());
  for (const double step : steps) counts.push_back(tortureSteps(body, trial, step));
  for (const TortureMethod& method : methods) {
    for (std::size_t k = 0; k < steps.size(); ++k) {
      PlannedTrial p{body, method, trial, counts[k], {}};
      p.point.method = method.name;
      p.point.trial = name;
      p.point.step = steps[k];
      p.point.young = body.tissue.young;
      plan.push_back(std::move(p));
    }
  }
}

// Trials that nobody has run yet, side by side: whoever is free takes the next.
class TrialRunner {
 public:
  TrialRunner(std::vector<PlannedTrial>& plan, TrialJournal& journal) : plan_(plan), journal_(journal) {
    double steps = 0;
    for (const PlannedTrial& p : plan) steps += p.steps;
    progress_.emplace("stability", steps, "steps");
  }

  // Throws what a trial throws, once all others have ended or been interrupted.
  void run(int threads) {
    {
      std::vector<std::jthread> others;
      for (int k = 1; k < threads; ++k) others.emplace_back([this] { work(); });
      work();
    }
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  void work() {
    try {
      while (PlannedTrial* p = next()) finish(*p);
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!failure_) failure_ = std::current_exception();
    }
  }

  PlannedTrial* next() {
    const std::lock_guard lock(mutex_);
    for (; taken_ < plan_.size() && !failure_; done_ += plan_[taken_++].steps)
      if (!journal_.find(plan_[taken_].point)) return &plan_[taken_++];
    return nullptr;
  }

  void finish(PlannedTrial& p) {
    double steps = 0;
    const TortureOutcome outcome = torture(p.body, p.method, p.trial, p.point.step, [&] {
      const std::lock_guard lock(mutex_);
      steps += 1;
      progress_->update(done_ += 1);
    });
    p.point.survived = outcome.survived;
    p.point.recoveredAt = outcome.recoveredAt;
    // Equal where both are 0, too, as nothing that could move is free.
    p.point.energyRatio =
        outcome.largestEnergy == outcome.startEnergy ? 1 : outcome.largestEnergy / outcome.startEnergy;
    const std::lock_guard lock(mutex_);
    journal_.add(p.point);
    done_ += p.steps - steps;
  }

  std::vector<PlannedTrial>& plan_;
  TrialJournal& journal_;
  std::mutex mutex_;  // of all below, and of the journal
  std::optional<Progress> progress_;
  std::size_t taken_ = 0;
  double done_ = 0;  // steps, of ended trials as many as they might have taken
  std::exception_ptr failure_;
};

std::vector<Result> resultsOf(const std::vector<TortureMethod>& methods, const std::vector<StabilityPoint>& map,
                              const std::vector<StabilityPoint>& trials) {
  std::vector<Result> out;
  for (const TortureMethod& method : methods) {
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

// The trials' outcomes, of those of the map and of the others.
struct StabilityTables {
  std::vector<StabilityPoint> map, trials;
  std::vector<StableStep> limit;
};

StabilityTables runTrials(const StabilityOptions& options, const BodyDescription& body,
                          const std::vector<TortureMethod>& methods, TrialJournal& journal) {
  StabilityTables out;
  std::vector<PlannedTrial> plan;
  for (const double young : options.young) {
    BodyDescription other = body;
    other.tissue.young = young;
    planTrials(other, kMapTrial, "", methods, options.steps, plan);
    out.limit.push_back({young, tortureLimit(other)});
  }
  for (const std::string& trial : tortureTrials()) planTrials(body, trial, trial, methods, options.trialSteps, plan);
  try {
    TrialRunner(plan, journal).run(options.threads);
  } catch (const Interrupted&) {
    if (journal.size() > 0)
      tell("stability: {} of {} trials are kept in {}; the same command goes on from there\n", journal.size(),
           plan.size(), journal.path());
    throw;
  }
  for (const PlannedTrial& p : plan) (p.point.trial.empty() ? out.map : out.trials).push_back(p.point);
  return out;
}

// Rows of an earlier call may be of another scene: none is taken along.
void noteReplaced(const std::string& table, const std::vector<TortureMethod>& methods) {
  if (!fileExists(table)) return;
  const std::string text = readTextFile(table);
  std::vector<std::string> gone;
  for (const TortureMethod& known : tortureMethods()) {
    const auto isKnown = [&](const TortureMethod& method) { return method.name == known.name; };
    if (std::none_of(methods.begin(), methods.end(), isKnown) &&
        text.find("\n" + known.name + ",") != std::string::npos)
      gone.push_back(known.name);
  }
  if (!gone.empty())
    tell("note: {} holds trials of {}, which those of this call will replace\n", table, joined(gone, ", "));
}

void writeTables(const fs::path& folder, const std::string& title, const StabilityTables& tables) {
  writeStability((folder / "map.csv").string(), tables.map);
  writeStability((folder / "trials.csv").string(), tables.trials);
  drawByGnuplot((folder / "stability").string(), stabilityScript(title, tables.map, tables.trials, tables.limit));
}

}  // namespace

int runStability(const StabilityOptions& options) {
  const LoadedScene loaded = loadRun(options.run);
  const BodyDescription& body = loaded.scene.bodies[0];
  const std::vector<TortureMethod> methods = methodsOf(options);
  const fs::path folder = options.folder;
  const OutputFolder made(options.folder);
  const std::string kept = (folder / "trials.part").string();
  std::vector<std::string> outputs;
  for (const char* name : {"map.csv", "trials.csv", "stability.gnuplot", "stability.svg"})
    outputs.push_back((folder / name).string());
  requireWritable(outputs);
  outputs.push_back(kept);
  requireDistinctOutputs(loaded, options.run, outputs);
  noteReplaced((folder / "trials.csv").string(), methods);
  TrialJournal journal(kept, motionHash(loaded));
  const StabilityTables tables = runTrials(options, body, methods, journal);
  writeTables(folder, loaded.scene.name, tables);
  printResults(resultsOf(methods, tables.map, tables.trials));
  journal.forget(tables.map);
  journal.forget(tables.trials);
  return 0;
}

}  // namespace medulla
