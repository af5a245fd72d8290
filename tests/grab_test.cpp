#include "haptics/grab.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <tuple>

#include "haptics/servo.h"
#include "tests/tool_run.h"

namespace medulla {

using Eigen::Vector3d;

static const Vector3d touch(0.012, 0.004, 0.0545);  // a little above the surface of the ellipsoid below

static ToolRun grabbing() {
  return ToolRun{SpringBody(ellipsoid(24, 20, 7, 0.3)), {}, {}, 24, 1.0 / 1200, {}};
}

static Vector3d approach(double t) {
  return touch - 0.006 * ease(t, 0, 0.3) * Vector3d::UnitZ();
}

TEST(Grab, ClosingInContactHoldsThePatchWithTheToolsStiffnessAndNoForceStep) {
  ToolRun run = grabbing();
  run.device = [](double t) { return deviceAt(approach(t), t > 0.5 ? 1 : 0); };
  Vector3d last = Vector3d::Zero();
  bool held = false;
  double step = 0;
  run.run(0.8, [&](double t, const ToolState& tool) {
    if (tool.holding && !held) step = (tool.force - last).norm();
    held = tool.holding;
    last = tool.force;
    EXPECT_EQ(tool.holding, t > 0.5);
  });
  EXPECT_GT(last.norm(), 0.1);
  EXPECT_LT(step, 0.02 * last.norm());
  EXPECT_TRUE(run.loads.toolSprings.empty());
  EXPECT_GE(run.loads.heldNodes.size(), 3U);
  double stiffness = 0;
  for (const HeldNode& held0 : run.loads.heldNodes) {
    stiffness += held0.stiffness;
    // Held nodes are those near the contact, which lies a radius below the proxy.
    EXPECT_LT((run.body.shape->restNodes[held0.node] - (approach(1) - run.tool.radius * Vector3d::UnitZ())).norm(),
              0.02);
  }
  EXPECT_NEAR(stiffness, run.tool.stiffness, 1e-9);
}

TEST(Grab, ClosingWhileItPressesAtSpeedHasNoForceStep) {
  constexpr double kSpeed = 0.04;  // m/s
  for (const double give : {0.0, 0.02}) {
    ToolRun run = grabbing();
    run.give.assign(run.body.shape->restNodes.size(), NodeGive{give});
    run.device = [=](double t) { return deviceAt(touch - kSpeed * t * Vector3d::UnitZ(), t > 0.15 ? 1 : 0); };
    Vector3d last = Vector3d::Zero();
    bool held = false;
    double step = 0;
    run.run(0.2, [&](double, const ToolState& tool) {
      if (tool.holding && !held) step = (tool.force - last).norm();
      held = tool.holding;
      last = tool.force;
    });
    ASSERT_TRUE(held);
    EXPECT_LT(step, 1.2 * run.tool.stiffness * kSpeed * run.tickDuration) << give;  // what a tick of the way adds
  }
}

TEST(Grab, TissueIsFeltWhereItIsByNowWhileItAccelerates) {
  constexpr double kFrame = 0.02, kTick = 1e-3, start = 0.1, acceleration = 2;  // s, m/s2
  const auto way = [](double t) { return 0.5 * acceleration * std::pow(std::max(0.0, t - start), 2); };
  const SurfaceMotion motion = [&](const Vector3d& x, double t) { return Vector3d(x + way(t) * Vector3d::UnitX()); };
  const TouchShape shape = plate(10, 0.03, 0.01, 5);
  ToolSettings tool;
  tool.damping = 0;
  tool.forceMax = tool.gripForceMax = 100;
  Servo servo({{shape}}, {tool}, kTick, frameAt(*shape, 0), {deviceAt({0.001, 0.02, 0.002})});
  for (int frame = 0; frame < 12; ++frame) {
    for (int k = 1; k <= 20; ++k) {
      servo.tick(k / 20.0, {deviceAt({0.001, 0.007, 0.002}, frame > 0 ? 1 : 0)});
      // The steps that it follows from are all of the steady acceleration.
      const double time = kFrame * frame + kTick * k;
      if (time < start + 4 * kFrame) continue;
      ASSERT_TRUE(servo.tools()[0].holding);
      ASSERT_NEAR(servo.tools()[0].force.x() / tool.stiffness, way(time), 0.126 * acceleration * kFrame * kFrame);
    }
    const double end = kFrame * (frame + 1);
    servo.commit(frameAt(*shape, end - kFrame, motion), frameAt(*shape, end, motion), servo.tools());
    ASSERT_TRUE(servo.beginFrame());
  }
}

// Of each node, with a contact `aside` (m) of the middle.
static std::vector<double> sharesHeld(double gripRadius, double aside) {
  ToolRun run = grabbing();
  run.tool.gripRadius = gripRadius;
  run.device = [=](double t) { return deviceAt(approach(t) + aside * Vector3d::UnitX(), t > 0.5 ? 1 : 0); };
  run.run(0.55);
  std::vector<double> shares(run.body.shape->restNodes.size(), 0);
  for (const HeldNode& held : run.loads.heldNodes) shares[held.node] = held.stiffness / run.tool.stiffness;
  return shares;
}

static double farthestApart(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.size(); ++k) most = std::max(most, std::abs(a[k] - b[k]));
  return most;
}

