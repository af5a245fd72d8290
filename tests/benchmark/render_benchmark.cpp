#include <benchmark/benchmark.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "render/renderer.h"
#include "render/video_writer.h"

namespace medulla {
namespace {

using glm::vec3;

// Closed bumpy blob of about 4 n^2 triangles; `inside` turns it into a cavity.
SurfaceShape blob(const std::string& look, vec3 centre, vec3 radii, std::uint32_t n, bool inside = false) {
  SurfaceShape s;
  s.look = look;
  const std::uint32_t around = 2 * n;
  for (std::uint32_t j = 0; j <= n; ++j)
    for (std::uint32_t i = 0; i <= around; ++i) {
      const float theta = std::numbers::pi_v<float> * float(j) / float(n);
      const float phi = 2 * std::numbers::pi_v<float> * float(i % around) / float(around);
      const vec3 d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
      const float bump = 1 + 0.04f * std::sin(7 * d.x + 3 * d.y) * std::sin(6 * d.z + 2);
      s.restPositions.push_back(centre + bump * d * radii);
    }
  for (std::uint32_t j = 0; j < n; ++j)
    for (std::uint32_t i = 0; i < around; ++i) {
      const std::uint32_t a = j * (around + 1) + i, b = a + around + 1;
      s.triangles.push_back({a, b, b + 1});
      s.triangles.push_back({a, b + 1, a + 1});
    }
  if (inside)
    for (auto& t : s.triangles) std::swap(t[1], t[2]);
  return s;
}

// A laparoscopic view of five surfaces, 24k triangles, that fill the picture.
struct Scene {
  RendererSettings settings;
  Renderer renderer{settings};
  SurfaceShape gallbladder = blob("gallbladder", {-0.02f, 0, 0.02f}, {0.018f, 0.045f, 0.018f}, 36);
  Picture picture;
  Image image;

  Scene() {
    renderer.addSurface(gallbladder);
    renderer.addSurface(blob("liver", {-0.03f, 0.08f, -0.02f}, {0.12f, 0.06f, 0.05f}, 42));
    renderer.addSurface(blob("stomach", {0.09f, -0.02f, -0.02f}, {0.05f, 0.08f, 0.04f}, 36));
    renderer.addSurface(blob("fat", {0, -0.12f, 0}, {0.16f, 0.05f, 0.08f}, 36));
    renderer.addSurface(blob("wall", {0, 0, 0.02f}, {0.26f, 0.2f, 0.25f}, 36, true));
    picture.camera.position = {0, 0.01f, 0.22f};
    picture.light.referenceDistance = 0.2f;
    picture.surfaces.resize(5);
    picture.surfaces[0].positions = gallbladder.restPositions;
    Instrument grasper;
    grasper.tip = {-0.01f, -0.02f, 0.035f};
    grasper.worldFromTool = glm::quat(vec3(0.4f, 0.7f, 0));
    grasper.touching = true;
    picture.instruments.push_back(grasper);
  }
  void move(int k) {
    for (std::size_t i = 0; i < gallbladder.restPositions.size(); ++i)
      picture.surfaces[0].positions[i] = gallbladder.restPositions[i] + vec3(0.002f * std::sin(0.2f * float(k)), 0, 0);
  }
};

void BM_Picture720p(benchmark::State& state) {
  Scene scene;
  scene.picture.view = static_cast<ViewKind>(state.range(0));
  for (int k = 0; k < 3; ++k) scene.renderer.render(scene.picture, scene.image);
  int k = 0;
  for ([[maybe_unused]] auto _ : state) {
    scene.move(k++);
    scene.renderer.render(scene.picture, scene.image);
  }
}
BENCHMARK(BM_Picture720p)
    ->Arg(int(ViewKind::tissue))
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();

// Draw, read back, smooth, encode: what one picture of a film costs.
void BM_Film720p(benchmark::State& state) {
  Scene scene;
  scene.renderer.render(scene.picture, scene.image);
  const auto path = std::filesystem::temp_directory_path() / "medulla_benchmark.mp4";
  {
    VideoWriter writer(path.string(), scene.settings.width, scene.settings.height, 30);
    int k = 0;
    for ([[maybe_unused]] auto _ : state) {
      scene.move(k++);
      scene.renderer.render(scene.picture, scene.image);
      writer.write(scene.image);
    }
  }
}
BENCHMARK(BM_Film720p)->Iterations(60)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();

void BM_Png720p(benchmark::State& state) {
  Scene scene;
  scene.renderer.render(scene.picture, scene.image);
  const auto path = std::filesystem::temp_directory_path() / "medulla_benchmark.png";
  for ([[maybe_unused]] auto _ : state) writePng(path.string(), scene.image);
  std::filesystem::remove(path);
}
BENCHMARK(BM_Png720p)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace medulla
