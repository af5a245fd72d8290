#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <tuple>
#include <utility>

#include "app/commands/commands.h"
#include "app/files/content_hash.h"
#include "app/files/input_error.h"
#include "app/files/output_file.h"
#include "app/force_view.h"
#include "app/interrupt.h"
#include "app/picture_outputs.h"
#include "app/progress.h"

namespace medulla {

namespace {

void applyOverrides(const RenderOptions& options, Scene& scene) {
  if (options.size) {
    std::tie(scene.width, scene.height) = *options.size;
    const auto valid = [](int n) { return n >= 16 && n <= 8192 && n % 2 == 0; };
    if (!valid(scene.width) || !valid(scene.height))
      throw std::runtime_error(fmt::format(
          "--size {}x{}: expected even numbers from 16 to 8192 (video needs them even)", scene.width, scene.height));
  }
  if (options.fps) scene.fps = *options.fps;
}

// The pictures to draw: those of a range, numbered from its first, or one at a time of its own.
struct Wanted {
  std::vector<double> times;  // s, increasing
  int first = 0;
  int last() const { return first + static_cast<int>(times.size()); }
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

// Draws states and hands the pictures on.
class Artist {
 public:
  Artist(const LoadedScene& loaded, const RenderOptions& options, const Wanted& wanted, const DynamicsFrame& rest,
         StageTimes& times)
      : options_(&options),
        times_(&times),
        renderer_(rendererSettings(loaded.scene.width, loaded.scene.height, options.context, options.quality)),
        view_(loaded, rest, renderer_),
        outputs_(options.outputs, outputSettings(loaded, options, wanted, renderer_.description())),
        progress_("render", static_cast<double>(wanted.times.size()), "pictures") {}

  void draw(int number, const PictureState& state, ForceView* forces) {
    if (!outputs_.has(number)) {
      times_->start("compose");
      view_.compose(state, options_->view, picture_);
      if (forces != nullptr) forces->compose(state, picture_);
      renderer_.render(picture_, image_, times_);
      times_->start("hand over");
      outputs_.write(number, image_);
      ++drawn_;
    }
    progress_.update(++done_);
    times_->stop();
  }
  void finish() {
    times_->start("end files");
    outputs_.finish();
    times_->stop();
  }
  int drawn() const { return drawn_; }

 private:
  static PictureOutputs::Settings outputSettings(const LoadedScene& loaded, const RenderOptions& options,
                                                 const Wanted& wanted, const std::string& renderer) {
    const Scene& scene = loaded.scene;
    const std::string drawing = fmt::format("{}x{} {} {} {} {} {} {}", scene.width, scene.height, scene.fps,
                                            static_cast<int>(options.view.view), options.view.showProxy,
                                            options.view.showForce, static_cast<int>(options.quality), renderer);
    const std::uint64_t run = contentHash(drawing, runHash(loaded, true));
    return {scene.width,
            scene.height,
            scene.fps,
            options.still.has_value(),
            {wanted.first, wanted.last(), run, options.resume}};
  }

