#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/dynamics/implicit_data.h"
#include "physics/model/build.h"
#include "tests/contact_bodies.h"
#include "tests/dynamics_states.h"
#include "tests/test_shapes.h"

// Contact inside implicit steps: what sticks stays, nothing bounces higher than it fell, nothing fast passes.
namespace medulla {

using Eigen::Vector3d;
using synthetic::ballBody;
using synthetic::ballModel;
using synthetic::throwBody;

constexpr double kRadius = 0.01, kGravity = 9.81;  // m, m/s2

static WorldSettings contactSettings(int order, const Vector3d& gravity = {0, -kGravity, 0}) {
  WorldSettings s;
  s.integrator = Integrator::implicit;
  s.order = order;
  s.gravity = gravity;
  s.frameDuration = 0.02;
  s.contact = ContactMode::balls;
  return s;
}

// Four balls in a square, linked; it does not roll.
static BodyDescription raft(const std::string& name, const Vector3d& position, double friction) {
  const double a = 0.02;
  const auto model =
      ballModel({{{-a, 0, -a}, kRadius}, {{a, 0, -a}, kRadius}, {{a, 0, a}, kRadius}, {{-a, 0, a}, kRadius}},
                {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 2}});
  BodyDescription body = ballBody(name, model, position, friction);
  body.tissue.young = 1e5;
  return body;
}

static BodyDescription rod(const std::string& name, const Vector3d& position) {
  return ballBody(name, ballModel({{{0, 0, 0}, kRadius}, {{0.03, 0, 0}, kRadius}}, {{0, 1}}), position, 0.2);
}

static StaticShape floorOf(double friction) {
  StaticShape floor;
  floor.friction = friction;
  return floor;
}

static void runUntil(World& world, double until) {
  while (world.time() < until - 1e-9) world.advance({});
}

static Vector3d placeOf(const World& world, int body) {
  const BodyRange& r = world.data().ranges[body];
  Vector3d sum = Vector3d::Zero();
  for (int i = 0; i < r.sphereCount; ++i) sum += vectorOf(world.data().spheres.position[r.firstSphere + i]);
  return sum / r.sphereCount;
}

static double totalEnergy(const World& world) {
  const Energies e = world.energies();
  return e.kinetic + e.elastic + e.gravity;
}

// A damper alone would let it down by g sin(a) h / (pi (2 + pi)), 1 mm/s.
TEST(ImplicitContact, ASlopeHoldsWithoutCreeping) {
  for (const int order : {1, 2}) {
    for (const int substeps : {1, 4}) {
      WorldSettings settings = contactSettings(order, kGravity * Vector3d(std::sin(0.35), -std::cos(0.35), 0));
      settings.substeps = substeps;
      World world(settings, {raft("raft", {0, kRadius, 0}, 0.5)}, {floorOf(0.5)});
      runUntil(world, 1);
      const Vector3d before = placeOf(world, 0);
      runUntil(world, 2);
      EXPECT_LT((placeOf(world, 0) - before).norm(), 1e-6) << "order " << order << ", " << substeps << " substeps";
    }
  }
}

// On a slope beyond the friction's angle what is thrown uphill stops, and comes down faster and faster.
TEST(ImplicitContact, WhatSlidesIsHeldBackByCoulombsFriction) {
  const double slope = 0.5, friction = 0.3, speed = 0.4;
  World world(contactSettings(1, kGravity * Vector3d(std::sin(slope), -std::cos(slope), 0)),
              {raft("raft", {0, kRadius, 0}, friction)}, {floorOf(friction)});
  throwBody(world, 0, {-speed, 0, 0});
  runUntil(world, 1);
  const double up = kGravity * (std::sin(slope) + friction * std::cos(slope)),
               down = kGravity * (std::sin(slope) - friction * std::cos(slope)), turn = speed / up;
  const double expected = -0.5 * speed * turn + 0.5 * down * (1 - turn) * (1 - turn);
  EXPECT_NEAR(placeOf(world, 0).x(), expected, 0.03 * expected);
}

// Balls on balls: without friction that holds they roll off each other, ever faster.
TEST(ImplicitContact, AStackStays) {
  for (const int order : {1, 2}) {
    std::vector<BodyDescription> bodies(3);
    for (int k = 0; k < 3; ++k)
      bodies[k] = raft("raft " + std::to_string(k), {1e-4 * (k == 1), (2 * k + 1) * kRadius, 5e-5 * (k == 2)}, 0.4);
    World world(contactSettings(order), bodies, {floorOf(0.4)});
    runUntil(world, 1);
    std::vector<Vector3d> before(3);
    for (int k = 0; k < 3; ++k) before[k] = placeOf(world, k);
    runUntil(world, 8);
    for (int k = 0; k < 3; ++k) EXPECT_LT((placeOf(world, k) - before[k]).norm(), 1e-5) << order << ", raft " << k;
  }
}

