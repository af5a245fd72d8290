#include "haptics/tissue_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

#include "physics/dynamics/world.h"
#include "tests/synthetic_model.h"
#include "tests/tool_run.h"

namespace medulla {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Light tissue: it is where its springs want it within a small part of a frame.
static ToolRun lightTissue() {
  ToolRun run{SpringBody(ellipsoid(24, 20, 7, 0.3)), {}, {}, 24, 1.0 / 1200, {}};
  run.body.mass = 2e-4;
  run.body.groundDamping = 0.08;
  run.body.edgeDamping = 0.06;
  return run;
}

// N, of every tick, on a hand that comes down on tissue, presses, and with `grips` takes hold of it and lifts it.
static std::vector<Vector3d> feltForces(int dynamicsRate, double give, bool grips) {
  ToolRun run = lightTissue();
  run.ticksPerFrame = 1200 / dynamicsRate;
  run.give.assign(run.body.shape->restNodes.size(), NodeGive{give});
  run.device = [=](double t) {
    const double lift = grips ? 0.01 * ease(t, 0.3, 0.2) : 0;
    return deviceAt({0.012, 0.004, 0.0585 - std::min(0.008, 0.05 * t) + lift}, grips && t > 0.3 ? 1 : 0);
  };
  std::vector<Vector3d> forces;
  run.run(0.6, [&](double, const ToolState& tool) { forces.push_back(tool.force); });
  return forces;
}

static double rmsDifference(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]).squaredNorm();
  return std::sqrt(sum / double(a.size()));
}

TEST(TissueMotion, WhatTissueGivesBringsTheForceNearThatOfShortFrames) {
  const double give = 1 / lightTissue().body.ground;
  for (const bool grips : {false, true}) {
    const std::vector<Vector3d> fine = feltForces(300, give, grips);
    const double with = rmsDifference(feltForces(50, give, grips), fine),
                 without = rmsDifference(feltForces(50, 0, grips), fine);
    std::printf("[  reached ] %s: off the force of short frames by %.3g N, %.3g N without give\n",
                grips ? "grip" : "press", with, without);
    EXPECT_LT(with, 0.5 * without);
  }
}

TEST(TissueMotion, AtASteadySpeedTheStepsAreTheWholeLead) {
  DeviceMotion device;
  device.velocity = {0, -0.05, 0};
  device.follows = {0.9, 0.7};
  device.way.fill(0.02 * device.velocity);
  BlendedSurface surface;
  surface.duration = 0.02;
  surface.triangles = {{0, 1, 2}};
  surface.from = surface.to = {{0, 0, 0}, {0, 0, 0.01}, {0.01, 0, 0}};
  surface.give.assign(3, NodeGive{0.1});
  for (auto& steps : surface.steps) steps.assign(3, 0.9 * device.way[0]);
  ProxyContact contact;
  contact.triangle = 0;
  contact.weights = {0.2, 0.3, 0.5};
  contact.share = 1;
  Grip grip;
  grip.held = {{0, Vector3d::Zero(), 0.5}, {1, Vector3d::Zero(), 0.5}};
  for (const double alpha : {0.25, 0.5, 1.0}) {
    device.way[0] = alpha * device.way[1];
    for (const TissueMotion& motion : {contactMotion(surface, alpha, {&contact, 1}, Vector3d::UnitY(), device),
                                       heldMotion(surface, alpha, grip, device)}) {
      EXPECT_LT((motion.lead - surface.steps[0][0]).norm(), 1e-15);
      EXPECT_LT((motion.velocity - surface.steps[0][0] / 0.02).norm(), 1e-13);
    }
  }
}

struct TouchedTriangle {
  BlendedSurface surface;
  ProxyContact contact;
};

// At its first corner; `give` in m/N.
static TouchedTriangle touchedTriangle(double give) {
  TouchedTriangle out;
  out.surface.duration = 0.02;
  out.surface.triangles = {{0, 1, 2}};
  out.surface.give.assign(3, NodeGive{give});
  for (auto& steps : out.surface.steps) steps.assign(3, Vector3d::Zero());
  out.contact.triangle = 0;
  out.contact.weights = {1, 0, 0};
  out.contact.share = 1;
  return out;
}

