#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/files/report_file.h"
#include "app/files/state_cache.h"
#include "app/simulation.h"
#include "render/stage_times.h"

// What the verbs that run a scene share: that scene with its options, run to its end with log and surface files.
namespace medulla {

struct SurfaceRequest {
  std::optional<double> time;  // s; none: the end
  std::string path;
};

// Of a word "[NAME=]FILE" on the command line.
struct NamedFile {
  std::string name, path;  // no name: of the only tool or body
};
// The name of the one that is meant of `names`, which are of the scene's tools or bodies, as `kind` says. Throws
// std::runtime_error "OPTION WORD: ..." where there is none, or more than one and no name.
std::string meantName(const std::string& option, const NamedFile& file, const std::vector<std::string>& names,
                      const std::string& kind);

struct RunOptions {
  std::string scene;
  std::vector<SceneOverride> overrides;
  std::map<std::string, std::string> trajectories;  // tool name (empty: the only tool) -> file to read
  std::map<std::string, std::string> records;       // the same -> file for the motion and the force of its ticks
  std::string logPath;
  bool logEveryTick = false;
  std::string frameTimesPath;  // what each dynamics frame took, apart from the log, which is the same in every run
  std::vector<SurfaceRequest> surfaces;
  std::string cacheToWrite;  // what every picture shows, for `render --cache`; empty: none
  EmbreeSettings embree;
  bool realtime = false;   // replay only: the servo runs against the clock
  bool untilRest = false;  // ends when nothing moves any more; the scene's duration is the longest it may take
  bool isExcerpt = false;  // of the scene: that motions go on after its end is meant
};

// The state at a time, once a run has passed it.
struct RecordedFrame {
  double time = 0;  // s
  DynamicsFrame frame;
};

// Fills in those moments that the last dynamics frame has reached; all that are still open after the `last` one.
void recordFrames(const Simulation& simulation, bool last, std::vector<RecordedFrame>& moments);

// The pictures of a run in order, each once the simulation has passed its time.
class PictureTimes {
 public:
  PictureTimes(std::vector<double> times, int firstNumber) : times_(std::move(times)), firstNumber_(firstNumber) {}
  // Calls `each` with the picture's number and its state (reused) for those that the last dynamics frame has reached.
  void afterFrame(const Simulation& simulation, const std::function<void(int, const PictureState&)>& each);

 private:
  std::vector<double> times_;  // s, increasing
  int firstNumber_;
  std::size_t next_ = 0;
  PictureState state_;
};

// Pictures [first, last) of a scene at its own rate.
std::vector<double> pictureTimes(const Scene& scene, int first, int last);

// What tells one run from another: everything that its motion follows from, this program's version and the sources of
// its physics included; or everything that its pictures do, but for options of the drawing.
std::uint64_t motionHash(const LoadedScene& loaded);
std::uint64_t pictureHash(const LoadedScene& loaded);

// Of a cache of this run.
CacheLayout cacheLayout(const LoadedScene& loaded);

// The files of `option`, with every tool named, and known.
std::map<std::string, std::string> filesOfTools(const std::string& option, const Scene& scene,
                                                const std::map<std::string, std::string>& files);

LoadedScene loadRun(const RunOptions& options);

// What a run calls besides its own; empty ones are none.
struct RunHooks {
  std::function<void()> advance;     // makes the next dynamics frame; empty: in logical time
  std::function<void()> afterFrame;  // after every one
  std::function<void()> ended;       // after the last
  // When records, log and surfaces are written, before they appear under their names: what fails here leaves those as
  // they were, and a disk that is full for them keeps this from being called.
  std::function<void()> finish;
  std::function<void()> commit;  // when all have been written and nothing but renaming is left
};

// Runs the simulation to its end. Until rest: as RestWatch finds it; surfaces asked for at a later time are those at
// rest. Returns results of their own: how the force of tools whose trajectory has a measured one compares with that.
// Throws NotAtRest, and Interrupted after a signal.
std::vector<Result> runToEnd(const LoadedScene& loaded, const RunOptions& options, Simulation& simulation,
                             const RunHooks& hooks);

// Every file that a run of the scene reads; some may be missing.
std::vector<std::string> inputFiles(const Scene& scene);
// Every file that the run writes, but for pictures.
std::vector<std::string> outputFiles(const RunOptions& options);

// Every file that the run writes besides `pictures` must differ from the others and from what it reads.
void requireDistinctOutputs(const LoadedScene& loaded, const RunOptions& options,
                            const std::vector<std::string>& pictures = {});

// The results of a run, in the order in which they are shown.
std::vector<Result> runResults(const Simulation& simulation, double cpuSeconds, double wallSeconds);

// "name value [unit]" lines on standard output.
void printResults(const std::vector<Result>& results);

}  // namespace medulla