TEST(ImplicitContact, AThrownHeapComesToRest) {
  for (const int order : {1, 2}) {
    std::vector<BodyDescription> bodies(4);
    for (int k = 0; k < 4; ++k)
      bodies[k] = raft("raft " + std::to_string(k), {0.01 * k, 0.03 + 0.03 * k, 0.007 * k}, 0.5);
    World world(contactSettings(order), bodies, {floorOf(0.5)});
    for (int k = 0; k < 4; ++k) throwBody(world, k, {0.6 - 0.3 * k, -0.5 * k, 0.2 * k});
    runUntil(world, 4);
    EXPECT_LT(world.energies().kinetic, 1e-15) << "order " << order;
  }
}

// Where many contacts slide and stick by turns, the derivative at Coulomb's limit overshoots at one or other of them in
// every iteration, and steps were halved: 31 systems a step, 22 since.
TEST(ImplicitContact, ASlidingHeapIsSolvedInFewIterations) {
  std::vector<BodyDescription> bodies;
  bodies.reserve(12);
  for (int k = 0; k < 12; ++k)
    bodies.push_back(raft("raft " + std::to_string(k), {0.013 * (k % 3), 0.03 + 0.025 * k, 0.011 * (k % 4)}, 0.4));
  World world(contactSettings(1), bodies, {floorOf(0.4)});
  for (int k = 0; k < 12; ++k) throwBody(world, k, {0.6 - 0.1 * k, -0.5, 0.2 * (k % 3)});
  int steps = 0;
  for (; world.time() < 0.6; ++steps) world.advance({});
  long solves = 0;
  for (const auto& part : world.data().implicit)
    if (part != nullptr) solves += part->solves;
  EXPECT_LT(solves, 25 * steps * world.substepsPerFrame());
}

// A tissue's contact is damped critically: restitution 0.05. What comes back is asked for after whatever part of a step
// the touch falls into.
TEST(ImplicitContact, NothingBouncesHigh) {
  for (const int order : {1, 2}) {
    for (const double height : {0.1, 0.31, 0.7, 1.016, 1.023, 1.03, 2.0}) {
      World world(contactSettings(order), {synthetic::ball("ball", 0.03, {0, 0.03 + height, 0})}, {floorOf(0.2)});
      const double falling = std::sqrt(2 * height / kGravity), speed = kGravity * falling;
      runUntil(world, falling + 0.01);
      double highest = 0;
      for (int k = 0; k < 40; ++k) {
        world.advance({});
        highest = std::max(highest, placeOf(world, 0).y() - 0.03);
      }
      EXPECT_LT(std::sqrt(2 * kGravity * highest), 0.3 * speed) << "order " << order << ", from " << height;
      EXPECT_NEAR(placeOf(world, 0).y(), 0.03, 1e-3) << "order " << order << ", from " << height;
    }
  }
}

// Rolling on a slope: g sin / (1 + 2/5), whatever backward Euler's tangents would take off its spin.
TEST(ImplicitContact, ABallRollsDownAsFastAsItShould) {
  const double slope = 0.2;
  World world(contactSettings(1, kGravity * Vector3d(std::sin(slope), -std::cos(slope), 0)),
              {synthetic::ball("ball", 0.02, {0, 0.02, 0}, 0.5)}, {floorOf(0.5)});
  runUntil(world, 1);
  EXPECT_NEAR(placeOf(world, 0).x(), 0.5 * kGravity * std::sin(slope) / 1.4, 0.02);
}

static Vector3d spinOf(const World& world) {
  return vectorOf(world.data().spheres.angularVelocity[0]);
}

// Contact and gravity act through the centre: nothing turns, whichever way the velocity does.
TEST(ImplicitContact, AnObliqueFallDoesNotSpin) {
  for (const int order : {1, 2}) {
    World world(contactSettings(order), {synthetic::ball("ball", 0.02, {0, 0.12, 0}, 0)}, {floorOf(0)});
    throwBody(world, 0, {0.4, 0.3, 0});
    runUntil(world, 0.12);
    EXPECT_LT(spinOf(world).norm(), 1e-6) << "flying, order " << order;
    EXPECT_NEAR(vectorOf(world.data().spheres.velocity[0]).x(), 0.4, 1e-9) << "flying, order " << order;
    runUntil(world, 0.5);
    EXPECT_LT(spinOf(world).norm(), 1e-3) << "landed, order " << order;
    EXPECT_NEAR(vectorOf(world.data().spheres.velocity[0]).x(), 0.4, 1e-6) << "landed, order " << order;
  }
}