TEST(TissueMotion, AtFirstTouchTissueFollowsByThePartThatItsGiveTells) {
  const TouchedTriangle touched = touchedTriangle(0.01);
  const BlendedSurface& surface = touched.surface;
  const ProxyContact& contact = touched.contact;
  DeviceMotion device;
  beginContact(surface, 0.5, contact, Vector3d::UnitY(), 400, device);
  device.velocity = {0.03, -0.05, 0};
  const double part = 400 * 0.01 / (1 + 400 * 0.01);
  const auto lead = [&](double alpha) {
    return contactMotion(surface, alpha, {&contact, 1}, Vector3d::UnitY(), device).lead;
  };
  device.way[0] = {0, -3e-4, 0};
  EXPECT_LT((lead(0.8) - part * Vector3d(0, -3e-4, 0)).norm(), 1e-15);
  device.way[0] = {0, -5e-4, 0};
  const Vector3d end = lead(1);
  startFrame(Vector3d::Zero(), surface.duration, device);
  EXPECT_LT((lead(1e-9) - end).norm(), 1e-11);  // no step from frame to frame
}

// A push on the middle of a triangle is shared by three nodes, each of which gives a ninth of its own; what carries
// them all goes along with the whole push.
TEST(TissueMotion, WhatCarriesNodesGivesByTheWholePush) {
  TouchedTriangle touched = touchedTriangle(0);
  touched.surface.give.assign(3, {0.009, 0.002});
  touched.contact.weights.setConstant(1.0 / 3);
  DeviceMotion device;
  beginContact(touched.surface, 1, touched.contact, Vector3d::UnitY(), 400, device);
  const double give = 0.003 + 0.002;
  EXPECT_NEAR(device.followsAtOnce, 400 * give / (1 + 400 * give), 1e-12);
}

// A device that goes on as it did, and tissue that follows by its part: whenever the contact began, the steps are the
// whole lead in that frame and in the next.
TEST(TissueMotion, TissueThatAlreadyMovesIsTouchedWithoutAStepInItsLead) {
  const double part = 400 * 0.01 / (1 + 400 * 0.01);
  const Vector3d way(0, -1e-3, 0);  // of the device in a frame
  BlendedSurface surface;
  surface.duration = 0.02;
  surface.triangles = {{0, 1, 2}};
  surface.give = {NodeGive{0.01}, {}, {}};
  for (auto& steps : surface.steps) steps.assign(3, part * way);
  ProxyContact contact;
  contact.triangle = 0;
  contact.weights = {1, 0, 0};
  contact.share = 1;
  for (const double began : {0.1, 0.5, 0.9, 1.0}) {
    DeviceMotion device;
    beginContact(surface, began, contact, Vector3d::UnitY(), 400, device);
    device.velocity = way / surface.duration;
    const auto lead = [&](double alpha) {
      return contactMotion(surface, alpha, {&contact, 1}, Vector3d::UnitY(), device).lead;
    };
    device.way[0] += (1 - began) * way;
    EXPECT_LT((lead(1) - part * way).norm(), 1e-15) << began;
    startFrame(Vector3d::Zero(), surface.duration, device);
    for (const double alpha : {0.05, 0.3, 0.5, 0.75, 0.95, 1.0}) {
      device.way[0] = alpha * way;
      EXPECT_LT((lead(alpha) - part * way).norm(), 1e-15) << began << " " << alpha;
    }
  }
}

// Held tissue that drifts on its own and answers a part of what a device adds to its way.
static double followedAfter(double answered, double atOnce, int frames) {
  BlendedSurface surface;
  surface.duration = 0.02;
  for (auto& steps : surface.steps) steps.assign(1, Vector3d::Zero());
  Grip grip;
  grip.held = {{0, Vector3d::Zero()}};
  grip.give = atOnce / (1 - atOnce) / 400;
  DeviceMotion device;
  beginHold(surface, 1, grip, 400, device);
  for (int frame = 0; frame < frames; ++frame) {
    const Vector3d way(1e-4 * std::sin(0.4 * frame), 2e-4 * std::cos(0.3 * frame), 0);
    device.way[0] += way;
    startFrame(Vector3d::Zero(), surface.duration, device);
    surface.steps = {{{Vector3d(3e-5, 0, -4e-5) + answered * way}, surface.steps[0], surface.steps[1]}};
    learnFollowing(surface, grip, device);
  }
  return device.follows[0];
}