  const RenderOptions* options_;
  StageTimes* times_;
  Renderer renderer_;
  SceneView view_;
  PictureOutputs outputs_;
  Progress progress_;
  Picture picture_;
  Image image_;
  int drawn_ = 0, done_ = 0;
};

// Wall time goes on while stages overlap with the encoder; CPU is that of all threads then.
void printTimings(const StageTimes& times, int pictures) {
  fmt::print(stderr, "{:<12}{:>12}{:>12}{:>18}{:>18}\n", "stage", "wall [s]", "cpu [s]", "wall [ms/picture]",
             "cpu [ms/picture]");
  StageTimes::Stage sum{"sum", 0, 0};
  const auto print = [pictures](const StageTimes::Stage& s) {
    const double each = 1e3 / std::max(pictures, 1);
    fmt::print(stderr, "{:<12}{:>12.3f}{:>12.3f}{:>18.2f}{:>18.2f}\n", s.name, s.wall, s.cpu, each * s.wall,
               each * s.cpu);
  };
  for (const StageTimes::Stage& s : times.stages()) {
    print(s);
    sum.wall += s.wall;
    sum.cpu += s.cpu;
  }
  print(sum);
}

void printFiles(const RenderOptions& options, const Artist& artist, double wall) {
  for (const std::string& path : options.outputs)
    fmt::print("file {}\n", std::filesystem::absolute(path).lexically_normal().string());
  fmt::print("pictures {}\n", artist.drawn());
  fmt::print("pictures_per_second {:.4g}\n", artist.drawn() / wall);
}

// Of the cached run, the pictures that were asked for.
std::vector<int> cachedNumbers(const CacheReader& cache, const Wanted& wanted, const RenderOptions& options) {
  std::vector<int> numbers;
  for (const double time : wanted.times) {
    const double number = time * cache.layout().fps;
    if (std::abs(number - std::round(number)) > 1e-6)
      throw inputError(options.cachePath, 0,
                       fmt::format("holds pictures every 1/{:g} s, none at {:g} s", cache.layout().fps, time));
    numbers.push_back(static_cast<int>(std::lround(number)));
    if (numbers.back() >= cache.pictures())
      throw inputError(options.cachePath, 0,
                       fmt::format("holds pictures 0 to {}, not picture {}", cache.pictures() - 1, numbers.back()));
  }
  return numbers;
}

void requireOwnCache(const CacheReader& cache, const LoadedScene& loaded, const RenderOptions& options) {
  const CacheLayout expected = cacheLayout(loaded);
  const CacheLayout& found = cache.layout();
  if (found.motionHash != expected.motionHash || found.bodies != expected.bodies || found.tools != expected.tools)
    throw inputError(
        options.cachePath, 0,
        fmt::format("is of another scene or stale: {}, a file that it names, an override or the program has "
                    "changed; write it anew with medulla replay --cache",
                    loaded.scene.path));
  if (found.fps != expected.fps)
    throw inputError(options.cachePath, 0,
                     fmt::format("holds {:g} pictures per second, expected {:g}", found.fps, expected.fps));
}

void renderCache(const LoadedScene& loaded, const RenderOptions& options, const Wanted& wanted, StageTimes& times) {
  CacheReader cache(options.cachePath);
  requireOwnCache(cache, loaded, options);
  const std::vector<int> numbers = cachedNumbers(cache, wanted, options);
  PictureState state;
  cache.read(0, state);  // the first picture is the scene at rest
  Artist artist(loaded, options, wanted, state.frame, times);
  const double start = wallSeconds();
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    checkInterrupt();
    times.start("read cache");
    cache.read(numbers[k], state);
    artist.draw(wanted.first + static_cast<int>(k), state, nullptr);
  }
  artist.finish();
  printFiles(options, artist, wallSeconds() - start);
  fmt::print("hash {:016x}\n", cache.finalHash());
}

void renderRun(const LoadedScene& loaded, const RenderOptions& options, const Wanted& wanted, StageTimes& times) {
  Simulation simulation(loaded, options.run.embree);
  Artist artist(loaded, options, wanted, simulation.current(), times);
  ForceView forceView(loaded);
  PictureTimes pictures(wanted.times, wanted.first);
  const double cpuStart = processCpuSeconds();
  const double start = wallSeconds();
  times.start("simulate");
  const auto afterFrame = [&] {
    if (options.view.showForce) forceView.afterFrame(simulation);
    pictures.afterFrame(simulation, [&](int number, const PictureState& state) {
      artist.draw(number, state, options.view.showForce ? &forceView : nullptr);
    });
    times.start("simulate");
  };
  const std::vector<Result> forces = runToEnd(loaded, options.run, simulation, afterFrame, [&] { artist.finish(); });
  const double wall = wallSeconds() - start;
  printFiles(options, artist, wall);
  printResults(runResults(simulation, processCpuSeconds() - cpuStart, wall));
  printResults(forces);
}

}  // namespace

int runRender(const RenderOptions& options) {
  StageTimes times;
  times.start("start");
  LoadedScene loaded = loadRun(options.run);
  applyOverrides(options, loaded.scene);
  const Wanted wanted = wantedOf(options, loaded.scene);
  requireDistinctOutputs(loaded, options.run, options.outputs);
  requireDistinctFiles(options.outputs, {options.cachePath});
  if (options.still) loaded.scene.duration = *options.still;  // nothing later is asked for
  if (options.cachePath.empty())
    renderRun(loaded, options, wanted, times);
  else
    renderCache(loaded, options, wanted, times);
  if (options.timings) printTimings(times, static_cast<int>(wanted.times.size()));
  return 0;
}

}  // namespace medulla
