#include "haptics/servo.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include "tests/tool_run.h"

namespace medulla {

using Eigen::Vector3d;

static constexpr double kPlateThickness = 0.01, kPlateTop = 0.5 * kPlateThickness;

static ToolSettings frictionless() {
  ToolSettings tool;
  tool.damping = tool.staticFriction = tool.dynamicFriction = 0;
  return tool;
}

static Servo plateServo(const TouchShape& shape, const ToolSettings& tool, const Vector3d& start) {
  return Servo({{shape}}, {tool}, 1e-3, frameAt(*shape, 0), {deviceAt(start)});
}

static void nextFrame(Servo& servo, const DynamicsFrame& from, const DynamicsFrame& to) {
  servo.commit(from, to, servo.tools());
  ASSERT_TRUE(servo.beginFrame());
}

TEST(Servo, ForceIsTheCouplingAndTheSpringHandedOverGivesTheSame) {
  const TouchShape shape = plate(10, 0.03, kPlateThickness, 5);
  ToolSettings tool = frictionless();
  Servo servo = plateServo(shape, tool, {0.001, 0.02, 0.002});
  const Vector3d device(0.001, kPlateTop + 0.001, 0.002);
  for (int k = 1; k <= 20; ++k) servo.tick(k / 20.0, {deviceAt(device)});
  const ToolState& state = servo.tools()[0];
  const double depth = tool.radius - 0.001;
  EXPECT_TRUE(state.inContact);
  EXPECT_FALSE(state.clamped);
  EXPECT_LT((state.proxy - Vector3d(0.001, kPlateTop + tool.radius, 0.002)).norm(), 1e-6);
  EXPECT_LT((state.force - tool.stiffness * depth * Vector3d::UnitY()).norm(), 1e-3);

  // A second frame in which the device rests.
  nextFrame(servo, frameAt(*shape, 0), frameAt(*shape, 0.02));
  for (int k = 1; k <= 20; ++k) servo.tick(k / 20.0, {deviceAt(device)});
  Loads loads;
  servo.handOver(0.02, loads);
  ASSERT_FALSE(loads.toolSprings.empty());
  EXPECT_TRUE(loads.heldNodes.empty());
  Vector3d force = Vector3d::Zero();
  double stiffness = 0;
  for (const ToolSpring& spring : loads.toolSprings) {
    Vector3d x = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) x += spring.weights[k] * shape->restNodes[spring.nodes[k]];
    force += spring.stiffness * (spring.anchor - x);
    stiffness += spring.stiffness;
    EXPECT_NEAR(spring.weights[0] + spring.weights[1] + spring.weights[2], 1, 1e-12);
    EXPECT_LT(spring.anchorVelocity.norm(), 1e-9);
    EXPECT_GT(spring.outward.y(), 0.999);
  }
  EXPECT_NEAR(stiffness, tool.stiffness, 1e-9);
  EXPECT_LT((force + servo.tools()[0].force).norm(), 1e-3);
}

TEST(Servo, ForceIsClampedAndSoIsWhatIsHandedOver) {
  const TouchShape shape = plate(10, 0.03, kPlateThickness, 5);
  ToolSettings tool = frictionless();
  tool.forceMax = 1;
  Servo servo = plateServo(shape, tool, {0.001, 0.02, 0.002});
  for (int frame = 0; frame < 2; ++frame) {
    for (int k = 1; k <= 20; ++k) servo.tick(k / 20.0, {deviceAt({0.001, kPlateTop - 0.004, 0.002})});
    if (frame == 0) nextFrame(servo, frameAt(*shape, 0), frameAt(*shape, 0.02));
  }
  EXPECT_TRUE(servo.tools()[0].clamped);
  EXPECT_NEAR(servo.tools()[0].force.norm(), 1, 1e-12);
  Loads loads;
  servo.handOver(0.02, loads);
  double force = 0, stiffness = 0;
  for (const ToolSpring& spring : loads.toolSprings) {
    force += std::min(spring.forceMax, spring.stiffness * (kPlateTop - spring.anchor.y()));
    stiffness += spring.stiffness;
  }
  EXPECT_NEAR(force, 1, 1e-3);
  EXPECT_NEAR(stiffness, tool.stiffness, 1e-9);
}

