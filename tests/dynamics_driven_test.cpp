#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "tests/complaint.h"
#include "tests/contact_bodies.h"
#include "tests/dynamics_states.h"
#include "tests/synthetic_model.h"

// Spheres led along a path, and the drag of the medium.
namespace medulla {

using namespace states;

static BodyDescription tube(SurfaceMode surface) {
  BodyDescription b = synthetic::body(synthetic::shortTube(), 6e3);
  b.surface = surface;
  return b;
}

TEST(DrivenSphere, IsOnItsPathAtEveryFrame) {
  for (const SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
    BodyDescription b = tube(surface);
    DrivenSphere drive;
    drive.sphere = 1;
    drive.axis = {0, 3, 4};
    drive.amplitude = 0.01;
    drive.frequency = 2;
    drive.phase = 0.7;
    drive.velocity = {0.1, 0, -0.05};
    b.driven = {drive};
    World world({}, {b});  // its weight does not draw it off
    const Vector3d rest = vectorOf(world.data().spheres.position[1]);
    for (int frame = 1; frame <= 60; ++frame) {
      world.advance({});
      const double t = world.time(), u = std::min(1.0, 2 * t), ramp = u * u * (3 - 2 * u);
      const double swing = 0.01 * ramp * std::sin(2 * std::numbers::pi * 2 * t + 0.7);
      const Vector3d expected = rest + t * drive.velocity + swing * Vector3d(0, 0.6, 0.8);
      ASSERT_LT((vectorOf(world.data().spheres.position[1]) - expected).norm(), 1e-13);
    }
  }
}

TEST(DrivenSphere, IsSteppedSixteenTimesPerSwing) {
  for (const double frequency : {0.5, 200.0, 5000.0, 1e300}) {
    BodyDescription b = tube(SurfaceMode::skin);
    b.driven = {{.sphere = 0, .amplitude = 0.001, .frequency = frequency}};
    WorldSettings settings;
    settings.integrator = Integrator::implicit;
    EXPECT_EQ(World(settings, {b}).substepsPerFrame(),
              std::clamp(std::lround(16 * 0.02 * std::min(frequency, 1e5)), 4l, 20000l));
    settings.substeps = 3;  // as asked for
    EXPECT_EQ(World(settings, {b}).substepsPerFrame(), 3);
  }
}

// Shaken aside and across by its first sphere, a tube turns it, unless its orientation is held, too.
TEST(DrivenSphere, TurnsAsFarAsItsFreedomSays) {
  for (const Integrator integrator : {Integrator::explicitEuler, Integrator::implicit}) {
    for (const FixedFreedom freedom : {FixedFreedom::translation, FixedFreedom::all}) {
      BodyDescription b = tube(SurfaceMode::skin);
      b.driven = {{.sphere = 0, .freedom = freedom, .axis = {0, 3, 4}, .amplitude = 0.01}};
      WorldSettings settings;
      settings.integrator = integrator;
      World world(settings, {b});
      const Quad rest = world.data().spheres.orientation[0];
      double farthest = 0;
      for (int frame = 0; frame < 60; ++frame) {
        world.advance({});
        const Quad now = world.data().spheres.orientation[0];
        for (int k = 0; k < 4; ++k) farthest = std::max(farthest, std::abs(now.v[k] - rest.v[k]));
      }
      if (freedom == FixedFreedom::all)
        EXPECT_EQ(farthest, 0);
      else
        EXPECT_GT(farthest, 0.1);
    }
  }
}

// What falls through a medium comes to g / drag, however long the step.
TEST(DrivenSphere, DragLeavesTheTerminalSpeed) {
  constexpr double drag = 100, gravity = 9.81;
  for (const auto& [integrator, order] : {std::pair{Integrator::explicitEuler, 1}, std::pair{Integrator::implicit, 1},
                                          std::pair{Integrator::implicit, 2}}) {
    WorldSettings settings;
    settings.integrator = integrator;
    settings.order = order;
    settings.ambientDrag = drag;
    settings.gravity = {0, -gravity, 0};
    World world(settings, {tube(SurfaceMode::full)});
    for (int frame = 0; frame < 25; ++frame) world.advance({});
    const double before = world.data().spheres.position[2].v[1], since = world.time();
    for (int frame = 0; frame < 25; ++frame) world.advance({});
    const double speed = (before - world.data().spheres.position[2].v[1]) / (world.time() - since);
    EXPECT_NEAR(speed, gravity / drag, 1e-4 * gravity / drag);
  }
}

// Likewise what a load pulls, to F / (m drag).
TEST(DrivenSphere, DragLeavesALoadItsTerminalSpeed) {
  constexpr double drag = 100, force = 0.01;
  for (const SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
    WorldSettings settings;
    settings.ambientDrag = drag;
    settings.gravity.setZero();
    BodyDescription body = tube(surface);
    std::vector<int> all(body.model->restNodes.size());
    std::iota(all.begin(), all.end(), 0);
    body.deadLoads = spreadLoad(*body.model, all, {.force = {0, -force, 0}, .from = 0, .to = 0});
    World world(settings, {body});
    double mass = 0;
    for (const FillingSphere& s : body.model->spheres) mass += body.tissue.density * s.volume;
    for (int frame = 0; frame < 25; ++frame) world.advance({});
    const double before = world.data().spheres.position[2].v[1], since = world.time();
    for (int frame = 0; frame < 25; ++frame) world.advance({});
    const double speed = (before - world.data().spheres.position[2].v[1]) / (world.time() - since);
    EXPECT_NEAR(speed, force / (mass * drag), 1e-3 * force / (mass * drag));
  }
}

TEST(DrivenSphere, StaysWhereItIsWhileBodiesSettle) {
  BodyDescription b = tube(SurfaceMode::full);
  DrivenSphere drive;
  drive.sphere = 1;
  drive.amplitude = 0.01;
  drive.velocity = {0.1, 0, 0};
  b.driven = {drive};
  World world({.gravity = Vector3d::Zero(), .settleFrames = 10}, {b});
  const World unsettled({.gravity = Vector3d::Zero()}, {b});
  const Vector3d rest = vectorOf(world.data().spheres.position[1]);
  while (world.time() < 0) world.advance({});
  EXPECT_EQ(world.time(), 0);
  EXPECT_LT((vectorOf(world.data().spheres.position[1]) - rest).norm(), 1e-13);
  // Nor does anything else move where nothing moves it: the whole body starts at the drive's velocity then, as it does
  // without settling.
  EXPECT_LT(world.energies().elastic, 1e-20);
  EXPECT_GT(unsettled.energies().kinetic, 1e-6);
  EXPECT_NEAR(world.energies().kinetic, unsettled.energies().kinetic, 1e-12);
  world.advance({});
  EXPECT_GT((vectorOf(world.data().spheres.position[1]) - rest).norm(), 1e-4);
}

// Weight acts while bodies settle, loads wait for the time to begin. However little a body is damped, it comes to rest
// as soon as critical damping of its lowest mode lets it, and is damped as before from then on.
TEST(Settle, LeavesBodiesAtRestUnderTheirWeightAlone) {
  for (const Integrator integrator : {Integrator::explicitEuler, Integrator::implicit}) {
    BodyDescription b = tube(SurfaceMode::full);
    b.fixed = {{0, FixedFreedom::all}};
    b.tissue.damping = 0.01;
    const World before({.integrator = integrator}, {b});
    BodyDescription loaded = b;
    loaded.deadLoads.push_back({0, {0, 5, 0}, 0, 0.1});
    loaded.deadLoads.push_back({1, {0, 5, 0}, 0, 0});  // whole at time 0, which the last settling substep ends at
    constexpr int kFrames = 200;
    const WorldSettings settings{.integrator = integrator, .settleFrames = kFrames};
    World world(settings, {b}), alike(settings, {loaded});
    for (World* w : {&world, &alike})
      for (int frame = 0; frame < kFrames; ++frame) w->advance({});
    EXPECT_EQ(world.time(), 0);
    EXPECT_EQ(world.stateHash(), alike.stateHash());
    EXPECT_LT(world.energies().kinetic, 1e-12);
    const int last = static_cast<int>(b.model->spheres.size()) - 1;
    EXPECT_LT(world.data().spheres.position[last].v[1], before.data().spheres.position[last].v[1] - 1e-4);
    for (int frame = 0; frame < 20; ++frame) alike.advance({});
    EXPECT_GT(alike.energies().kinetic, 1e-6);
  }
}

TEST(DrivenSphere, ASteadyDriveIsFreeMotionOfTheWholeBody) {
  BodyDescription b = tube(SurfaceMode::full);
  b.driven = {DrivenSphere{.sphere = 0, .velocity = Vector3d(0.2, 0.1, 0)}};
  World world(weightless(), {b});
  const double rest = world.energies().kinetic;
  for (int frame = 0; frame < 25; ++frame) world.advance({});
  EXPECT_NEAR(world.energies().kinetic, rest, 1e-9 * rest);
  EXPECT_LT(world.energies().elastic, 1e-9 * rest);
}

TEST(DrivenSphere, LeavesWhatIsFixedWhereItIs) {
  for (const Integrator integrator : {Integrator::explicitEuler, Integrator::implicit}) {
    BodyDescription b = tube(SurfaceMode::full);
    b.fixed = {{0, FixedFreedom::all}};
    b.fixedNodes = {0, 1, 2};
    b.driven = {DrivenSphere{.sphere = 4, .velocity = Vector3d(0.01, 0, 0)}};
    WorldSettings settings = weightless();
    settings.integrator = integrator;
    World world(settings, {b});
    const WorldData& d = world.data();
    const auto nodeAt = [&](int node) { return vectorAt(d.nodes.position, d.ranges[0].node[node]); };
    const Vector3d sphere = vectorOf(d.spheres.position[0]), node = nodeAt(2);
    for (int frame = 0; frame < 10; ++frame) world.advance({});
    EXPECT_EQ(vectorOf(d.spheres.position[0]), sphere);
    EXPECT_EQ(nodeAt(2), node);
  }
}

TEST(DrivenSphere, RefusedWhereItContradictsItself) {
  const auto message = [](const DrivenSphere& drive) {
    BodyDescription b = tube(SurfaceMode::skin);
    b.name = "eel";
    b.fixed = {{0, FixedFreedom::translation}};
    b.driven = {drive};
    return complaintOf([&] { World({}, {b}); });
  };
  EXPECT_EQ(message({.sphere = 1}), "");
  EXPECT_EQ(message({.sphere = 0}), "body 'eel' cannot be simulated: it both fixes and drives sphere 0");
  EXPECT_EQ(message({.sphere = 5}), "body 'eel' cannot be simulated: it drives sphere 5: expected 0 to 4");
  EXPECT_EQ(message({.sphere = 1, .axis = Vector3d::Zero()}),
            "body 'eel' cannot be simulated: its drive's axis has no direction");
  EXPECT_EQ(message({.sphere = 1, .frequency = 0}),
            "body 'eel' cannot be simulated: its drive's frequency is 0: expected more than 0 Hz");
}

// v' = -c v by backward Euler is v0 / (1 + h c)^n, for a body at rest within itself exactly.
TEST(AmbientDrag, SlowsEveryPartAlike) {
  for (const SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
    WorldSettings settings = weightless();
    settings.ambientDrag = 0.8;
    settings.substeps = 50;
    World world(settings, {tube(surface)});
    WorldData& d = world.data();
    const Vector3d start(0.3, -0.2, 0.1);
    for (int i = 0; i < d.spheres.count; ++i) d.spheres.velocity[i] = quadOf(start);
    for (int i = 0; i < d.nodes.dynamicEnd; ++i)
      if (d.nodes.mass[i] > 0) setVector(d.nodes.velocity, i, start);
    for (int frame = 0; frame < 10; ++frame) world.advance({});
    const Vector3d expected = start / std::pow(1 + d.substep * 0.8, 500);
    for (int i = 0; i < d.spheres.count; ++i)
      EXPECT_LT((vectorOf(d.spheres.velocity[i]) - expected).norm(), 1e-12) << i;
    EXPECT_LT(world.energies().elastic, 1e-20);
  }
}

TEST(AmbientDrag, SlowsSpinAsItSlowsSpeed) {
  for (const Integrator integrator : {Integrator::explicitEuler, Integrator::implicit}) {
    WorldSettings settings = weightless();
    settings.integrator = integrator;
    settings.ambientDrag = 0.8;
    settings.substeps = 50;
    World world(settings, {synthetic::ball("ball", 0.03, {0, 0, 0})});
    WorldData& d = world.data();
    setAngularVelocity(d, 0, {1, -2, 3});
    const Vector3d start = vectorOf(d.spheres.angularMomentum[0]);
    for (int frame = 0; frame < 10; ++frame) world.advance({});
    const Vector3d expected = start / std::pow(1 + d.substep * 0.8, 500);
    EXPECT_LT((vectorOf(d.spheres.angularMomentum[0]) - expected).norm(), 1e-7 * start.norm());
  }
}

// Beyond the drive's motion a held sphere moves backwards: damped, it would be carried along.
TEST(DrivenSphere, LeavesAHeldOneWhereItIs) {
  const auto model = synthetic::chainModel(synthetic::straightTube(5, 0.08, 0.012, 10, 12));
  for (const SurfaceMode surface : {SurfaceMode::skin, SurfaceMode::full}) {
    BodyDescription b = synthetic::body(model, 5e3, {{0, FixedFreedom::translation}});
    b.tissue.damping = 0.3;
    b.surface = surface;
    DrivenSphere drive;
    drive.sphere = 4;
    drive.freedom = FixedFreedom::all;
    drive.velocity = Vector3d(0, 0.005, 0);
    b.driven = {drive};
    WorldSettings s;
    s.gravity.setZero();
    World world(s, {b});
    DynamicsFrame before, after;
    world.readFrame(before);
    for (int k = 0; k < 100; ++k) world.advance({});
    world.readFrame(after);
    EXPECT_EQ(after.bodies[0].spheres[0].position, before.bodies[0].spheres[0].position);
  }
}

}  // namespace medulla
