#include <benchmark/benchmark.h>

#include "physics/model/build.h"
#include "tests/test_shapes.h"

namespace medulla {

// The gallbladder of the paper's figure 11: 466 triangles, 7 spheres, with the fine shape that is drawn.
static void buildGallbladder(benchmark::State& state) {
  const RepairedMesh mesh = asRepaired(assetMesh("gallbladder/gallbladder.obj"));
  const TriangleMesh fine = assetMesh("gallbladder/gallbladder_fine.obj");
  BuildSettings settings;
  settings.spheres = static_cast<int>(state.range(0));
  BuildReport report;
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(buildModel(mesh, &fine, settings, report));
}
BENCHMARK(buildGallbladder)->Arg(7)->Arg(25)->Unit(benchmark::kMillisecond);

}  // namespace medulla
