#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "tests/contact_bodies.h"

// One ball strikes another that lies before what does not move.
namespace medulla {

using Eigen::Vector3d;
using synthetic::ball;

namespace {

constexpr double kStruckRadius = 0.01;

// Substeps as the world chooses them, 10 ms where nothing gives; the struck ball lies above the box.
WorldSettings settings(const Vector3d& gravity = Vector3d::Zero()) {
  WorldSettings s;
  s.contact = ContactMode::balls;
  s.gravity = gravity;
  s.frameDuration = 0.02;
  return s;
}

StaticShape boxBelowZero(double thickness) {
  StaticShape box;
  box.kind = StaticShape::Kind::box;
  box.size = Vector3d(1, thickness, 1);
  box.worldFromShape.translation() = Vector3d(0, -0.5 * thickness, 0);
  return box;
}

// m: the lowest that the struck ball comes below where it touches.
double sinks(World& world, int frames) {
  double lowest = 0;
  for (int k = 0; k < frames; ++k) {
    world.advance({});
    lowest = std::min(lowest, world.data().spheres.position[0].v[1] - kStruckRadius);
  }
  return -lowest;
}

}  // namespace

// A hair before the box it does not close on it by itself, and used to be pushed into it, or through.
TEST(ContactBlow, WhatIsStruckStopsAtWhatItIsPushedAgainst) {
  for (const double speed : {1., 2.5, 5., 8.}) {
    double touching = 0;
    for (const double gap : {-1e-5, 1e-5, 1e-4, 1e-3}) {
      World world(settings(),
                  {ball("struck", kStruckRadius, {0, kStruckRadius + gap, 0}), ball("striking", 0.02, {0, 0.0701, 0})},
                  {boxBelowZero(0.02)});
      synthetic::throwBody(world, 1, {0, -speed, 0});
      const double depth = sinks(world, 25);
      if (gap < 0) touching = depth;
      EXPECT_LT(depth, std::max(1.1 * touching, 0.15 * kStruckRadius)) << gap << " m, " << speed << " m/s";
    }
    EXPECT_LT(touching, 0.5 * kStruckRadius);
  }
}

// Near enough to be listed, and half a millimetre apart when it passes.
TEST(ContactBlow, WhatPassesByIsNotTurnedAside) {
  World world(settings(), {ball("near", kStruckRadius, {0, 0, 0}),
                           ball("passing", kStruckRadius, {-0.1, 2.05 * kStruckRadius, 0})});
  synthetic::throwBody(world, 1, {8, 0, 0});
  for (int k = 0; k < 5; ++k) world.advance({});
  const Eigen::Vector3d v = vectorOf(world.data().spheres.velocity[1]);
  EXPECT_NEAR((v - Vector3d(8, 0, 0)).norm(), 0, 1e-12);
}

// What comes aslant passes beside that place of a rod which is nearest to it now, and hits another.
TEST(ContactBlow, WhatFallsOnASlopingLinkDoesNotPassIt) {
  const auto rod =
      synthetic::ballModel({{{-0.04, 0.04, 0}, kStruckRadius}, {{0.04, -0.04, 0}, kStruckRadius}}, {{0, 1}});
  for (const double speed : {3.5, 6.5, 9.0}) {
    double deepest = 0;
    for (int k = 0; k < 20; ++k) {
      BodyDescription held = synthetic::ballBody("held", rod, Vector3d::Zero());
      held.fixed = {{0}, {1}};
      WorldSettings swept = settings();
      swept.contact = ContactMode::swept;
      World world(swept, {held, ball("falling", 0.006, {0.003, 0.5 + 0.007 * k, 0})});
      synthetic::throwBody(world, 1, {0, -speed, 0});
      for (int frame = 0; frame < 12; ++frame) world.advance({});
      deepest = std::max(deepest, world.penetration().bodies);
    }
    EXPECT_LT(deepest, 20) << speed;
  }
}

// Of sleepers no contact with what bears them is listed: before a blow they wake.
TEST(ContactBlow, ASleeperThatIsStruckStandsOnWhatBearsIt) {
  for (const double height : {0.1, 0.3, 0.5}) {
    double depth[2] = {0, 0};
    for (const double sleepAfter : {0., 0.3}) {
      WorldSettings s = settings({0, -9.81, 0});
      s.sleepAfter = sleepAfter;
      const double start = 2 * kStruckRadius + 0.015 + height;
      World world(s, {ball("struck", kStruckRadius, {0, kStruckRadius, 0}), ball("falling", 0.015, {0, start, 0})},
                  {boxBelowZero(0.01)});
      for (int k = 0; k < 40; ++k) {  // held up until the other sleeps
        world.data().spheres.position[1].v[1] = start + (k % 2 == 0 ? 0 : 0.002);
        world.data().spheres.velocity[1].v[1] = 0;
        world.advance({});
      }
      ASSERT_EQ(world.data().rest[0].asleep, sleepAfter > 0);
      ASSERT_FALSE(world.data().rest[1].asleep);
      depth[sleepAfter > 0 ? 1 : 0] = sinks(world, 60);
    }
    EXPECT_LT(depth[1], std::max(1.5 * depth[0], 0.1 * kStruckRadius)) << height << " m";
  }
}

TEST(ContactBlow, ABodyWithoutNodesKeepsItsVolume) {
  const World world(settings(), {ball("bare", kStruckRadius, {0, 0, 0})});
  EXPECT_EQ(world.volumeRatio(0), 1);
}

// While two balls slide past each other all through a blow, what it gives across is the friction of the pair times what
// it gives along: of 0.9 and 0.1 the geometric mean, not the arithmetic one, 0.5, nor that of either.
TEST(ContactBlow, FrictionOfAPairIsTheGeometricMeanOfItsSides) {
  for (const auto& [first, second] : {std::pair{0.9, 0.1}, std::pair{0.1, 0.9}, std::pair{0.3, 0.3}}) {
    WorldSettings fine = settings();
    fine.frameDuration = 1e-4;
    fine.substeps = 1;
    World world(fine,
                {ball("a", kStruckRadius, {-0.020001, 0, 0}, first), ball("b", kStruckRadius, {0, 0, 0}, second)});
    const Vector3d before(0.05, 0.1, 0);
    synthetic::throwBody(world, 0, before);
    for (int k = 0; k < 100; ++k) world.advance({});
    const Vector3d given = before - vectorOf(world.data().spheres.velocity[0]);
    EXPECT_GT(given.x(), 0.02);
    EXPECT_NEAR(given.y() / given.x(), 0.3, 0.3 * 0.01) << first << ' ' << second;
    EXPECT_NEAR((vectorOf(world.data().spheres.velocity[1]) - given).norm(), 0, 1e-12);
    // Both are spun alike by a force at their surfaces.
    const double spin = given.y() / (0.4 * kStruckRadius);
    for (int i = 0; i < 2; ++i)
      EXPECT_NEAR(std::abs(vectorOf(world.data().spheres.angularVelocity[i]).z()), spin, 0.01 * spin);
  }
}

TEST(ContactBlow, PenetrationIsInPercentOfTheSmallerRadius) {
  for (const auto& [first, second] :
       {std::pair{kStruckRadius, 0.5 * kStruckRadius}, std::pair{0.5 * kStruckRadius, kStruckRadius}}) {
    World world(settings(), {ball("a", first, {0, 0, 0}), ball("b", second, {1.2 * kStruckRadius, 0, 0})});
    for (int k = 0; k < 10; ++k) world.advance({});
    EXPECT_NEAR(world.penetration().bodies, 60, 1e-9);  // at the start: 0.3 of 0.5 radii
  }
}

}  // namespace medulla