// A node that comes within the grip takes its share by and by: what is felt is no matter of micrometres.
TEST(Grab, NodesAtTheRimAreHeldByDegrees) {
  std::vector<double> before = sharesHeld(0.008, 0);
  for (int k = 1; k <= 40; ++k) {
    const std::vector<double> shares = sharesHeld(0.008 + 1e-4 * k, 0);
    EXPECT_LT(farthestApart(shares, before), 0.02) << k;
    before = shares;
  }
  before = sharesHeld(0.009, 0);
  for (int k = 1; k <= 40; ++k) {
    const std::vector<double> shares = sharesHeld(0.009, 1e-4 * k);  // over edges, too
    EXPECT_LT(farthestApart(shares, before), 0.04) << k;
    before = shares;
  }
}

TEST(Grab, ATinyGripStillHoldsTheTouchedTriangle) {
  ToolRun run = grabbing();
  run.tool.gripRadius = 1e-6;
  run.device = [](double t) { return deviceAt(approach(t), t > 0.5 ? 1 : 0); };
  run.run(0.7);
  EXPECT_EQ(run.loads.heldNodes.size(), 3U);
}

TEST(Grab, ClosingOnNothingHoldsNothingAndAClosedGripStillPresses) {
  ToolRun run = grabbing();
  run.device = [](double t) { return deviceAt(approach(t), 1); };
  bool contact = false;
  run.run(0.6, [&](double, const ToolState& tool) {
    EXPECT_FALSE(tool.holding);
    contact = tool.inContact;
  });
  EXPECT_TRUE(contact);
  EXPECT_FALSE(run.loads.toolSprings.empty());
}

TEST(Grab, AGripThatIsClosedWhenTheRunBeginsHoldsWhatItTouches) {
  ToolRun run = grabbing();
  run.device = [](double t) { return deviceAt(approach(1) + 0.02 * ease(t, 0.1, 0.5) * Vector3d::UnitZ(), 1); };
  run.run(0.8, [&](double, const ToolState& tool) { ASSERT_TRUE(tool.holding); });
  EXPECT_GE(run.loads.heldNodes.size(), 3U);
}

TEST(Grab, WhatItComesUponInTheVeryTickOfClosingIsHeldWithoutForceStep) {
  constexpr double kSpeed = 0.04;  // m/s
  const auto coming = [](double t) { return touch - kSpeed * t * Vector3d::UnitZ(); };
  ToolRun open = grabbing(), run = grabbing();
  double met = 0;
  open.device = [=](double t) { return deviceAt(coming(t)); };
  open.run(0.1, [&](double t, const ToolState& tool) { met = met == 0 && tool.inContact ? t : met; });
  ASSERT_GT(met, 0.01);
  run.device = [=](double t) { return deviceAt(coming(t), t >= met ? 1 : 0); };
  double first = -1;
  run.run(met + 0.04, [&](double t, const ToolState& tool) {
    ASSERT_EQ(tool.holding, t >= met);
    if (tool.holding && first < 0) first = tool.force.norm();
  });
  EXPECT_LT(first, 1.2 * run.tool.stiffness * kSpeed * run.tickDuration);  // what a tick of the way adds
}