TEST(Servo, BadInputIsRefusedByName) {
  const TouchShape shape = plate(4, 0.03, kPlateThickness, 2);
  Servo servo = plateServo(shape, {}, {0, 0.02, 0});
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, inf, 25.0, -1e20}) {
    EXPECT_THROW(servo.tick(0.5, {deviceAt({0, bad, 0})}), std::runtime_error);
    EXPECT_THROW(plateServo(shape, {}, {bad, 0, 0}), std::runtime_error);
  }
  ToolSample turned = deviceAt({0, 0.02, 0});
  turned.worldFromTool.w() = nan;
  EXPECT_THROW(servo.tick(0.5, {turned}), std::runtime_error);
  for (double ToolSettings::*field : {&ToolSettings::radius, &ToolSettings::stiffness, &ToolSettings::forceMax}) {
    ToolSettings settings;
    settings.*field = 0;
    EXPECT_THROW(plateServo(shape, settings, {0, 0.02, 0}), std::runtime_error);
  }
  servo.tick(0.5, {deviceAt({0, 0.02, 0})});  // and goes on
}

TEST(Servo, TwoToolsTouchTwoBodies) {
  const TouchShape low = plate(6, 0.03, kPlateThickness, 3), high = plate(6, 0.03, kPlateThickness, 4);
  DynamicsFrame frame = frameAt(*low, 0);
  frame.bodies.push_back(
      frameAt(*high, 0, [](const Vector3d& x, double) { return Vector3d(x + Vector3d(0.061, 0.002, 0)); }).bodies[0]);
  ToolSettings fine = frictionless(), coarse = frictionless();
  fine.radius = 0.0005;
  coarse.radius = 0.004;
  Servo servo({{low}, {high}}, {fine, coarse}, 1e-3, frame, {deviceAt({0, 0.02, 0}), deviceAt({0.061, 0.02, 0})});
  for (int k = 1; k <= 20; ++k) servo.tick(k / 20.0, {deviceAt({0, 0.003, 0}), deviceAt({0.061, 0.005, 0})});
  EXPECT_NEAR(servo.tools()[0].proxy.y(), kPlateTop + fine.radius, 1e-6);
  EXPECT_NEAR(servo.tools()[1].proxy.y(), kPlateTop + 0.002 + coarse.radius, 1e-6);
  Loads loads;
  servo.handOver(0.02, loads);
  for (const ToolSpring& spring : loads.toolSprings) {
    EXPECT_EQ(spring.body, spring.tool);
    for (const int n : spring.nodes) EXPECT_LT(n, int(low->restNodes.size()));
  }
}

