#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/contact_bodies.h"
#include "tests/dynamics_states.h"

// Bodies at rest sleep, and wake without having lost anything.
namespace medulla {

using namespace states;
using synthetic::ball;

namespace {

constexpr double kBallRadius = 0.01, kGravity = 9.81;

WorldSettings settings(double sleepAfter = 0.5) {
  WorldSettings s;
  s.contact = ContactMode::balls;
  s.gravity = {0, -kGravity, 0};
  s.frameDuration = 0.01;
  s.substeps = 10;
  s.sleepAfter = sleepAfter;
  return s;
}

std::vector<StaticShape> floorAtZero() {
  StaticShape floor;
  floor.friction = 0.5;
  return {floor};
}

BodyDescription rod(const char* name, const Vector3d& at) {
  BodyDescription b = synthetic::body(synthetic::chainModel(synthetic::straightTube(4, 0.06, 0.012, 8, 10)), 5e3);
  b.name = name;
  b.tissue.damping = 0.5;
  b.worldFromModel.translation() = at;
  return b;
}

// A rod across another one, which lies on the floor; and one a metre away.
World stackedRods(double sleepAfter) {
  BodyDescription upper = rod("upper", {0.03, 0.038, -0.03});
  upper.worldFromModel.linear() = Eigen::AngleAxisd(-std::numbers::pi / 2, Vector3d::UnitY()).toRotationMatrix();
  return World(settings(sleepAfter), {rod("lower", {0, 0.0125, 0}), upper, rod("far", {1, 0.0125, 0})}, floorAtZero());
}

void run(World& world, double time) {
  for (long k = std::lround(time / 0.01); k > 0; --k) world.advance({});
}

int bodiesAwake(const World& world) {
  int count = 0;
  for (int b = 0; b < static_cast<int>(world.bodies().size()); ++b) count += world.dynamicNodes(b) > 0 ? 1 : 0;
  return count;
}

double farthestApart(const World& a, const World& b) {  // m, of spheres
  double most = 0;
  for (int i = 0; i < a.data().spheres.count; ++i)
    most = std::max(most, (vectorOf(a.data().spheres.position[i]) - vectorOf(b.data().spheres.position[i])).norm());
  return most;
}

Loads holding(const World& world, int body, int node, const Vector3d& shift) {
  const WorldData& d = world.data();
  HeldNode held;
  held.body = body;
  held.node = node;
  held.anchor = vectorAt(d.nodes.position, d.ranges[body].node[node]) + shift;
  held.stiffness = 50;
  held.damping = 0.05;
  Loads loads;
  loads.heldNodes = {held};
  return loads;
}

}  // namespace

TEST(Sleep, WhatHasComeToRestIsLeftAlone) {
  World world = stackedRods(0.5), sleepless = stackedRods(0);
  run(world, 4);
  run(sleepless, 4);
  EXPECT_EQ(bodiesAwake(world), 0);
  EXPECT_EQ(bodiesAwake(sleepless), 3);
  EXPECT_EQ(world.energies().kinetic, 0);
  EXPECT_NEAR(world.energies().elastic, sleepless.energies().elastic, 0.02 * sleepless.energies().elastic);
  EXPECT_LT(farthestApart(world, sleepless), 0.02 * kBallRadius);
  DynamicsFrame before, after;
  world.readFrame(before);
  run(world, 0.1);
  world.readFrame(after);
  for (std::size_t b = 0; b < before.bodies.size(); ++b) EXPECT_EQ(before.bodies[b].nodes, after.bodies[b].nodes);
}

TEST(Sleep, ABodySleepsWithAllThatItTouchesOnly) {
  World world = stackedRods(0.5);
  run(world, 3);
  const Loads loads = holding(world, 1, 20, Vector3d::Zero());
  world.advance(loads);
  EXPECT_GT(world.dynamicNodes(0), 0);
  EXPECT_GT(world.dynamicNodes(1), 0);
  EXPECT_EQ(world.dynamicNodes(2), 0);
}

// What a tool feels of a body that it wakes is what it would feel of one that never slept.
TEST(Sleep, AToolFeelsNothingOfIt) {
  World world = stackedRods(0.5), sleepless = stackedRods(0);
  run(world, 3);
  run(sleepless, 3);
  const Loads loads = holding(world, 1, 20, {0, 0.004, 0}), same = holding(sleepless, 1, 20, {0, 0.004, 0});
  for (int k = 0; k < 20; ++k) {
    const Vector3d felt = world.advance(loads).at(0), expected = sleepless.advance(same).at(0);
    EXPECT_LT((felt - expected).norm(), 0.01 * expected.norm()) << "frame " << k;
  }
  EXPECT_LT(farthestApart(world, sleepless), 0.03 * kBallRadius);
}

// What it lay on is pulled away at once: no contact presses on it any more that would wake it.
TEST(Sleep, WhatLiesOnASleeperThatIsPulledAwayFalls) {
  BodyDescription beam = rod("beam", Vector3d::Zero());
  beam.surface = SurfaceMode::skin;
  beam.tissue.young = 5e4;
  beam.fixed = {{0}, {3}};
  BodyDescription load = rod("load", {0.03, 0.0255, -0.03});
  load.worldFromModel.linear() = Eigen::AngleAxisd(-std::numbers::pi / 2, Vector3d::UnitY()).toRotationMatrix();
  World world(settings(0.3), {load, beam});
  run(world, 2);
  ASSERT_TRUE(world.data().rest[0].asleep && world.data().rest[1].asleep);
  const auto heightOf = [&](int sphere) { return vectorOf(world.data().spheres.position[sphere]).y(); };
  const double before = heightOf(1);
  const SoftBodyModel& model = *beam.model;
  int middle = 0;
  for (int i = 0; i < static_cast<int>(model.restNodes.size()); ++i)
    if (std::abs(model.restNodes[i].x() - 0.03) < std::abs(model.restNodes[middle].x() - 0.03)) middle = i;
  const Loads loads = holding(world, 1, middle, {0, -0.03, 0});
  for (int k = 0; k < 5; ++k) world.advance(loads);
  EXPECT_LT(heightOf(1), before - 0.002);
}

// Nodes that were about to be carried again stay as they are.
TEST(Sleep, NodesOfASleeperStayWhereTheyAre) {
  BodyDescription held = rod("held", Vector3d::Zero());
  held.surface = SurfaceMode::contact;
  held.fixed = {{0, FixedFreedom::all}, {1, FixedFreedom::all}, {2, FixedFreedom::all}, {3, FixedFreedom::all}};
  World world(settings(0.05), {held});
  for (int k = 0; k < 20; ++k) world.advance(holding(world, 0, 20, {0, 0, 0.0005}));
  for (int k = 0; k < 40 && !world.data().rest[0].asleep; ++k) world.advance({});
  ASSERT_TRUE(world.data().rest[0].asleep);
  DynamicsFrame before, after;
  world.readFrame(before);
  run(world, 0.5);
  world.readFrame(after);
  EXPECT_EQ(before.bodies[0].nodes, after.bodies[0].nodes);
}

// Contacts go on with the impulses that they had: nothing sinks in or jumps.
TEST(Sleep, WakingMovesNothing) {
  World world = stackedRods(0.5);
  run(world, 3);
  DynamicsFrame before, after;
  world.readFrame(before);
  Loads loads = holding(world, 0, 20, Vector3d::Zero());
  loads.heldNodes[0].stiffness = loads.heldNodes[0].damping = 1e-9;
  for (int k = 0; k < 20; ++k) world.advance(loads);
  EXPECT_EQ(bodiesAwake(world), 2);
  world.readFrame(after);
  for (std::size_t b = 0; b < 2; ++b)
    for (std::size_t i = 0; i < before.bodies[b].nodes.size(); ++i)
      EXPECT_LT((before.bodies[b].nodes[i] - after.bodies[b].nodes[i]).norm(), 0.01 * kBallRadius);
}

TEST(Sleep, WhatFallsOnASleeperWakesIt) {
  for (const double sleepAfter : {0.5, 0.0}) {
    World world(settings(sleepAfter),
                {ball("low", kBallRadius, {0, kBallRadius, 0}), ball("high", kBallRadius, {0.004, 4, 0})},
                floorAtZero());
    const double contactAt = std::sqrt(2 * (4 - 3 * kBallRadius) / kGravity);
    run(world, contactAt - 0.05);
    EXPECT_EQ(world.data().rest[0].asleep, sleepAfter > 0);
    run(world, 0.1);
    EXPECT_FALSE(world.data().rest[0].asleep);
    // Pushed aside by the other one's weight and speed.
    EXPECT_LT(vectorOf(world.data().spheres.position[0]).x(), -0.001);
  }
}

// Struck in mid-frame, it has felt its weight for a part of it: its nodes hang under all of it, not under that part.
TEST(Sleep, WhatWakesInMidFrameHangsUnderItsWeight) {
  BodyDescription lying = rod("lying", {0, 0.0125, 0});
  lying.surface = SurfaceMode::contact;
  World world(settings(0.3), {lying, synthetic::ball("ball", 0.01, {0.03, 2.03, 0})}, floorAtZero());
  bool slept = false;
  while (!slept || world.data().rest[0].asleep) {
    slept = slept || world.data().rest[0].asleep;
    world.advance({});
    ASSERT_LT(world.time(), 2);
  }
  EXPECT_LT(vectorOf(world.data().surface.hanging[0]).y(), -0.8 * 9.81);
}

// In the first frame there is nothing yet to compare it with.
TEST(Sleep, NothingFallsAsleepAtOnce) {
  World world(settings(0.001), {synthetic::ball("ball", 0.01, {0, 1, 0})}, floorAtZero());
  world.advance({});
  EXPECT_FALSE(world.data().rest[0].asleep);
}

TEST(Sleep, WhatMovesOrIsDrivenStaysAwake) {
  BodyDescription pendulum = rod("pendulum", {0, 1, 0}), led = rod("led", {0, 2, 0}), loaded = rod("loaded", {0, 3, 0});
  pendulum.fixed = {{0, FixedFreedom::all}};
  pendulum.tissue.damping = 0;
  led.driven = {{}};
  loaded.fixed = {{0, FixedFreedom::all}, {1, FixedFreedom::all}, {2, FixedFreedom::all}, {3, FixedFreedom::all}};
  loaded.deadLoads = {{20, {0, 1e-6, 0}, 0, 1}};
  BodyDescription held = loaded;
  held.name = "held";
  held.worldFromModel.translation().y() = 4;
  held.deadLoads.clear();
  WorldSettings s = settings();
  s.contact = ContactMode::none;
  s.substeps = 0;
  World world(s, {pendulum, led, loaded, held});
  run(world, 2);
  for (int b = 0; b < 3; ++b) EXPECT_GT(world.dynamicNodes(b), 0) << world.bodies()[b].name;
  EXPECT_EQ(world.dynamicNodes(3), 0);
}

TEST(Sleep, ASpinningBallIsNotAtRest) {
  WorldSettings s = settings();
  s.gravity.setZero();
  World world(s, {ball("spinning", kBallRadius, {0, 1, 0})});
  setAngularVelocity(world.data(), 0, {0, 0.5, 0});
  run(world, 2);
  EXPECT_FALSE(world.data().rest[0].asleep);
}

TEST(Sleep, TheImplicitIntegratorKnowsNone) {
  WorldSettings s = settings();
  s.integrator = Integrator::implicit;
  s.substeps = 1;
  World world(s, {rod("rod", {0, 0.0125, 0})}, floorAtZero());
  run(world, 2);
  EXPECT_GT(world.dynamicNodes(0), 0);
}

// At a turning point what swings slowly keeps still for longer than that.
TEST(Sleep, NothingSleepsBeforeASwingOfItsOwnHasPassed) {
  BodyDescription slow = rod("slow", Vector3d::Zero());
  slow.tissue.young = 50;
  slow.tissue.damping = 5;
  slow.fixed = {{0, FixedFreedom::all}};
  WorldSettings s = settings(0.02);
  s.gravity = {0, -0.02, 0};
  World world(s, {slow});
  const double swing = 2 * std::numbers::pi / world.lowestFrequency(0);
  ASSERT_GT(swing, 0.3);
  while (world.time() + 0.01 < swing) {
    world.advance({});
    ASSERT_EQ(bodiesAwake(world), 1) << world.time() << " of " << swing << " s";
  }
}

}  // namespace medulla
