#include <benchmark/benchmark.h>

#include <cmath>

#include "physics/dynamics/contact_stages.h"
#include "physics/dynamics/stages.h"
#include "tests/synthetic_model.h"

// Cost of contact against the number of spheres: rods of four spheres with a full surface, packed so that each ball
// touches its six neighbours, in a case of six planes, under gravity.
namespace medulla {

namespace {

constexpr double kRadius = 0.01, kPitch = 1.98 * kRadius;

std::vector<StaticShape> caseOf(const Eigen::Vector3d& size) {
  std::vector<StaticShape> planes;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      StaticShape& s = planes.emplace_back();
      s.worldFromShape.linear() =
          Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitY(), -side * Eigen::Vector3d::Unit(axis))
              .toRotationMatrix();
      if (side > 0) s.worldFromShape.translation() = size;
    }
  }
  return planes;
}

World packedRods(int spheres, ContactMode mode) {
  const auto rod = synthetic::chainModel(synthetic::straightTube(4, 3 * kPitch, kRadius, 5, 8));
  const int rods = spheres / 4, side = static_cast<int>(std::ceil(std::cbrt(spheres))),
            columns = std::max(1, (side + 3) / 4), depth = static_cast<int>(std::ceil(std::sqrt(rods / columns)));
  std::vector<BodyDescription> bodies;
  for (int k = 0; k < rods; ++k) {
    bodies.push_back(synthetic::body(rod, 5e3));
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
static void packedSubstep(benchmark::State& state, ContactMode mode) {
  World world = packedRods(static_cast<int>(state.range(0)), mode);
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
BENCHMARK_CAPTURE(packedSubstep, none, ContactMode::none)->Apply(fromFortyToTenThousand);
BENCHMARK_CAPTURE(packedSubstep, balls, ContactMode::balls)->Apply(fromFortyToTenThousand);
BENCHMARK_CAPTURE(packedSubstep, swept, ContactMode::swept)->Apply(fromFortyToTenThousand);

static void contactStage(benchmark::State& state, ContactMode mode, void (*stage)(WorldData&)) {
  World world = packedRods(static_cast<int>(state.range(0)), mode);
  for (int i = 0; i < 3; ++i) world.advance({});
  for ([[maybe_unused]] auto _ : state) stage(world.data());
  count(state, world);
}
static void nearPairs(WorldData& d) {
  placeBalls(d);
  benchmark::DoNotOptimize(farthestMove(d.contact));
  d.contact.contacts.clear();
  findPairContacts(d, 0);
}
BENCHMARK_CAPTURE(contactStage, ballsList, ContactMode::balls, listNeighbours)->Arg(411)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(contactStage, sweptList, ContactMode::swept, listNeighbours)->Arg(411)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(contactStage, ballsNear, ContactMode::balls, nearPairs)->Arg(411)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(contactStage, sweptNear, ContactMode::swept, nearPairs)->Arg(411)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(contactStage, ballsAll, ContactMode::balls, resolveContacts)->Arg(411)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(contactStage, sweptAll, ContactMode::swept, resolveContacts)->Arg(411)->Unit(benchmark::kMicrosecond);

}  // namespace medulla
