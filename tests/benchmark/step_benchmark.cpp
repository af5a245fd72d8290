#include <benchmark/benchmark.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "physics/dynamics/implicit_data.h"
#include "physics/dynamics/stages.h"
#include "physics/dynamics/world_data.h"
#include "tests/synthetic_model.h"

// One explicit substep, links, edge springs and attachments with damping, surface full; CPU time per substep is the
// benchmark's `substep` counter.
namespace medulla {

using Scene = std::vector<BodyDescription> (*)();

static void runSubsteps(benchmark::State& state, Scene scene, LinkModel links) {
  std::vector<BodyDescription> bodies = scene();
  for (BodyDescription& body : bodies) body.links = links;
  World world({}, std::move(bodies));
  for (int i = 0; i < 3; ++i) world.advance({});
  for ([[maybe_unused]] auto _ : state) world.advance({});
  const WorldData& d = world.data();
  state.counters["spheres"] = d.spheres.count;
  state.counters["links"] = d.links.count;
  state.counters["springs"] = d.springs.count;
  state.counters["padded"] = static_cast<double>(2 * d.springs.groups.size());
  state.counters["substeps"] = world.substepsPerFrame();
  state.counters["stable_ms"] = 1e3 * world.stableSubstep();
  state.counters["substep"] = benchmark::Counter(
      world.substepsPerFrame(), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

// Of many short runs the quickest is the one that nothing else disturbed.
static double quickest(const std::vector<double>& times) {
  return *std::min_element(times.begin(), times.end());
}
static void quickestOfMany(benchmark::internal::Benchmark* b) {
  b->MinTime(0.02)->Repetitions(50)->ReportAggregatesOnly()->ComputeStatistics("min", quickest);
}
constexpr Scene kGallbladder = synthetic::gallbladderScene, kAbdomen = synthetic::abdomenScene;
BENCHMARK_CAPTURE(runSubsteps, , kGallbladder, LinkModel::beam)->Name("gallbladderSubstep")->Apply(quickestOfMany);
BENCHMARK_CAPTURE(runSubsteps, , kAbdomen, LinkModel::beam)->Name("abdomenSubstep")->Apply(quickestOfMany);

// Few frames, to count instructions: valgrind --tool=callgrind --toggle-collect='medulla::World::advance*'.
BENCHMARK_CAPTURE(runSubsteps, , kGallbladder, LinkModel::beam)->Name("gallbladderFrames")->Iterations(1);
BENCHMARK_CAPTURE(runSubsteps, , kAbdomen, LinkModel::beam)->Name("abdomenFrames")->Iterations(1);
BENCHMARK_CAPTURE(runSubsteps, , kGallbladder, LinkModel::springs)->Name("gallbladderSpringsFrames")->Iterations(1);
BENCHMARK_CAPTURE(runSubsteps, , kAbdomen, LinkModel::springs)->Name("abdomenSpringsFrames")->Iterations(1);

// The larger scene with 812 links: its chains, all bodies but the slab, are linked to the second neighbour too, and at
// their beginnings to the third, so that the Cholesky factor fills in as on networks that fill a body.
static std::vector<BodyDescription> bracedAbdomen() {
  std::vector<BodyDescription> scene = synthetic::abdomenScene();
  int missing = 812;
  for (const BodyDescription& body : scene) missing -= static_cast<int>(body.model->links.size());
  for (const int reach : {2, 3}) {
    for (std::size_t b = 0; b + 1 < scene.size(); ++b) {
      auto model = std::make_shared<SoftBodyModel>(*scene[b].model);
      for (int i = 0; i + reach < static_cast<int>(model->spheres.size()) && missing > 0; ++i, --missing) {
        ElasticLink link = model->links[i];
        link.sphere0 = i;
        link.sphere1 = i + reach;
        model->links.push_back(link);
      }
      scene[b].model = model;
    }
  }
  return scene;
}

// Implicit steps of 10 ms of the larger scene while it sags; `solve` is the time per linear system, assembled,
// factorised and solved, the forces around it included.
static void implicitStep(benchmark::State& state, Scene scene, SurfaceMode surface) {
  std::vector<BodyDescription> bodies = scene();
  for (BodyDescription& body : bodies) body.surface = surface;
  WorldSettings settings;
  settings.integrator = Integrator::implicit;
  settings.frameDuration = 0.01;
  settings.substeps = 1;
  World world(settings, std::move(bodies));
  for (int i = 0; i < 3; ++i) world.advance({});
  const long before = world.data().implicit[0]->solves, iterationsBefore = world.data().implicit[0]->iterations;
  for ([[maybe_unused]] auto _ : state) world.advance({});
  const auto solves = static_cast<double>(world.data().implicit[0]->solves - before);
  const auto iterations = static_cast<double>(world.data().implicit[0]->iterations - iterationsBefore);
  state.counters["spheres"] = world.data().spheres.count;
  state.counters["links"] = world.data().links.count;
  state.counters["nodes"] = world.data().nodes.dynamicEnd;
  state.counters["solves_per_step"] = solves / static_cast<double>(state.iterations());
  state.counters["iterations_per_solve"] = iterations / solves;
  state.counters["solve"] = benchmark::Counter(solves, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK_CAPTURE(implicitStep, spheres, synthetic::abdomenScene, SurfaceMode::skin)->Iterations(60);
BENCHMARK_CAPTURE(implicitStep, braced, bracedAbdomen, SurfaceMode::skin)->Iterations(60);
BENCHMARK_CAPTURE(implicitStep, full, synthetic::abdomenScene, SurfaceMode::full)->Iterations(20);

static void stageOf(benchmark::State& state, Stage stage) {
  World world({}, synthetic::abdomenScene());
  world.advance({});
  runStage(world.data(), evaluateForces);
  for ([[maybe_unused]] auto _ : state) runStage(world.data(), stage);
}
BENCHMARK_CAPTURE(stageOf, links, evaluateLinks);
BENCHMARK_CAPTURE(stageOf, attachments, evaluateAttachments);
BENCHMARK_CAPTURE(stageOf, nodeForces, finishNodeForces);
BENCHMARK_CAPTURE(stageOf, returned, returnLinkForces);
BENCHMARK_CAPTURE(stageOf, sphereSums, sumSphereForces);
BENCHMARK_CAPTURE(stageOf, velocities, stepVelocities);
BENCHMARK_CAPTURE(stageOf, positions, stepPositions);

}  // namespace medulla