// At 20 Hz a withdrawing tool comes off the late surface while the tissue still pushes it.
TEST(Grab, JawsHoldWhatIsStillFelt) {
  for (int k = 0; k < 25; ++k) {
    const double closing = 1 + 0.008 * k;
    ToolRun run = grabbing();
    run.ticksPerFrame = 60;
    run.device = [=](double t) {
      const double up = 0.1 * std::max(0.0, t - 1);
      return deviceAt(approach(t) + up * Vector3d::UnitZ(), t > closing ? 1 : 0);
    };
    ToolState before;
    run.run(closing + 0.01, [&](double t, const ToolState& tool) {
      const bool closesNow = t > closing && t - run.tickDuration <= closing;
      if (closesNow) {
        EXPECT_EQ(tool.holding, before.inContact) << closing << " s, " << before.force.norm() << " N";
      }
      before = tool;
    });
  }
}

// Off the late surface when the jaws close, the proxy rides on what they hold nevertheless.
TEST(Grab, TheProxyRidesOnWhatIsHeld) {
  double pressed = 0;  // m
  for (int k = 0; k < 25; ++k) {
    const double closing = 1 + 0.008 * k;
    ToolRun run = grabbing();
    run.ticksPerFrame = 60;
    run.device = [=](double t) {
      const double up = 0.1 * std::clamp(t - 1, 0.0, closing - 1);
      return deviceAt(approach(t) + up * Vector3d::UnitZ() + 0.03 * ease(t, closing, 0.5) * Vector3d::UnitX(),
                      t > closing ? 1 : 0);
    };
    Vector3d last = Vector3d::Zero();
    bool holding = false, rides = true;
    run.run(closing + 1, [&](double, const ToolState& tool) {
      holding = tool.holding;
      rides = rides && (tool.inContact || !holding);
      last = tool.proxy;
    });
    if (!holding) continue;  // it had come off
    EXPECT_TRUE(rides) << closing;
    const double apart = (last - run.device(closing + 1).position).norm();
    if (k == 0) pressed = apart;
    EXPECT_NEAR(apart, pressed, 0.05 * pressed) << closing;
  }
}

// What it takes hold of in the midst of a frame is led from where the hand was then: along the whole frame's path it
// would first be drawn back to where the tool came from.
TEST(Grab, ClosingOnTheMoveDrawsNothingBack) {
  constexpr double kSpeed = 0.1;  // m/s
  for (const int tick : {1, 12, 23}) {
    const double closing = 0.2 + tick / 1200.0 - 1e-6;
    ToolRun run = grabbing();
    run.device = [=](double t) {
      return deviceAt(touch - kSpeed * std::max(0.0, t - 0.17) * Vector3d::UnitZ(), t > closing ? 1 : 0);
    };
    run.run(0.22);
    ASSERT_FALSE(run.loads.heldNodes.empty());
    for (const HeldNode& held : run.loads.heldNodes)
      EXPECT_LT((held.anchorVelocity + kSpeed * (24 - tick) / 24 * Vector3d::UnitZ()).norm(), 1e-9) << tick;
  }
}