// A groove of which one wall is one body's and the other another's, from wide to a wedge. Each wall gets what the proxy
// presses with, of which the whole is what the hand feels.
TEST(Servo, OneToolTouchesTwoBodiesAtOnce) {
  const double h = 0.03;
  for (const double degrees : {45.0, 70.0, 85.0}) {
    const double slope = std::tan(degrees / 180 * std::numbers::pi);
    const auto wall = [&](double side) {
      return shapeOf({{-h, 0, 0}, {h, 0, 0}, {-h, side * h / slope, h}, {h, side * h / slope, h}},
                     {{0, 1, 3}, {0, 3, 2}});
    };
    const TouchShape left = wall(-1), right = wall(1);
    DynamicsFrame frame = frameAt(*left, 0);
    frame.bodies.push_back(frameAt(*right, 0).bodies[0]);
    ToolSettings tool = frictionless();
    tool.radius = 0.001;
    Servo servo({{left}, {right}}, {tool}, 1e-3, frame, {deviceAt({0, 0, 0.02})});
    const double bottom = std::hypot(1, slope) * tool.radius, depth = 0.002;
    for (int pass = 0; pass < 2; ++pass) {
      for (int k = 1; k <= 20; ++k) servo.tick(k / 20.0, {deviceAt({0, 0, bottom - depth})});
      DynamicsFrame next = frame;
      next.time = 0.02;
      if (pass == 0) nextFrame(servo, frame, next);
    }
    EXPECT_LT((servo.tools()[0].proxy - Vector3d(0, 0, bottom)).norm(), 1e-6) << degrees;
    EXPECT_LT((servo.tools()[0].force - tool.stiffness * depth * Vector3d::UnitZ()).norm(), 1e-3) << degrees;
    Loads loads;
    servo.handOver(0.02, loads);
    Vector3d force[2] = {Vector3d::Zero(), Vector3d::Zero()};
    for (const ToolSpring& spring : loads.toolSprings) {
      const TouchShape& touched = spring.body == 0 ? left : right;
      Vector3d x = Vector3d::Zero();
      for (int k = 0; k < 3; ++k) x += spring.weights[k] * touched->restNodes[spring.nodes[k]];
      force[spring.body] += spring.stiffness * (spring.anchor - x);
      EXPECT_LE(spring.stiffness, 4 * tool.stiffness);  // however narrow
    }
    const double half = 0.5 * tool.stiffness * depth;
    EXPECT_LT((force[0] - half * Vector3d(0, -slope, -1)).norm(), 1e-2 * half * slope) << degrees;
    EXPECT_LT((force[1] - half * Vector3d(0, slope, -1)).norm(), 1e-2 * half * slope) << degrees;
  }
}

// How far tissue follows is learnt of each body anew: behind one that was pushed away a fixed one was met as if it gave
// way, too, and felt a frame and a half late.
TEST(Servo, WhatGaveWayTellsNothingOfWhatLiesBehindIt) {
  constexpr double kFrame = 0.02, kSpeed = 0.1, kGap = 0.02;  // s, m/s, m
  const TouchShape shape = plate(6, 0.03, kPlateThickness, 3);
  const ToolSettings tool = frictionless();
  const double meets = 0.1;  // s, the first plate; it goes along, and is gone before the second
  const auto deviceY = [&](double t) { return kPlateTop + tool.radius + kSpeed * (meets - t); };
  const double turns = meets + (kGap - 0.008) / kSpeed;
  const auto forces = [&](bool withFirst) {
    const auto frameOf = [&](double t) {
      const double down = -kSpeed * std::max(0.0, t - meets), gone = t > turns ? 1 : 0;
      DynamicsFrame frame = frameAt(
          *shape, t, [=](const Vector3d& x, double) { return Vector3d(x + Vector3d(withFirst ? gone : 1, down, 0)); });
      frame.bodies.push_back(frameAt(*shape, t, [=](const Vector3d& x, double) {
                               return Vector3d(x - kGap * Vector3d::UnitY());
                             }).bodies[0]);
      return frame;
    };
    Servo servo({{shape}, {shape}}, {tool}, 1e-3, frameOf(0), {deviceAt({0, deviceY(0), 0})});
    std::vector<double> out;
    for (int frame = 0; frame < 20; ++frame) {
      for (int k = 1; k <= 20; ++k) {
        servo.tick(k / 20.0, {deviceAt({0, deviceY(frame * kFrame + k * 1e-3), 0})});
        out.push_back(servo.tools()[0].force.y());
      }
      servo.commit(frameOf((frame + 0) * kFrame), frameOf((frame + 1) * kFrame), servo.tools());
      servo.beginFrame();
    }
    return out;
  };
  const std::vector<double> alone = forces(false), behind = forces(true);
  const auto touches = static_cast<std::size_t>(std::lround((meets + kGap / kSpeed) / 1e-3));
  EXPECT_GT(*std::max_element(behind.begin(), behind.begin() + 200), 0.5);  // the first was pushed
  for (std::size_t k = touches; k < alone.size(); ++k) EXPECT_NEAR(behind[k], alone[k], 0.01) << k;
}

