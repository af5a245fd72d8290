#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>

#include "app/commands/commands.h"
#include "app/progress.h"
#include "render/video_writer.h"

namespace medulla {

namespace {

namespace fs = std::filesystem;

bool isVideo(const std::string& path) {
  return fs::path(path).extension() == ".mp4";
}

std::string withoutSlash(std::string path) {
  while (path.size() > 1 && path.back() == '/') path.pop_back();
  return path;
}

// A folder of numbered PNG files. They collect in a folder of their own beside it and move in when all are there: a run
// that ends early harms no earlier picture.
class PngFolder {
 public:
  explicit PngFolder(const std::string& path)
      : folder_(path), collecting_(fmt::format("{}.{}.part", withoutSlash(path), getpid())) {
    std::error_code error;
    fs::create_directories(folder_, error);
    if (!error) fs::create_directory(collecting_, error);
    if (error) throw std::runtime_error(fmt::format("{}: cannot make the folder: {}", path, error.message()));
  }
  ~PngFolder() {
    std::error_code ignored;
    fs::remove_all(collecting_, ignored);
    fs::remove(folder_, ignored);  // only if nothing came into it
  }
  PngFolder(const PngFolder&) = delete;
  PngFolder& operator=(const PngFolder&) = delete;
  void write(int number, const Image& image) const {
    writePng((collecting_ / fmt::format("{:05d}.png", number)).string(), image);
  }
  void finish() const {
    for (const auto& entry : fs::directory_iterator(collecting_))
      fs::rename(entry.path(), folder_ / entry.path().filename());
  }

 private:
  fs::path folder_, collecting_;
};

// Where pictures go: any number of videos and folders of numbered PNG files.
class PictureOutputs {
 public:
  PictureOutputs(const std::vector<std::string>& paths, int width, int height, double fps) {
    for (const std::string& path : paths) {
      if (isVideo(path)) {
        videos_.emplace_back(path, width, height, fps);
        continue;
      }
      if (!fs::path(path).extension().empty() && !fs::is_directory(path))
        throw std::runtime_error(fmt::format("{}: expected FILE.mp4 or a folder for PNG files", path));
      folders_.push_back(std::make_unique<PngFolder>(path));
    }
  }
  void write(int number, const Image& image) {
    for (VideoWriter& video : videos_) video.write(image);
    for (const auto& folder : folders_) folder->write(number, image);
  }
  void finish() {
    for (VideoWriter& video : videos_) video.finish();
    for (const auto& folder : folders_) folder->finish();
  }

 private:
  std::vector<VideoWriter> videos_;
  std::vector<std::unique_ptr<PngFolder>> folders_;
};

void applyOverrides(const RenderOptions& options, Scene& scene) {
  if (options.size) std::tie(scene.width, scene.height) = *options.size;
  if (options.fps) scene.fps = *options.fps;
}

std::pair<int, int> frameRange(const RenderOptions& options, const Scene& scene) {
  const int count = static_cast<int>(std::ceil(scene.duration * scene.fps - 1e-9));
  if (!options.frames) return {0, count};
  const auto [first, last] = *options.frames;
  if (first < 0 || first >= last || last > count)
    throw std::runtime_error(
        fmt::format("--frames {}:{}: expected 0 <= A < B <= {}, the scene's number of pictures", first, last, count));
  return *options.frames;
}

}  // namespace

int runRender(const RenderOptions& options) {
  LoadedScene loaded = loadRun(options.run);
  applyOverrides(options, loaded.scene);
  const Scene& scene = loaded.scene;
  const std::pair<int, int> range = frameRange(options, scene);
  const int first = range.first, last = range.second;  // the lambda below: clang 14 captures no structured bindings

  requireDistinctOutputs(loaded, options.run, options.outputs);
  Simulation simulation(loaded, options.run.embree);
  PictureOutputs outputs(options.outputs, scene.width, scene.height, scene.fps);
  Renderer renderer({.width = scene.width, .height = scene.height, .context = options.context});
  const SceneView view(loaded, simulation.current(), renderer);

  Progress progress("render", last - first, "pictures");
  const double cpuStart = processCpuSeconds();
  const auto start = std::chrono::steady_clock::now();
  PictureState state;
  Picture picture;
  Image image;
  int next = first;
  const auto drawFrame = [&] {
    const double end = simulation.record().start + simulation.record().duration;
    for (; next < last && next / scene.fps <= end + 1e-9; ++next) {
      stateAt(simulation.record(), next / scene.fps, state);
      view.compose(state, options.view, picture);
      renderer.render(picture, image);
      outputs.write(next, image);
      progress.update(next - first + 1);
    }
  };
  runToEnd(loaded, options.run, simulation, drawFrame, [&] { outputs.finish(); });
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  for (const std::string& path : options.outputs)
    fmt::print("file {}\n", fs::absolute(path).lexically_normal().string());
  fmt::print("pictures {}\n", last - first);
  fmt::print("pictures_per_second {:.4g}\n", (last - first) / wall);
  printResults(runResults(simulation, processCpuSeconds() - cpuStart, wall));
  return 0;
}

}  // namespace medulla