TEST(Grab, PullingTakesTheTissueAlongAndReleaseLetsItGo) {
  ToolRun run = grabbing();
  run.device = [](double t) {
    const Vector3d pull = 0.02 * ease(t, 0.6, 1) * Vector3d::UnitZ();
    return deviceAt(approach(t) + pull + (t > 2.5 ? 0.05 * (t - 2.5) : 0) * Vector3d::UnitZ(),
                    t > 0.5 && t < 2.5 ? 1 : 0);
  };
  double pulled = 0;
  bool holding = true;
  int node = -1;
  run.run(4, [&](double t, const ToolState& tool) {
    if (t > 2.4 && t < 2.45) {
      EXPECT_TRUE(tool.holding);
      EXPECT_LT(tool.force.z(), -0.2);  // the tissue pulls the hand back
      node = run.loads.heldNodes.front().node;
      pulled = run.body.position[node].z() - run.body.shape->restNodes[node].z();
    }
    holding = tool.holding;
  });
  EXPECT_GT(pulled, 0.005);
  EXPECT_FALSE(holding);
  EXPECT_TRUE(run.loads.heldNodes.empty());
  EXPECT_LT((run.body.position[node] - run.body.shape->restNodes[node]).norm(), 1e-3);
  EXPECT_LT(run.mismatch(), 0.02);
}

TEST(Grab, TwistingTheToolTwistsTheTissue) {
  ToolRun run = grabbing();
  run.tool.gripRadius = 0.012;
  run.device = [](double t) {
    ToolSample sample = deviceAt(approach(t), t > 0.5 ? 1 : 0);
    sample.worldFromTool = Eigen::AngleAxisd(ease(t, 0.6, 1), Vector3d::UnitZ());
    return sample;
  };
  std::vector<Vector3d> before;
  run.run(0.58);
  before = run.body.position;
  run.body = SpringBody(run.body.shape);
  run.run(2.5);
  // Mean turn of the held nodes about the tool's axis.
  double turn = 0;
  for (const HeldNode& held : run.loads.heldNodes) {
    const Vector3d a = before[held.node] - touch, b = run.body.position[held.node] - touch;
    turn +=
        std::atan2(a.x() * b.y() - a.y() * b.x(), a.x() * b.x() + a.y() * b.y()) / double(run.loads.heldNodes.size());
  }
  EXPECT_GT(turn, 0.1);
  EXPECT_LT(turn, 1);
}

// Tissue that turns along with its targets drags nothing, however strong the damper; against the device's own velocity
// it would drag by omega x lever.
TEST(Grab, ATurningToolIsNotDampedByItsOwnTurning) {
  constexpr double kFrame = 0.02, kTick = 1e-3, start = 0.1, omega = 1;  // s, rad/s
  const Vector3d place(0.001, 0.007, 0.002);
  const auto turn = [&](double t) { return Eigen::AngleAxisd(omega * std::max(0.0, t - start), Vector3d::UnitX()); };
  const SurfaceMotion motion = [&](const Vector3d& x, double t) { return Vector3d(place + turn(t) * (x - place)); };
  const TouchShape shape = plate(10, 0.03, 0.01, 5);
  ToolSettings tool;
  tool.damping = 50;  // at a lever of 2 mm, 0.1 N
  Servo servo({{shape}}, {tool}, kTick, frameAt(*shape, 0), {deviceAt({0.001, 0.02, 0.002})});
  Vector3d before = Vector3d::Zero();
  for (int frame = 0; frame < 20; ++frame) {
    for (int k = 1; k <= 20; ++k) {
      const double time = kFrame * frame + kTick * k;
      ToolSample sample = deviceAt(place, frame > 0 ? 1 : 0);
      sample.worldFromTool = turn(time);
      servo.tick(k / 20.0, {sample});
      if (time <= start) before = servo.tools()[0].force;
      if (time < start + 4 * kFrame) continue;
      ASSERT_TRUE(servo.tools()[0].holding);
      // The spring is stretched and turns, too, which its damper feels.
      const Vector3d spring = turn(time) * before, damper = omega * Vector3d::UnitX().cross(spring) / tool.stiffness;
      ASSERT_LT((servo.tools()[0].force - spring - tool.damping * damper).norm(), 0.01);
    }
    const double end = kFrame * (frame + 1);
    servo.commit(frameAt(*shape, end - kFrame, motion), frameAt(*shape, end, motion), servo.tools());
    ASSERT_TRUE(servo.beginFrame());
  }
}