// ---- Against a soft body ---------------------------------------------------------------------------------

static ToolRun pressing(double speed) {
  ToolRun run{SpringBody(ellipsoid(24, 20, 7, 0.3)), frictionless(), {}, 24, 1.0 / 1200, {}};
  // Down 12 mm from 4 mm above the surface, a pause, and up.
  run.device = [=](double t) {
    const double down = std::min(0.016, speed * t), up = std::max(0.0, speed * (t - 1) - 0.016);
    return deviceAt({0.012, 0.004, 0.0585 - down + up});
  };
  return run;
}

TEST(Servo, PressingSoftTissueHasNoForceStepsAndOneContact) {
  const double speed = 0.05;
  ToolRun run = pressing(speed);
  Vector3d last = Vector3d::Zero();
  double largest = 0, mostForce = 0;
  int changes = 0;
  bool before = false;
  run.run(1.8, [&](double, const ToolState& tool) {
    largest = std::max(largest, (tool.force - last).norm());
    mostForce = std::max(mostForce, tool.force.norm());
    changes += tool.inContact != before;
    before = tool.inContact;
    last = tool.force;
  });
  EXPECT_GT(mostForce, 0.3);
  EXPECT_LE(largest, 1.2 * run.tool.stiffness * speed * run.tickDuration);
  EXPECT_EQ(changes, 2);
}

// Live, too, where the tissue answers a frame later: what the hand is kept to must not be taken for newer than it is.
TEST(Servo, StrokesNeverGiveEnergy) {
  for (const bool live : {false, true}) {
    ToolRun run = pressing(0.1);
    run.live = live;
    run.body.ground *= 10;  // stiffer than the tool
    run.give.assign(run.body.shape->restNodes.size(), NodeGive{1 / run.body.ground});
    run.device = [](double t) { return deviceAt({0.012, 0.004, 0.0545 - 0.008 * (1 - std::cos(8 * t))}); };
    double most = 0, largest = 0;
    run.run(2.4, [&](double, const ToolState& tool) {
      most = std::max(most, tool.energy);
      largest = std::max(largest, tool.force.norm());
    });
    EXPECT_GT(largest, 0.3) << live;
    EXPECT_LT(most, 1e-5) << live;  // J
  }
}

TEST(Servo, APressBeyondForceMaxIsClampedForHandAndTissue) {
  ToolRun run = pressing(0.05);
  run.tool.forceMax = 0.1;
  run.device = [](double t) { return deviceAt({0.012, 0.004, 0.0585 - std::min(0.016, 0.02 * t)}); };
  ToolState last;
  run.run(2, [&](double, const ToolState& tool) {
    ASSERT_LE(tool.force.norm(), 0.1 * (1 + 1e-12));
    last = tool;
  });
  EXPECT_TRUE(last.clamped);
  EXPECT_LT((run.body.advance(run.loads, 0.02, 200) / 0.02 + last.force).norm(), 0.05 * last.force.norm());
}

// However the device swings about where it sticks, it feels no more across than static friction carries.
TEST(Servo, StickingForceStaysWithinTheFrictionCone) {
  const TouchShape shape = plate(10, 0.03, kPlateThickness, 5);
  ToolSettings tool = frictionless();
  tool.staticFriction = 0.3;
  tool.dynamicFriction = 0.2;
  tool.damping = 5;  // the damper's share comes on top of what the proxy's lag is
  Servo servo = plateServo(shape, tool, {0, 0.02, 0});
  double most = 0;
  for (int frame = 0; frame < 60; ++frame) {
    for (int k = 1; k <= 20; ++k) {
      const double t = 0.001 * (20 * frame + k), swing = t < 0.2 ? 0 : 0.00055 * std::sin(100 * (t - 0.2));
      servo.tick(k / 20.0, {deviceAt({swing, kPlateTop + 0.001, 0})});
      const Vector3d force = servo.tools()[0].force;
      if (t > 0.1) most = std::max(most, std::hypot(force.x(), force.z()) / force.y());
    }
    nextFrame(servo, frameAt(*shape, 0.02 * frame), frameAt(*shape, 0.02 * (frame + 1)));
  }
  EXPECT_GT(most, 0.15);
  EXPECT_LE(most, 0.3 * (1 + 1e-6));
}

