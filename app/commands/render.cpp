#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <tuple>
#include <utility>

#include "app/commands/artist.h"
#include "app/files/input_error.h"
#include "app/files/output_file.h"
#include "app/interrupt.h"
#include "app/standard_streams.h"
#include "render/video_writer.h"

namespace medulla {

namespace {

void applyPictureOptions(const RenderOptions& options, Scene& scene) {
  if (options.size) {
    std::tie(scene.width, scene.height) = *options.size;
    const bool video = !options.still && std::any_of(options.outputs.begin(), options.outputs.end(), isVideoName);
    const auto valid = [video](int n) {
      return n >= kPictureSideMin && n <= kPictureSideMax && !(video && n % 2 != 0);
    };
    if (!valid(scene.width) || !valid(scene.height))
      throw std::runtime_error(fmt::format("--size {}x{}: expected {}numbers from {} to {}{}", scene.width,
                                           scene.height, video ? "even " : "", kPictureSideMin, kPictureSideMax,
                                           video ? ", for a video" : ""));
  }
  if (options.fps) scene.fps = *options.fps;
}

// The pictures to draw: those of a range, numbered from its first, or one at a time of its own.
struct Wanted {
  std::vector<double> times;  // s, increasing
  int first = 0;
  int count() const { return static_cast<int>(times.size()); }
};

Wanted wantedOf(const RenderOptions& options, const Scene& scene) {
  if (options.still) {
    if (*options.still > scene.duration)
      throw std::runtime_error(fmt::format("--still {}: expected a time from 0 to {} s, the scene's duration",
                                           *options.still, scene.duration));
    return {{*options.still}, 0};
  }
  const int count = pictureCount(scene);
  const auto [first, last] = options.frames.value_or(std::make_pair(0, count));
  if (first < 0 || first >= last || last > count)
    throw std::runtime_error(
        fmt::format("--frames {}:{}: expected 0 <= A < B <= {}, the scene's number of pictures", first, last, count));
  return {pictureTimes(scene, first, last), first};
}

// Of one scene: the process may have rendered others before.
struct Timings {
  StageTimes stages;                       // of the thread that simulates
  double cpuBefore = processCpuSeconds();  // s
};

// Simulation, drawing, OpenGL's threads and encoding overlap: their times add up to more than the run takes by the
// clock.
void printTimings(const Timings& run, const Artist& artist, int pictures) {
  std::vector<StageTimes::Stage> rows = run.stages.stages();
  rows.insert(rows.end(), artist.times().stages().begin(), artist.times().stages().end());
  rows.push_back(artist.encoding());
  // What is left of the process are the threads of OpenGL, which say nothing of themselves.
  double known = 0;
  for (const StageTimes::Stage& s : rows) known += s.cpu;
  rows.push_back({"raster", 0, processCpuSeconds() - run.cpuBefore - known});
  StageTimes::Stage sum{"sum", 0, 0};
  for (const StageTimes::Stage& s : rows) {
    sum.wall += s.wall;
    sum.cpu += s.cpu;
  }
  rows.push_back(sum);
  tell("{:<14}{:>12}{:>12}{:>18}{:>18}\n", "stage", "wall [s]", "cpu [s]", "wall [ms/picture]", "cpu [ms/picture]");
  const double each = 1e3 / std::max(pictures, 1);
  for (const StageTimes::Stage& s : rows)
    tell("{:<14}{:>12.3f}{:>12.3f}{:>18.2f}{:>18.2f}\n", s.name, s.wall, s.cpu, each * s.wall, each * s.cpu);
}

void printFiles(const RenderOptions& options, const Artist& artist, double wall) {
  for (const std::string& path : options.outputs)
    fmt::print("file {}\n", normalised(std::filesystem::absolute(path)).string());
  fmt::print("pictures {}\n", artist.drawn());
  fmt::print("pictures_per_second {:.4g}\n", artist.drawn() / wall);
}

// Of the cached run, the pictures that were asked for.
std::vector<int> cachedNumbers(const CacheReader& cache, const Wanted& wanted, const RenderOptions& options) {
  std::vector<int> numbers;
  for (const double time : wanted.times) {
    const double number = time * cache.layout().fps;
    if (std::abs(number - std::round(number)) > 1e-6)
      throw inputError(options.cacheToRead, 0,
                       fmt::format("holds pictures every 1/{:g} s, none at {:g} s: the one before it is at {:.6g} s",
                                   cache.layout().fps, time, std::floor(number) / cache.layout().fps));
    numbers.push_back(static_cast<int>(std::lround(number)));
    if (numbers.back() >= cache.pictures())
      throw inputError(options.cacheToRead, 0,
                       fmt::format("holds pictures 0 to {}, up to {:.6g} s, not picture {}", cache.pictures() - 1,
                                   (cache.pictures() - 1) / cache.layout().fps, numbers.back()));
  }
  return numbers;
}

void requireOwnCache(const CacheReader& cache, const LoadedScene& loaded, const RenderOptions& options) {
  const CacheLayout expected = cacheLayout(loaded);
  const CacheLayout& found = cache.layout();
  if (found.motionHash != expected.motionHash || found.bodies != expected.bodies || found.tools != expected.tools)
    throw inputError(
        options.cacheToRead, 0,
        fmt::format("is of another scene or stale: {}, a file that it names, an override or the program has "
                    "changed; write it anew with medulla replay --cache",
                    loaded.scene.path));
  if (found.fps != expected.fps)
    throw inputError(options.cacheToRead, 0,
                     fmt::format("holds {:g} pictures per second, expected {:g}", found.fps, expected.fps));
}

void renderCache(const LoadedScene& loaded, const RenderOptions& options, const Wanted& wanted, Timings& timings) {
  StageTimes& times = timings.stages;
  CacheReader cache(options.cacheToRead);
  requireOwnCache(cache, loaded, options);
  const std::vector<int> numbers = cachedNumbers(cache, wanted, options);
  PictureState state;
  cache.read(0, state);  // the first picture is the scene at rest
  const DynamicsFrame rest = state.frame;
  Artist artist(loaded, options, wanted.first, wanted.count(), rest);
  const double start = wallSeconds();
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    checkInterrupt();
    times.start("read cache");
    cache.read(numbers[k], state);
    artist.draw(wanted.first + static_cast<int>(k), state, nullptr, times);
  }
  times.start("wait");
  artist.finish();
  artist.commit();
  times.stop();
  if (options.timings) printTimings(timings, artist, wanted.count());
  printFiles(options, artist, wallSeconds() - start);
  fmt::print("hash {:016x}\n", cache.finalHash());
}

void renderRun(const LoadedScene& loaded, const RenderOptions& options, const Wanted& wanted, Timings& timings) {
  StageTimes& times = timings.stages;
  Simulation simulation(loaded, options.run.embree);
  Artist artist(loaded, options, wanted.first, wanted.count(), simulation.current());
  ForceView forceView(loaded);
  PictureTimes pictures(wanted.times, wanted.first);
  const double cpuStart = processCpuSeconds();
  const double start = wallSeconds();
  times.start("simulate");
  RunHooks hooks;
  hooks.afterFrame = [&] {
    if (options.view.shown.force) forceView.afterFrame(simulation);
    pictures.afterFrame(simulation, [&](int number, const PictureState& state) {
      artist.draw(number, state, options.view.shown.force ? &forceView : nullptr, times);
    });
    times.start("simulate");
  };
  hooks.finish = [&] {
    times.start("wait");
    artist.finish();
    times.stop();
  };
  hooks.commit = [&] { artist.commit(); };
  const std::vector<Result> forces = runToEnd(loaded, options.run, simulation, hooks);
  const double wall = wallSeconds() - start;
  if (options.timings) printTimings(timings, artist, wanted.count());
  printFiles(options, artist, wall);
  printResults(runResults(simulation, processCpuSeconds() - cpuStart, wall));
  printResults(forces);
}

}  // namespace

int runRender(const RenderOptions& options) {
  Timings timings;
  timings.stages.start("start");
  LoadedScene loaded = loadRun(options.run);
  applyPictureOptions(options, loaded.scene);
  const Wanted wanted = wantedOf(options, loaded.scene);
  requireDistinctOutputs(loaded, options.run, options.outputs);
  requireDistinctFiles(options.outputs, {options.cacheToRead});
  if (options.still) loaded.scene.duration = *options.still;  // nothing later is asked for
  if (options.cacheToRead.empty())
    renderRun(loaded, options, wanted, timings);
  else
    renderCache(loaded, options, wanted, timings);
  return 0;
}

}  // namespace medulla
