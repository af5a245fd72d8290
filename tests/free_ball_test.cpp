#include <gtest/gtest.h>

#include <cstdio>

#include "haptics/servo.h"
#include "tests/tool_run.h"

namespace medulla {

using Eigen::Vector3d;

namespace {
// A free body that moves as a whole, without turning, under a soft skin: a held node yields to its spring at once, by
// its give, and the two in series pull the body.
struct FreeBall {
  TouchShape shape;
  double mass, give;  // kg; m/N per node, 0: the nodes ride on the body
  std::vector<Vector3d> position = shape->restNodes;
  Vector3d way = Vector3d::Zero(), velocity = Vector3d::Zero();
  double time = 0;

  DynamicsFrame frame() const { return frameOf(time, position); }

  // N, `left` s before the frame's end.
  Vector3d spring(const HeldNode& held, double left) const {
    const Vector3d bare = shape->restNodes[held.node] + way;
    return held.stiffness / (1 + held.stiffness * give) * (held.anchor - left * held.anchorVelocity - bare);
  }

  // Returns the impulse that the tool gave to the ball, N s.
  Vector3d advance(const Loads& loads, double duration) {
    constexpr int kSubsteps = 400;
    const double h = duration / kSubsteps;
    Vector3d impulse = Vector3d::Zero();
    for (int s = 0; s < kSubsteps; ++s) {
      Vector3d force = Vector3d::Zero();
      for (const HeldNode& held : loads.heldNodes)
        force += spring(held, duration - s * h) + held.damping * (held.anchorVelocity - velocity);
      velocity += h / mass * force;
      way += h * velocity;
      impulse += h * force;
    }
    for (std::size_t n = 0; n < position.size(); ++n) position[n] = shape->restNodes[n] + way;
    for (const HeldNode& held : loads.heldNodes) position[held.node] += give * spring(held, 0);
    time += duration;
    return impulse;
  }
};

struct Pull {
  double hand = 0, ball = 0;  // N s, along the pull
  double largest = 0;         // N, of the hand, along the pull
  double apart = 0;           // N s, of hand and ball, sum over frames
};
}  // namespace

// From rest at `kAcceleration` for `kSpeedUp`, then on at a steady speed.
static constexpr double kMass = 0.11, kAcceleration = 0.4, kStart = 0.5, kSpeedUp = 0.5;

static ToolSample pulling(double time) {
  constexpr double kTouch = 0.008 - 1e-6;  // m: a radius above the plate, in contact
  const double s = std::max(0.0, time - kStart), u = std::min(s, kSpeedUp);
  return deviceAt({0.001, kTouch + kAcceleration * u * (s - 0.5 * u), 0.002}, time > 0.01 ? 1 : 0);
}

static Pull pullBall(double stiffness, double give, int dynamicsRate) {
  constexpr double kTick = 1.0 / 1200;
  const int ticks = 1200 / dynamicsRate;
  FreeBall ball{plate(10, 0.03, 0.01, 5), kMass, give};
  ToolSettings tool;
  tool.gripRadius = 0.005;
  tool.stiffness = stiffness;
  tool.forceMax = tool.gripForceMax = 100;
  DynamicsFrame last = ball.frame(), now = last;
  Servo servo({{ball.shape, std::vector<NodeGive>(ball.position.size(), NodeGive{give})}}, {tool}, kTick, now,
              {pulling(0)});
  Pull pull;
  Loads loads;
  for (int frame = 0; frame < 2 * dynamicsRate; ++frame) {
    double hand = 0;
    for (int k = 1; k <= ticks; ++k) {
      servo.tick(double(k) / ticks, {pulling((frame * ticks + k) * kTick)});
      hand -= kTick * servo.tools()[0].force.y();
      pull.largest = std::max(pull.largest, -servo.tools()[0].force.y());
    }
    EXPECT_TRUE(servo.tools()[0].holding || frame * ticks * kTick < 0.01);
    servo.handOver(ticks * kTick, loads);
    const std::vector<Vector3d> impulse{ball.advance(loads, ticks * kTick)};
    pull.hand += hand;
    pull.ball += impulse[0].y();
    pull.apart += std::abs(hand - impulse[0].y());
    last = now;
    now = ball.frame();
    servo.commit(last, now, servo.tools(), &impulse);
    servo.beginFrame();
  }
  return pull;
}

namespace {
struct Case {
  double stiffness, give;
  int dynamicsRate;
  double off, largest;  // of the impulse, at most; times the steady force, at most
};
}  // namespace

// Newton's law says what hand and ball have to get, whatever the stiffness, the skin and the rate. The ball swings by
// as much as the steady force while it speeds up.
TEST(FreeBall, AGripFeelsItAsHeavyAsItIs) {
  const double steady = kMass * kAcceleration, right = steady * kSpeedUp;  // N; N s
  for (const Case& c : {Case{400, 0.02, 20, 0.1, 4}, Case{400, 0.02, 50, 0.03, 2.2}, Case{400, 0.02, 200, 0.01, 2},
                        Case{4000, 0.02, 20, 0.1, 4.5}, Case{4000, 0.02, 50, 0.04, 2.2}, Case{4000, 0.02, 200, 0.01, 2},
                        Case{400, 0, 50, 0.05, 3.5}, Case{400, 0, 200, 0.01, 2}}) {
    const Pull pull = pullBall(c.stiffness, c.give, c.dynamicsRate);
    std::printf("[  reached ] %g N/m, skin %g m/N, %d Hz: hand %.4f, ball %.4f N s; largest %.3f N; apart %.4f N s\n",
                c.stiffness, c.give, c.dynamicsRate, pull.hand, pull.ball, pull.largest, pull.apart);
    EXPECT_NEAR(pull.ball, right, 0.005 * right);
    EXPECT_NEAR(pull.hand, right, c.off * right);
    EXPECT_LT(pull.largest, c.largest * steady);
  }
}

}  // namespace medulla