TEST(Grab, PullBeyondForceMaxIsClampedForHandAndTissue) {
  ToolRun run = grabbing();
  run.tool.forceMax = 0.5;
  run.device = [](double t) {
    return deviceAt(approach(t) + 0.05 * ease(t, 0.6, 1) * Vector3d::UnitZ(), t > 0.5 ? 1 : 0);
  };
  Vector3d force = Vector3d::Zero();
  bool clamped = false;
  run.run(4, [&](double, const ToolState& tool) {
    ASSERT_LE(tool.force.norm(), 0.5 * (1 + 1e-12));
    force = tool.force;
    clamped = tool.clamped;
  });
  EXPECT_TRUE(clamped);
  EXPECT_LT((run.body.advance(run.loads, 0.02, 200) / 0.02 + force).norm(), 0.02 * force.norm());
}

// N, RMS of what the hand feels over its fourth second of shaking along x, against the same with dynamics at 1200 Hz.
static double offWhileShaken(double frequency, int ticksPerFrame, double& rms) {
  const auto shaken = [&](int ticks) {
    ToolRun run = grabbing();
    run.tool.stiffness = 4000;
    run.ticksPerFrame = ticks;
    run.substeps = 9 * ticks;
    run.device = [&](double t) {
      const double x = 0.003 * ease(t, 0.6, 0.5) * std::sin(2 * std::numbers::pi * frequency * t);
      return deviceAt(approach(t) + x * Vector3d::UnitX(), t > 0.5 ? 1 : 0);
    };
    std::vector<Vector3d> felt;
    run.run(4, [&](double time, const ToolState& tool) {
      if (time > 3) felt.push_back(tool.force);
    });
    return felt;
  };
  const std::vector<Vector3d> felt = shaken(ticksPerFrame), right = shaken(1);
  double off = 0, size = 0;
  for (std::size_t k = 0; k < felt.size(); ++k) {
    off += (felt[k] - right[k]).squaredNorm();
    size += right[k].squaredNorm();
  }
  rms = std::sqrt(size / static_cast<double>(felt.size()));
  return std::sqrt(off / static_cast<double>(felt.size()));
}

// What goes round with a stiff tool leaves only a small difference of two large motions to be felt.
TEST(Grab, ShakenTissueIsFeltAsItIsOnceItsMotionIsKnown) {
  for (const auto& [frequency, ticks, most] : {std::tuple(3.0, 24, 0.02), {5.0, 24, 0.06}, {5.0, 12, 0.02}}) {
    double rms = 0;
    const double off = offWhileShaken(frequency, ticks, rms);
    std::printf("[  reached ] %g Hz, dynamics at %d Hz: off by %.3f of %.3f N RMS\n", frequency, 1200 / ticks, off,
                rms);
    EXPECT_LT(off, most * rms);
  }
}

TEST(Grab, BeyondItsForceTheTissueSlipsOutAndCanBeGrabbedAgain) {
  ToolRun run = grabbing();
  run.tool.gripForceMax = 0.4;
  run.device = [](double t) {
    const bool closed = (t > 0.5 && t < 1.7) || t > 2.6;
    const double pull = ease(t, 0.6, 1) - ease(t, 1.8, 0.6);
    return deviceAt(approach(t) + 0.05 * pull * Vector3d::UnitZ(), closed ? 1 : 0);
  };
  bool held = false, slipped = false, again = false;
  double most = 0, afterwards = 0;
  run.run(2.8, [&](double t, const ToolState& tool) {
    if (tool.holding) most = std::max(most, tool.force.norm());
    held = held || (t < 1 && tool.holding);
    slipped = slipped || tool.slipped;
    EXPECT_FALSE(tool.slipped && tool.holding);
    if (t > 1.65 && t < 1.7) {
      EXPECT_TRUE(tool.slipped);
      afterwards = tool.force.norm();
    }
    if (t > 1.71 && t < 2.6) {
      EXPECT_FALSE(tool.slipped);
    }
    again = tool.holding;
  });
  EXPECT_TRUE(held);
  EXPECT_TRUE(slipped);
  EXPECT_TRUE(again);
  EXPECT_LE(most, 0.4);
  EXPECT_EQ(afterwards, 0);
}

}  // namespace medulla