TEST(TissueMotion, HowFarHeldTissueFollowsIsSeenFromItsSteps) {
  EXPECT_NEAR(followedAfter(0.9, 0.5, 0), 0.5, 1e-12);  // by its give
  EXPECT_NEAR(followedAfter(0.9, 0.5, 40), 0.9, 1e-3);
  EXPECT_NEAR(followedAfter(0.9, 0, 40), 0.9, 1e-3);
  EXPECT_NEAR(followedAfter(0.3, 0.5, 3), 0.5, 1e-12);   // not less than what it gives at once, which late steps hide;
  EXPECT_NEAR(followedAfter(0.3, 0.5, 40), 0.4, 1e-12);  // then half as stiff again at most
  EXPECT_NEAR(followedAfter(1.2, 0.5, 40), 1, 1e-12);    // nor beyond the device
}

// m: by how much what a still grip holds leads, after so many frames of steps.
static Vector3d leadAfter(int frames, const std::function<Vector3d(int)>& step, double alpha) {
  BlendedSurface surface;
  surface.duration = 0.02;
  for (auto& steps : surface.steps) steps.assign(1, Vector3d::Zero());
  Grip grip;
  grip.held = {{0, Vector3d::Zero()}};
  DeviceMotion device;
  beginHold(surface, 1, grip, 400, device);
  for (int frame = 0; frame < frames; ++frame) {
    startFrame(Vector3d::Zero(), surface.duration, device);
    surface.steps = {{{step(frame)}, surface.steps[0], surface.steps[1]}};
    learnFollowing(surface, grip, device);
  }
  return heldMotion(surface, alpha, grip, device).lead;
}

// With four frames to its period twice the last step less the one before is 2.2 times as large, a quarter late.
TEST(TissueMotion, WhatVibratesInAStillGripIsFeltWhereItIs) {
  for (const double turn : {0.2, 0.7, 1.6, 2.8}) {
    const auto step = [&](int frame) {
      return Vector3d(3e-5 + 1e-4 * std::cos(turn * frame), 2e-4 * std::sin(turn * frame), -1e-5);
    };
    EXPECT_LT((leadAfter(40, step, 1) - step(40)).norm(), 1e-7) << turn;
    EXPECT_LT((leadAfter(40, step, 0) - step(39)).norm(), 1e-7) << turn;
  }
}

// Tissue that swings on its own, and that a way of 0.1 mm more presses by so much of the tool's stiffness more.
static double followedByForce(double series, double atOnce, int frames) {
  auto [surface, contact] = touchedTriangle(atOnce / (1 - atOnce) / 400);
  DeviceMotion device;
  beginContact(surface, 0, contact, Vector3d::UnitY(), 400, device);
  for (int frame = 0; frame < frames; ++frame) {
    const Vector3d way(0, -1e-4, 0);
    device.way[0] += way;
    startFrame(Vector3d::Zero(), surface.duration, device);
    surface.steps[1] = surface.steps[0];
    surface.steps[0].assign(3, Vector3d(0, 9e-5 * std::sin(frame), 0));
    learnFollowing(surface, {&contact, 1}, Vector3d::UnitY(), 400, series * 400 * way.norm(), device);
  }
  return device.follows[0];
}

TEST(TissueMotion, HowFarTouchedTissueFollowsIsSeenFromItsForce) {
  EXPECT_NEAR(followedByForce(0.01, 0.5, 0), 0.5, 1e-12);
  EXPECT_NEAR(followedByForce(0.01, 0.5, 20), 0.985, 3e-3);  // half as much again, to be safe
  EXPECT_NEAR(followedByForce(0.8, 0.5, 3), 0.5, 1e-12);     // not less than what it gives at once
  EXPECT_NEAR(followedByForce(0.8, 0.5, 20), 0.4, 1e-12);    // half as stiff again at most
}

