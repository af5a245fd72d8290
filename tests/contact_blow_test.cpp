#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/contact_bodies.h"

// One ball strikes another that lies before what does not move.
namespace medulla {

using Eigen::Vector3d;
using synthetic::ball;

namespace {

constexpr double kRadius = 0.01;

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
    lowest = std::min(lowest, world.data().spheres.position[0].v[1] - kRadius);
  }
  return -lowest;
}

}  // namespace

// A hair before the box it does not close on it by itself, and used to be pushed into it, or through.
TEST(ContactBlow, WhatIsStruckStopsAtWhatItIsPushedAgainst) {
  for (const double speed : {1., 2.5, 5., 8.}) {
    double touching = 0;
    for (const double gap : {-1e-5, 1e-5, 1e-4, 1e-3}) {
      World world(settings(), {ball("struck", kRadius, {0, kRadius + gap, 0}), ball("striking", 0.02, {0, 0.0701, 0})},
                  {boxBelowZero(0.02)});
      synthetic::throwBody(world, 1, {0, -speed, 0});
      const double depth = sinks(world, 25);
      if (gap < 0) touching = depth;
      EXPECT_LT(depth, std::max(1.1 * touching, 0.15 * kRadius)) << gap << " m, " << speed << " m/s";
    }
    EXPECT_LT(touching, 0.5 * kRadius);
  }
}

// Near enough to be listed, and half a millimetre apart when it passes.
TEST(ContactBlow, WhatPassesByIsNotTurnedAside) {
  World world(settings(), {ball("near", kRadius, {0, 0, 0}), ball("passing", kRadius, {-0.1, 2.05 * kRadius, 0})});
  synthetic::throwBody(world, 1, {8, 0, 0});
  for (int k = 0; k < 5; ++k) world.advance({});
  const Eigen::Vector3d v = vectorOf(world.data().spheres.velocity[1]);
  EXPECT_NEAR((v - Vector3d(8, 0, 0)).norm(), 0, 1e-12);
}

// Of sleepers no contact with what bears them is listed: before a blow they wake.
TEST(ContactBlow, ASleeperThatIsStruckStandsOnWhatBearsIt) {
  for (const double height : {0.1, 0.3, 0.5}) {
    double depth[2] = {0, 0};
    for (const double sleepAfter : {0., 0.3}) {
      WorldSettings s = settings({0, -9.81, 0});
      s.sleepAfter = sleepAfter;
      const double start = 2 * kRadius + 0.015 + height;
      World world(s, {ball("struck", kRadius, {0, kRadius, 0}), ball("falling", 0.015, {0, start, 0})},
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
    EXPECT_LT(depth[1], std::max(1.5 * depth[0], 0.1 * kRadius)) << height << " m";
  }
}

TEST(ContactBlow, ABodyWithoutNodesKeepsItsVolume) {
  const World world(settings(), {ball("bare", kRadius, {0, 0, 0})});
  EXPECT_EQ(world.volumeRatio(0), 1);
}

}  // namespace medulla
