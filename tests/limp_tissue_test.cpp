#include <gtest/gtest.h>

#include <cstdio>
#include <functional>

#include "haptics/servo.h"
#include "physics/dynamics/world.h"
#include "tests/synthetic_model.h"
#include "tests/tool_run.h"

// Tissue that goes along with a stiff tool: what hand and tissue get agrees although the servo sees it a frame late.
namespace medulla {

using Eigen::Vector3d;

namespace {
struct Felt {
  Vector3d hand = Vector3d::Zero(), tissue = Vector3d::Zero();  // N s
  double apart = 0;                                             // N s, sum over frames
  double largestStep = 0, largest = 0, energy = 0;              // N between ticks, N, J
  double scatter = 0;                                           // N, of the force in the last 0.5 s
};
}  // namespace

constexpr double kRodRadius = 0.01;  // m, of the rod along x

namespace {
struct Rod {  // of 8 cm, clamped at one end or free
  bool isClamped;
  double young = 1e5;
  SurfaceMode surface = SurfaceMode::full;
};
}  // namespace

static ToolSettings stiffTool() {
  ToolSettings tool;
  tool.stiffness = 4000;
  return tool;
}

// From above (z).
static Felt touchRod(const Rod& rod, const std::function<ToolSample(double)>& device, double duration,
                     const ToolSettings& tool = stiffTool()) {
  constexpr int kTicks = 24;
  constexpr double kTick = 1.0 / 1200;
  const auto model = synthetic::chainModel(synthetic::straightTube(5, 0.08, kRodRadius, 16, 12));
  BodyDescription body = synthetic::body(model, rod.young);
  body.surface = rod.surface;
  if (rod.isClamped) body.fixed = {{0, FixedFreedom::all}};
  WorldSettings settings;
  settings.gravity.setZero();
  World world(settings, {body});
  DynamicsFrame last, now;
  world.readFrame(last);
  now = last;
  const auto touched = std::make_shared<SoftBodyModel>(*model);
  touched->buckets.assign(1, {});
  for (std::size_t t = 0; t < touched->triangles.size(); ++t) touched->buckets[0].push_back(int(t));
  Servo servo({{touched, world.nodeGive()[0]}}, {tool}, kTick, now, {device(0)});
  Felt felt;
  Loads loads;
  Vector3d before = Vector3d::Zero();
  Vector3d least = Vector3d::Constant(1e9), most = -least;
  for (int tick = 0; tick < int(std::lround(duration / kTick)); tick += kTicks) {
    Vector3d hand = Vector3d::Zero();
    for (int k = 1; k <= kTicks; ++k) {
      servo.tick(double(k) / kTicks, {device((tick + k) * kTick)});
      const ToolState& state = servo.tools()[0];
      hand -= kTick * state.force;
      felt.largestStep = std::max(felt.largestStep, (state.force - before).norm());
      felt.largest = std::max(felt.largest, state.force.norm());
      felt.energy = std::max(felt.energy, state.energy);
      before = state.force;
      if ((tick + k) * kTick < duration - 0.5) continue;
      least = least.cwiseMin(state.force);
      most = most.cwiseMax(state.force);
    }
    servo.handOver(kTicks * kTick, loads);
    std::vector<Vector3d> impulse = world.advance(loads);
    impulse.resize(1, Vector3d::Zero());  // empty without loads
    felt.hand += hand;
    felt.tissue += impulse[0];
    felt.apart += (hand - impulse[0]).norm();
    last = now;
    world.readFrame(now);
    servo.commit(last, now, servo.tools(), &impulse);
    servo.beginFrame();
  }
  felt.scatter = (most - least).norm();
  std::printf(
      "[  reached ] hand %.5f, tissue %.5f, apart %.5f N s; largest %.4f N, step %.4f N; energy %.3g J; scatter %.4f "
      "N\n",
      felt.hand.norm(), felt.tissue.norm(), felt.apart, felt.largest, felt.largestStep, felt.energy, felt.scatter);
  return felt;
}

// Pressed smoothly by 8 mm within a second and held.
TEST(LimpTissue, APressedRodFeelsAsSoftAsItIs) {
  const double top = kRodRadius + ToolSettings{}.radius;
  const Felt felt = touchRod(
      {true},
      [=](double t) {
        return deviceAt({0.07, 0, top + 5e-4 - 8.5e-3 * ease(t, 0.1, 1)});
      },
      1.5);
  EXPECT_GT(felt.tissue.norm(), 0.01);
  EXPECT_LT((felt.hand - felt.tissue).norm(), 0.05 * felt.tissue.norm());
  EXPECT_LT(felt.apart, 0.1 * felt.tissue.norm());
  EXPECT_LT(felt.largestStep, 0.025);
}

// Poked at 0.1 m/s.
TEST(LimpTissue, AFreeRodIsNotHeavierThanItIs) {
  const double top = kRodRadius + ToolSettings{}.radius;
  for (const double young : {1e4, 1e5, 1e6}) {
    for (const SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
      const Felt felt = touchRod(
          {false, young, surface},
          [=](double t) {
            return deviceAt({0.04, 0, top + 0.005 - 0.1 * std::min(0.07, std::max(0.0, t - 0.1))});
          },
          0.6);
      EXPECT_GT(felt.tissue.norm(), 1e-3);
      EXPECT_LT((felt.hand - felt.tissue).norm(), felt.tissue.norm());
    }
  }
}

// What limits the springs must not be what the tissue gave some frames ago: a still tool would swing it about.
TEST(LimpTissue, APullBeyondForceMaxHoldsStill) {
  const double top = kRodRadius + ToolSettings{}.radius;
  for (const double most : {0.2, 0.3}) {
    ToolSettings tool;
    tool.forceMax = most;
    const auto pull = [=](double t) {
      return deviceAt({0.07, 0.05 * ease(t, 0.4, 1), top - 1e-3 * ease(t, 0, 0.1)}, t > 0.2 ? 1 : 0);
    };
    const Felt felt = touchRod({true}, pull, 3, tool);
    EXPECT_NEAR(felt.largest, most, 0.01 * most);
    EXPECT_LT(felt.scatter, 0.002 * most);
    EXPECT_LT((felt.hand - felt.tissue).norm(), 0.01 * felt.tissue.norm());
  }
}

}  // namespace medulla