// A touch late in a frame: what the tissue's own swing changed by is many times what the touch moved it, and says that
// it follows all the way. It felt like nothing for a frame, where a liver that swung back was met.
TEST(TissueMotion, AFrameThatEndsAsItTouchesTellsNothing) {
  for (const double since : {0.3, 0.9}) {
    auto [surface, contact] = touchedTriangle(1 / 400.0);  // follows by a half at once
    DeviceMotion device;
    surface.steps[0].assign(3, Vector3d(0, 3e-4, 0));
    beginContact(surface, since, contact, Vector3d::UnitY(), 400, device);
    device.way[0] += Vector3d(0, -(1 - since) * 2e-3, 0);
    startFrame(Vector3d::Zero(), surface.duration, device);
    surface.steps[1] = surface.steps[0];
    surface.steps[0].assign(3, Vector3d(0, -8e-4, 0));
    learnFollowing(surface, {&contact, 1}, Vector3d::UnitY(), 400, 1e-3, device);
    if (since > 0.5)
      EXPECT_NEAR(device.follows[0], 0.5, 1e-12);
    else
      EXPECT_GT(device.follows[0], 0.7);
  }
}

// A shake of which the hand feels a mass and a damper too much, `late` frames after the tissue gave it; N, RMS of what
// is left of that over the frames from `first` on, and of all of it.
static std::array<double, 2> leftOfError(int first, int frames, int late, const std::function<Vector2d(int)>& perWay) {
  constexpr double kDuration = 0.02, kTurn = 0.6;  // s; per frame
  const auto waysOf = [](int frame) {
    WayAndChange ways;
    ways << 1e-3 * std::sin(kTurn * frame), 5e-4 * std::cos(kTurn * frame), 0, 2e-4 * std::cos(kTurn * frame), 0, 0;
    return ways;
  };
  const auto gave = [](int frame) { return Vector3d(0.1 * std::cos(0.2 * frame), 0.05, 0); };
  MotionError error;
  double left = 0, all = 0;
  for (int frame = 0; frame < frames; ++frame) {
    const WayAndChange ways = waysOf(frame);
    const Vector3d off = ways * perWay(frame);
    for (int tick = 0; tick < 4; ++tick) noteFelt(gave(frame) + off, ways, error);
    if (frame >= first) {
      left += (off - motionError(ways, 1, error)).squaredNorm();
      all += off.squaredNorm();
    }
    learnMotionError(gave(frame - late), 4, late, kDuration, error);
  }
  return {std::sqrt(left / (frames - first)), std::sqrt(all / (frames - first))};
}

TEST(MotionError, WhatAMotionAddsIsTakenOffOnceItHasBeenForetold) {
  const auto steady = [](int) { return Vector2d(40, -300); };
  for (const int late : {0, 1}) {
    const auto [left, all] = leftOfError(20, 60, late, steady);
    EXPECT_LT(left, 0.05 * all);
    EXPECT_LT(leftOfError(0, 20, late, steady)[0], all);
  }
  // What changes its sign from frame to frame cannot be foretold, and nothing is taken off.
  const auto [left, all] = leftOfError(20, 60, 0, [](int frame) { return Vector2d(frame % 2 == 0 ? 40 : -40, 0); });
  EXPECT_NEAR(left, all, 1e-3 * all);
}

TEST(MotionError, AFrameThatWasNotFeltThroughoutTeachesNothing) {
  MotionError error;
  WayAndChange ways = WayAndChange::Constant(1e-3);
  for (int frame = 0; frame < 10; ++frame) {
    noteFelt(Vector3d::UnitX(), ways, error);
    learnMotionError(Vector3d::Zero(), 2, 0, 0.02, error);
  }
  EXPECT_EQ(motionError(ways, 1, error).norm(), 0);
}

}  // namespace medulla