// A contact is stiffer than the tissue behind it, however light the sphere and long the step: 0.4 kg on 3 g each.
// Impulses act at a contact's two ends, which part by the slip within a stage: a couple of .2 to .5 % of all angular
// momentum in such a hit.
TEST(ImplicitContact, AnObliqueHitKeepsAngularMomentum) {
  for (const int order : {1, 2}) {
    for (const double friction : {0.0, 0.5}) {
      WorldSettings settings = contactSettings(order, Vector3d::Zero());
      settings.substeps = 4;
      BodyDescription a = synthetic::body(synthetic::shortTube(), 6e3);
      a.name = "a";
      a.surface = SurfaceMode::skin;
      a.tissue.friction = friction;
      BodyDescription b = a;
      b.name = "b";
      b.worldFromModel = Eigen::Translation3d(0.04, 0.027, 0) * Eigen::AngleAxisd(1.2, Vector3d::UnitY());
      World world(settings, {a, b});
      throwBody(world, 0, {0.2, 0.5, 0});
      throwBody(world, 1, {-0.3, -0.5, 0.1});
      const states::Momentum before = states::momentum(world.data());
      runUntil(world, 0.2);
      const states::Momentum after = states::momentum(world.data());
      EXPECT_GT((vectorOf(world.data().spheres.velocity[0]) - Vector3d(0.2, 0.5, 0)).norm(), 0.1);  // they have hit
      EXPECT_LT((after.linear - before.linear).norm(), 1e-12 * before.linearScale);
      EXPECT_LT((after.angular - before.angular).norm(), 1e-5 * before.angularScale) << order << ", " << friction;
    }
  }
}

TEST(ImplicitContact, LightBodiesBearAHeavyOne) {
  std::vector<BodyDescription> bodies{raft("light", {0, kRadius, 0}, 0.5), raft("heavy", {0, 3 * kRadius, 0}, 0.5)};
  bodies[1].tissue.density = 25e3;
  World world(contactSettings(1), bodies, {floorOf(0.5)});
  runUntil(world, 2);
  EXPECT_LT(world.penetration().bodies, 3);
  EXPECT_LT(world.penetration().statics, 3);
}

// A ball whose mass lies beside its centre rolls to and fro: contact's lever turns with it.
TEST(ImplicitContact, RollingGainsNoEnergy) {
  auto model = ballModel({{{0, 0, 0}, 0.03}});
  model->spheres[0].restFrame = {0.006, 0, 0};
  WorldSettings settings = contactSettings(1);
  settings.frameDuration = 0.005;
  settings.substeps = 1;
  World world(settings, {ballBody("ball", model, {0, 0.03, 0}, 0.5)}, {floorOf(0.5)});
  throwBody(world, 0, {0.2, 0, 0});
  runUntil(world, 0.5);
  double least = totalEnergy(world);
  for (int k = 0; k < 600; ++k) {
    world.advance({});
    EXPECT_LT(totalEnergy(world), least + 1e-3 * world.energies().kinetic);
    least = std::min(least, totalEnergy(world));
  }
}

// Stiff tissue that rolls down a slope turns by half a radian in a step at last: on their tangents its nodes would lie
// far from its shape, and it lost all its speed.
TEST(ImplicitContact, AStiffBallRollsOn) {
  constexpr double kBall = 0.01, kPull = 2, kTime = 0.8;  // m, m/s2, s
  BuildSettings build;
  build.spheres = 1;
  BuildReport report;
  const auto model = std::make_shared<SoftBodyModel>(
      buildModel(asRepaired(ellipsoidMesh(2, {kBall, kBall, kBall})), nullptr, build, report));
  BodyDescription body = ballBody("ball", model, {0, kBall, 0}, 0.5);
  body.tissue.young = 1e7;
  WorldSettings settings = contactSettings(1, {kPull, -kGravity, 0});
  settings.substeps = 4;
  World world(settings, {body}, {floorOf(0.5)});
  runUntil(world, kTime);
  const double rolled = kPull / 1.4 * kTime;
  EXPECT_NEAR(vectorOf(world.data().spheres.velocity[0]).x(), rolled, 0.04 * rolled);
}

