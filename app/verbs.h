#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "app/commands/run.h"

// What the verbs of the command line share.
namespace medulla {

// A verb with what it does once its words are parsed: options that contradict each other are usage errors, too.
struct Verb {
  CLI::App* command;
  std::function<int()> run;
};

[[noreturn]] void usageError(const std::string& option, const std::string& value, const std::string& expected);

// From "[NAME=]FILE". A usage error where either is missing beside the =.
NamedFile namedFile(const std::string& option, const std::string& word);

// A usage error where the file that an option is to write has the ending of another kind: what stands under that name
// would be lost by mistake. Endings of no known kind pass for a file that does not exist yet.
void refuseOtherKinds(const std::string& option, const std::string& path, const std::string& ending);

inline constexpr double kEndless = std::numeric_limits<double>::infinity();
// Checks an option's words, each of them. CLI::Range lets NaN pass. `what`: how errors begin to say what is expected.
CLI::Validator numberFrom(double low, double high, const std::string& what = "a number");
CLI::Validator wholeNumberFrom(int low, int high);  // for transform()

// Options as typed; turned into RunOptions after parsing.
struct RunArguments {
  std::string scene, log, logRate = "frame", embree, frameTimes;
  std::vector<std::string> sets, trajectories, records;
  std::vector<std::vector<std::string>> surfaces;
};
void addOverrides(CLI::App& command, RunArguments& a);     // --set, --trajectory
void addSceneOptions(CLI::App& command, RunArguments& a);  // SCENE and these
RunOptions runOptions(const RunArguments& a);
void addContext(CLI::App& command, std::string& context);

// running_verbs.cpp
Verb addRender(CLI::App& app);
Verb addReplay(CLI::App& app);
Verb addCheck(CLI::App& app);
Verb addInfo(CLI::App& app);

// model_verbs.cpp
Verb addBuild(CLI::App& app);
Verb addNew(CLI::App& app);

// measuring_verbs.cpp
Verb addGolden(CLI::App& app);
Verb addCompare(CLI::App& app);
Verb addPlot(CLI::App& app);
Verb addChart(CLI::App& app);
Verb addStability(CLI::App& app);

}  // namespace medulla