// The largest step of the force from tick to tick while a tool presses and strokes soft tissue.
static double largestStep(int dynamicsRate, bool blend) {
  ToolRun run = pressing(0.05);
  run.ticksPerFrame = 1200 / dynamicsRate;
  run.blend = blend;
  run.device = [](double t) {
    return deviceAt({0.012 + 0.02 * ease(t, 0.5, 1), 0.004, 0.0585 - 0.012 * ease(t, 0, 0.5)});
  };
  Vector3d last = Vector3d::Zero();
  double largest = 0;
  run.run(1.5, [&](double, const ToolState& tool) {
    largest = std::max(largest, (tool.force - last).norm());
    last = tool.force;
  });
  return largest;
}

TEST(Servo, BlendingTakesTheDynamicsStepsOutOfTheForce) {
  for (const int rate : {20, 50, 100}) {
    const double blended = largestStep(rate, true), stepped = largestStep(rate, false);
    std::printf("[  reached ] dynamics at %d Hz, force step blended %.3g N, not blended %.3g N\n", rate, blended,
                stepped);
    EXPECT_LT(blended, 0.5 * stepped);
    EXPECT_LT(blended, 0.1);
  }
}

TEST(Servo, HandAndTissueGetTheSameImpulseOverAPress) {
  for (const double stiffness : {200.0, 400.0}) {
    ToolRun run = pressing(0.03);
    run.tool.stiffness = stiffness;
    run.run(2.4);
    EXPECT_GT(run.bodyImpulseLength, 0.1);
    EXPECT_LT(run.mismatch(), 0.02) << stiffness;
    EXPECT_LT(run.loads.toolSprings.size(), 1U);  // the tool is clear at the end
  }
}

TEST(Servo, ASteadyPressHasTheTissuesOwnForce) {
  ToolRun run = pressing(0.05);
  Vector3d force = Vector3d::Zero();
  run.device = [device = run.device](double t) { return device(std::min(t, 1.0)); };
  run.run(3, [&](double, const ToolState& tool) { force = tool.force; });
  run.handImpulse = run.bodyImpulse = Vector3d::Zero();
  const Vector3d once = run.body.advance(run.loads, 0.02, 200) / 0.02;
  EXPECT_LT((once + force).norm(), 0.005 * force.norm());
}

// Wide against the mesh: the dent has many triangles, of which the proxy presses on three.
TEST(Servo, AStillToolDoesNotChatterHoweverWide) {
  for (const double radius : {0.003, 0.02, 0.04}) {
    for (const double stiffness : {400.0, 2000.0}) {
      ToolRun run = pressing(0.05);
      run.tool.radius = radius;
      run.tool.stiffness = stiffness;
      run.device = [=](double t) { return deviceAt({0.012, 0.004, 0.0555 + radius - 0.016 * ease(t, 0, 0.5)}); };
      double sum = 0, squares = 0;
      int ticks = 0;
      run.run(2, [&](double t, const ToolState& tool) {
        if (t < 1.5) return;
        sum += tool.force.norm();
        squares += tool.force.squaredNorm();
        ++ticks;
      });
      const double mean = sum / ticks;
      EXPECT_GT(mean, 0.1);
      EXPECT_LT(std::sqrt(std::max(0.0, squares / ticks - mean * mean)), 0.01 * mean) << radius << " " << stiffness;
    }
  }
}

