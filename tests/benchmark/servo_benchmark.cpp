#include <benchmark/benchmark.h>

#include <cmath>

#include "app/files/mesh_file.h"
#include "haptics/servo.h"
#include "physics/model/mesh_topology.h"
#include "tests/touch_shapes.h"

namespace medulla {

using Eigen::Vector3d;

static TouchShape gallbladder() {
  const TriangleMesh mesh = readMesh(MEDULLA_SOURCE_DIR "/assets/gallbladder/gallbladder.obj");
  auto model = std::make_shared<SoftBodyModel>();
  model->restNodes = mesh.vertices;
  model->triangles = mesh.triangles;
  fillBuckets(*model, 7);
  return model;
}

// A tool that strokes back and forth over a breathing surface, 3 mm deep. Frames are made before the clock runs.
static void strokes(benchmark::State& state, const TouchShape& shape) {
  const Eigen::AlignedBox3d box = boundsOf(shape->restNodes);
  const Vector3d middle = box.center(), half = 0.5 * box.sizes();
  const SurfaceMotion breathing = [&](const Vector3d& x, double t) {
    return Vector3d(x + 0.03 * std::sin(6 * t) * (x - middle));
  };
  std::vector<DynamicsFrame> frames;
  frames.reserve(64);
  for (int k = 0; k < 64; ++k) frames.push_back(frameAt(*shape, 0.02 * k, breathing));
  const auto device = [&](int tick) {
    ToolSample sample;
    const double phi = 0.8 * std::sin(tick * 0.002);
    sample.position = middle + (half.array() - 0.003)
                                   .matrix()
                                   .cwiseProduct(Vector3d(0.3 * std::sin(tick * 0.0013), std::cos(phi), std::sin(phi)));
    return sample;
  };
  Servo servo({{shape}}, {ToolSettings()}, 1.0 / 1200, frames[0], {device(0)});
  std::vector<ToolSample> input(1);
  int tick = 0;
  std::size_t contacts = 0;
  for ([[maybe_unused]] auto _ : state) {
    if (tick > 0 && tick % 24 == 0) {
      state.PauseTiming();
      const int k = tick / 24;
      // There and back, so that consecutive frames always join.
      const auto index = [](int n) { return n % 126 < 64 ? n % 126 : 126 - n % 126; };
      servo.commit(frames[index(k - 1)], frames[index(k)], servo.tools());
      servo.beginFrame();
      state.ResumeTiming();
    }
    input[0] = device(tick + 1);
    servo.tick((tick % 24 + 1) / 24.0, input);
    contacts += servo.tools()[0].inContact;
    ++tick;
  }
  state.counters["contact_%"] = 100.0 * double(contacts) / double(tick);
}

static void ServoTickGallbladder(benchmark::State& state) {
  strokes(state, gallbladder());
}
BENCHMARK(ServoTickGallbladder)->Unit(benchmark::kMicrosecond);

// Triangles: 2 around (along - 1).
static void ServoTickEllipsoid(benchmark::State& state) {
  strokes(state, ellipsoid(int(state.range(0)), int(state.range(1)), int(state.range(2)), 0.3));
}
BENCHMARK(ServoTickEllipsoid)
    ->Args({18, 14, 7})
    ->Args({32, 32, 50})
    ->Args({100, 101, 411})
    ->Unit(benchmark::kMicrosecond);

static void BucketsCommit(benchmark::State& state) {
  const TouchShape shape = ellipsoid(int(state.range(0)), int(state.range(1)), int(state.range(2)));
  const DynamicsFrame frame = frameAt(*shape, 0);
  Servo servo({{shape}}, {ToolSettings()}, 1.0 / 1200, frame, {ToolSample()});
  for ([[maybe_unused]] auto _ : state) servo.commit(frame, frame, servo.tools());
}
BENCHMARK(BucketsCommit)->Args({18, 14, 7})->Args({32, 32, 50})->Unit(benchmark::kMicrosecond);

}  // namespace medulla