TEST(ImplicitContact, NothingFastPassesAThinBox) {
  StaticShape box;
  box.kind = StaticShape::Kind::box;
  box.size = {0.2, 0.004, 0.2};
  for (const int order : {1, 2}) {
    for (const double speed : {6.3, 25.0}) {
      for (int k = 0; k < 8; ++k) {  // the step's length of the way, in eighths
        World world(contactSettings(order, Vector3d::Zero()), {rod("rod", {0, 0.1 + speed * 0.005 * k / 8, 0})}, {box});
        throwBody(world, 0, {0, -speed, 0});
        runUntil(world, 0.1);
        EXPECT_GT(placeOf(world, 0).y(), 0.002 + 0.5 * kRadius) << "order " << order << ", " << speed << " m/s, " << k;
      }
    }
  }
}

TEST(ImplicitContact, FastBodiesDoNotPassEachOther) {
  for (const int order : {1, 2}) {
    for (int k = 0; k < 8; ++k) {
      const double speed = 5;
      World world(contactSettings(order, Vector3d::Zero()),
                  {rod("left", {0, 0.1, 0}), rod("right", {0, -0.1 - speed * 0.005 * k / 8, 0})});
      throwBody(world, 0, {0, -speed, 0});
      throwBody(world, 1, {0, speed, 0});
      runUntil(world, 0.1);
      EXPECT_GT(placeOf(world, 0).y(), placeOf(world, 1).y() + kRadius) << "order " << order << ", " << k;
    }
  }
}

// What has left the picture does not halve the steps of those that stay, or these would be damped otherwise, and a run
// take tens of times as long. What still comes near does.
TEST(ImplicitContact, WhatFliesAwayHalvesNoStepOfOthers) {
  const auto lengthsOfSteps = [](const Vector3d& place, const Vector3d& velocity) {
    World world(contactSettings(1),
                {raft("r", {0, 0.05, 0}, 0.3), ballBody("b", ballModel({{{0, 0, 0}, kRadius}}), place)},
                {floorOf(0.3)});
    throwBody(world, 1, velocity);
    runUntil(world, 0.2);
    return world.data().implicit.size();
  };
  EXPECT_EQ(lengthsOfSteps({3, 5, 0}, {20, 20, 0}), 1);
  EXPECT_GT(lengthsOfSteps({1, 1.05, 0.1}, {-20, -20, 0}), 1);
}

TEST(ImplicitContact, NorDoesADrivenOnePassWhatLiesInItsWay) {
  for (int k = 0; k < 8; ++k) {
    const double speed = 8;
    const auto one = [](const std::string& name, double y) {
      return ballBody(name, ballModel({{{0, 0, 0}, kRadius}}, {}), {0, y, 0}, 0.2);
    };
    BodyDescription driven = one("driven", 0.1 + speed * 0.005 * k / 8);
    driven.driven = {DrivenSphere{.sphere = 0, .velocity = {0, -speed, 0}}};
    World world(contactSettings(1, Vector3d::Zero()), {driven, one("resting", 0)});
    runUntil(world, 0.06);
    EXPECT_LT(placeOf(world, 1).y(), placeOf(world, 0).y() - kRadius) << k;
  }
}

// What friction has taken in, F^2 / (2 k) with k = pi (2 + pi) m / T^2 of each contact, is all that it may give back.
TEST(ImplicitContact, FrictionThatHeldGivesBackNoMoreThanItTookIn) {
  const double slope = 0.35;
  BodyDescription soft = raft("raft", {0, kRadius, 0}, 0.5);
  soft.tissue.young = 1.5e4;  // ten times E r is less than that k, and the raft gives way a little
  World world(contactSettings(1, kGravity * Vector3d(std::sin(slope), -std::cos(slope), 0)), {soft}, {floorOf(0.5)});
  runUntil(world, 1);
  double stored = 0;
  for (const HeldFriction& held : world.data().contact.held) stored += held.energy;
  const double mass = 4 * world.data().spheres.groups[0].mass[0], along = kGravity * std::sin(slope), step = 0.005;
  EXPECT_NEAR(stored, mass * along * along * step * step / (2 * std::numbers::pi * (2 + std::numbers::pi)),
              0.3 * stored);
  const double before = totalEnergy(world) - world.energies().gravity;
  world.data().gravity = quadOf({0, -kGravity * std::cos(slope), 0});
  for (int k = 0; k < 10; ++k) {
    world.advance({});
    EXPECT_LT(totalEnergy(world) - world.energies().gravity, before + 1.1 * stored);
  }
}

TEST(ImplicitContact, TheHashKnowsWhatFrictionHoldsWith) {
  World world(contactSettings(1), {raft("raft", {0, kRadius, 0}, 0.5)}, {floorOf(0.5)});
  runUntil(world, 0.1);
  ASSERT_FALSE(world.data().contact.held.empty());
  const std::uint64_t before = world.stateHash();
  world.data().contact.held[0].force.v[0] += 1e-9;
  EXPECT_NE(world.stateHash(), before);
}

}  // namespace medulla
