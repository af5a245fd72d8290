#include <benchmark/benchmark.h>

#include <cmath>

#include "physics/dynamics/contact_stages.h"
#include "physics/dynamics/stages.h"
#include "physics/model/rotation_between.h"
#include "tests/synthetic_model.h"

// Cost of contact against the number of spheres: rods of four spheres with a full surface, packed so that each ball
// touches its six neighbours, in a case of six planes, under gravity. A cube that grows has ever more neighbours per
// ball, 1.4 pairs at 40 balls and 4.4 at 10 000, since ever fewer of them lie at its walls; a trough of one
// cross-section has as many at any length, and shows what the number of spheres alone costs.
namespace medulla {

namespace {

constexpr double kRadius = 0.01, kPitch = 1.98 * kRadius;

std::vector<StaticShape> caseOf(const Eigen::Vector3d& size) {
  std::vector<StaticShape> planes;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      StaticShape& s = planes.emplace_back();
      s.worldFromShape.linear() =
          rotationBetween(Eigen::Vector3d::UnitY(), -side * Eigen::Vector3d::Unit(axis)).toRotationMatrix();
      if (side > 0) s.worldFromShape.translation() = size;
    }
  }
  return planes;
}

struct Packing {
  int columns = 1, depth = 2;  // rods side by side along x (their length) and z; layers are stacked as needed
  bool alike = true;           // or each has a model of its own: like bodies share their constants
};

Packing cubeOf(int spheres) {
  const int side = static_cast<int>(std::ceil(std::cbrt(spheres))), columns = std::max(1, (side + 3) / 4);
  return {columns, static_cast<int>(std::ceil(std::sqrt(spheres / 4 / columns)))};
}

// Two rods high, one rod across.
Packing troughOf(int spheres) {
  return {1, (spheres / 4 + 1) / 2};
}

Packing unlikeInTrough(int spheres) {
  return {1, (spheres / 4 + 1) / 2, false};
}

World packedRods(int spheres, ContactMode mode, const Packing& packing) {
  const auto rod = synthetic::chainModel(synthetic::straightTube(4, 3 * kPitch, kRadius, 5, 8));
  const int rods = spheres / 4, columns = packing.columns, depth = packing.depth;
  std::vector<BodyDescription> bodies;
  for (int k = 0; k < rods; ++k) {
    bodies.push_back(synthetic::body(packing.alike ? rod : std::make_shared<SoftBodyModel>(*rod), 5e3));
    const int x = k % columns, z = k / columns % depth, y = k / columns / depth;
    bodies.back().worldFromModel.translation() =
        Eigen::Vector3d(kRadius + 4 * kPitch * x, kRadius + kPitch * y, kRadius + kPitch * z);
  }
  const int layers = (rods + columns * depth - 1) / (columns * depth);
  WorldSettings s;
  s.contact = mode;
  s.frameDuration = 0.02;
  if (mode == ContactMode::none) s.gravity.setZero();  // nothing would stop their fall within a world's ten kilometres
  const Eigen::Vector3d size(4 * kPitch * columns, kPitch * (layers + 1), kPitch * (depth + 1));
  return World(s, std::move(bodies), caseOf(size));
}

void count(benchmark::State& state, const World& world) {
  const ContactData& c = world.data().contact;
  state.counters["spheres"] = world.data().spheres.count;
  state.counters["pairs"] = 4.0 * static_cast<double>(c.pairs.size());
  state.counters["contacts"] = static_cast<double>(c.contacts.size());
  state.counters["penetration"] = c.penetration.bodies;
}

}  // namespace

// One whole substep is the counter `substep`, over the same second of simulated time at every size: a heap that has
// come to rest needs fewer passes than one that settles.
static void packedSubstep(benchmark::State& state, ContactMode mode, Packing (*packing)(int)) {
  const int spheres = static_cast<int>(state.range(0));
  World world = packedRods(spheres, mode, packing(spheres));
  for (int i = 0; i < 5; ++i) world.advance({});
  for ([[maybe_unused]] auto _ : state) world.advance({});
  count(state, world);
  state.counters["substep"] = benchmark::Counter(
      world.substepsPerFrame(), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
static void fromFortyToTenThousand(benchmark::internal::Benchmark* b) {
  for (const int spheres : {40, 100, 400, 1000, 4000, 10000}) b->Arg(spheres);
  b->Iterations(20);
}
BENCHMARK_CAPTURE(packedSubstep, cubeNone, ContactMode::none, cubeOf)->Apply(fromFortyToTenThousand);
BENCHMARK_CAPTURE(packedSubstep, cubeBalls, ContactMode::balls, cubeOf)->Apply(fromFortyToTenThousand);
BENCHMARK_CAPTURE(packedSubstep, cubeSwept, ContactMode::swept, cubeOf)->Apply(fromFortyToTenThousand);
BENCHMARK_CAPTURE(packedSubstep, troughBalls, ContactMode::balls, troughOf)->Apply(fromFortyToTenThousand);
BENCHMARK_CAPTURE(packedSubstep, troughSwept, ContactMode::swept, troughOf)->Apply(fromFortyToTenThousand);
BENCHMARK_CAPTURE(packedSubstep, unlikeNone, ContactMode::none, unlikeInTrough)->Apply(fromFortyToTenThousand);
BENCHMARK_CAPTURE(packedSubstep, unlikeSwept, ContactMode::swept, unlikeInTrough)->Apply(fromFortyToTenThousand);

static void contactStage(benchmark::State& state, ContactMode mode, void (*stage)(WorldData&)) {
  const int spheres = static_cast<int>(state.range(0));
  World world = packedRods(spheres, mode, cubeOf(spheres));
  for (int i = 0; i < 3; ++i) world.advance({});
  for ([[maybe_unused]] auto _ : state) stage(world.data());
  count(state, world);
}
static void nearPairs(WorldData& d) {
  placeBalls(d);
  benchmark::DoNotOptimize(farthestMove(d.contact, d.contact.ballAtList));
  d.contact.contacts.clear();
  findPairContacts(d, 0);
}
static void allLists(WorldData& d) {
  d.contact.listsAreOld = true;
  listNeighbours(d);
}
BENCHMARK_CAPTURE(contactStage, ballsList, ContactMode::balls, allLists)->Arg(411)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(contactStage, sweptList, ContactMode::swept, allLists)->Arg(411)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(contactStage, ballsNear, ContactMode::balls, nearPairs)->Arg(411)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(contactStage, sweptNear, ContactMode::swept, nearPairs)->Arg(411)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(contactStage, ballsAll, ContactMode::balls, resolveContacts)->Arg(411)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(contactStage, sweptAll, ContactMode::swept, resolveContacts)->Arg(411)->Unit(benchmark::kMicrosecond);

}  // namespace medulla