TEST(Servo, SlidingDragsTheTissueByFrictionOnly) {
  for (const double friction : {0.0, 0.3}) {
    ToolRun run = pressing(0.05);
    run.tool.staticFriction = 1.2 * friction;
    run.tool.dynamicFriction = friction;
    run.device = [](double t) {
      return deviceAt({0.012 + 0.03 * ease(t, 0.5, 1.0), 0.004, 0.0585 - 0.012 * ease(t, 0, 0.4)});
    };
    double press = 0, drag = 0;
    run.run(1.6, [&](double t, const ToolState& tool) {
      if (t < 0.8 || t > 1.2) return;
      press += tool.force.z();
      drag -= tool.force.x();
    });
    // The ellipsoid slopes by 0.05 x / (0.1 sqrt(0.1^2 - x^2)) = 0.144 in the middle of the way, at x = 0.0275.
    EXPECT_NEAR(drag / press, friction - 0.144, 0.035);
  }
}

// On a plate as good as rigid the push is that of the depth, however fast the tool slides on it, or the plate under the
// tool: what it has left behind, by five of its radii in the 50 ms that pushes count for, has no part in it.
static void slideOnPlate(double radius, double speed, bool plateMoves) {
  ToolRun run{SpringBody(plate(12, 0.03, 0.01, 6)), frictionless(), {}, 24, 1.0 / 1200, {}};
  run.body.ground = 1e5;
  run.body.groundDamping = 20;
  run.tool.radius = radius;
  constexpr double kDepth = 0.0005;
  const auto slid = [=](double t) { return speed * std::max(0.0, t - 0.2); };
  run.device = [=](double t) {
    const double x = plateMoves ? 0.015 : -0.02 + slid(t);
    return deviceAt({x, 0.006 + radius - (0.001 + kDepth) * ease(t, 0, 0.1), 0.002});
  };
  const double push = run.tool.stiffness * kDepth;
  double sum = 0, least = push;
  int ticks = 0;
  run.run(0.2 + 0.035 / speed, [&](double t, const ToolState& tool) {
    if (plateMoves && t > 0.2) run.body.carriedAt.x() = speed;
    if (t < 0.15) return;
    sum += tool.force.y();
    least = std::min(least, tool.force.y());
    ++ticks;
  });
  EXPECT_NEAR(sum / ticks, push, 0.02 * push) << radius << " m, " << speed << " m/s, plate moves: " << plateMoves;
  EXPECT_GT(least, 0.8 * push) << radius << " m, " << speed << " m/s, plate moves: " << plateMoves;
}

TEST(Servo, ASlideAtSpeedPushesAsHardAsASlowOne) {
  for (const double radius : {0.001, 0.003})
    for (const double speed : {0.02, 0.1})
      for (const bool plateMoves : {false, true}) slideOnPlate(radius, speed, plateMoves);
}

TEST(Servo, AJumpInContactLeavesTheTissueWhole) {
  ToolRun run = pressing(0.05);
  run.tool = ToolSettings();
  run.device = [](double t) {
    return t < 0.5   ? deviceAt({0.012, 0.004, 0.0585 - 0.012 * ease(t, 0, 0.4)})
           : t < 0.8 ? deviceAt({0.9, -0.4, -0.3})
                     : deviceAt({0, 0, 0.2});
  };
  run.run(1.5, [&](double, const ToolState& tool) { ASSERT_LE(tool.force.norm(), run.tool.forceMax * (1 + 1e-12)); });
  for (std::size_t n = 0; n < run.body.position.size(); ++n)
    ASSERT_LT((run.body.position[n] - run.body.shape->restNodes[n]).norm(), 0.05);
}

TEST(Servo, TheSameRunTwiceIsTheSameBitForBit) {
  std::vector<Vector3d> forces[2];
  for (auto& out : forces) {
    ToolRun run = pressing(0.05);
    run.tool = ToolSettings();
    run.run(1, [&](double, const ToolState& tool) { out.push_back(tool.force); });
  }
  EXPECT_EQ(forces[0], forces[1]);
}

}  // namespace medulla
