#include "haptics/proxy.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "haptics/servo.h"
#include "haptics/swept_triangle.h"
#include "tests/touch_shapes.h"

namespace medulla {

using Eigen::Vector3d;

static double distance(const Triangle& triangle, const Vector3d& p) {
  return (closestPoint(triangle, p).point - p).norm();
}

// ---- Half-spaces ---------------------------------------------------------------------------------------

TEST(HalfSpaces, NearestPointIsFeasibleAndNoSampledPointIsNearer) {
  TestRandom random;
  for (int n = 0; n < 500; ++n) {
    HalfSpace planes[3];
    const Vector3d corner = random.vector(1);  // allowed in all: never empty
    const int count = 1 + n % 3;
    for (int k = 0; k < count; ++k) {
      planes[k].normal = random.vector(1).normalized();
      planes[k].offset = planes[k].normal.dot(corner) - random.uniform(0, 0.2);
    }
    const Vector3d goal = random.vector(2);
    Vector3d x;
    std::array<double, 3> pressure;
    ASSERT_TRUE(nearestInHalfSpaces(goal, planes, count, x, pressure));
    Vector3d pushed = goal;
    for (int k = 0; k < count; ++k) {
      EXPECT_GE(planes[k].normal.dot(x), planes[k].offset - 1e-9);
      EXPECT_GE(pressure[k], 0);
      pushed += pressure[k] * planes[k].normal;
    }
    EXPECT_LT((pushed - x).norm(), 1e-9);
    for (int k = 0; k < 200; ++k) {
      const Vector3d y = x + random.vector(0.5);
      const bool allowed =
          std::all_of(planes, planes + count, [&](const HalfSpace& h) { return h.normal.dot(y) >= h.offset; });
      if (allowed) {
        ASSERT_GE((y - goal).norm(), (x - goal).norm() - 1e-9);
      }
    }
  }
}

TEST(HalfSpaces, OppositeWallsWithoutRoomAreReported) {
  const HalfSpace walls[2] = {{Vector3d::UnitX(), 0.001}, {-Vector3d::UnitX(), 0.001}};
  Vector3d x;
  std::array<double, 3> pressure;
  EXPECT_FALSE(nearestInHalfSpaces({0, 0, 0}, walls, 2, x, pressure));
}

// ---- Whole ticks -----------------------------------------------------------------------------------------

namespace {
struct Script {
  TouchShape shape;
  std::function<Vector3d(double)> device;
  Motion motion;  // empty: the surface rests
  ToolSettings tool;
  double duration = 1;
  int ticksPerFrame = 20;

  Script() { tool.damping = tool.staticFriction = tool.dynamicFriction = 0; }
};
}  // namespace

static constexpr double tickDuration = 1e-3;

static ToolSample at(const Vector3d& position) {
  ToolSample sample;
  sample.position = position;
  return sample;
}

// Runs scripted time; `each` sees every tick with the surface as the servo blends it: one frame late (paper 5).
static void run(const Script& r,
                const std::function<void(double time, const ToolState&, const BlendedSurface&, double alpha)>& each) {
  const double frameDuration = r.ticksPerFrame * tickDuration;
  DynamicsFrame from = frameAt(*r.shape, 0, r.motion), to = from;
  Servo servo({{r.shape}}, {r.tool}, tickDuration, from, {at(r.device(0))});
  BlendedSurface seen;
  seen.triangles = r.shape->triangles;
  const int ticks = int(std::lround(r.duration / tickDuration));
  for (int n = 1; n <= ticks; ++n) {
    const int within = (n - 1) % r.ticksPerFrame;
    if (within == 0 && n > 1) {
      from = to;
      to = r.motion ? frameAt(*r.shape, (n - 1) * tickDuration, r.motion) : to;
      to.time = from.time + frameDuration;
      servo.commit(from, to, servo.tools());
      servo.beginFrame();
    }
    if (within == 0) {
      seen.from = from.bodies[0].nodes;
      seen.to = to.bodies[0].nodes;
    }
    const double alpha = (within + 1.0) / r.ticksPerFrame;
    servo.tick(alpha, {at(r.device(n * tickDuration))});
    each(n * tickDuration, servo.tools()[0], seen, alpha);
  }
}

static double clearance(const BlendedSurface& surface, double alpha, const Vector3d& p, double within) {
  double nearest = within;
  for (int t = 0; t < int(surface.triangles.size()); ++t) {
    const Triangle triangle = surface.triangle(t, alpha);
    const Vector3d middle = (triangle.a + triangle.b + triangle.c) / 3;
    const double size2 = std::max({(triangle.a - middle).squaredNorm(), (triangle.b - middle).squaredNorm(),
                                   (triangle.c - middle).squaredNorm()});
    if ((p - middle).norm() > std::sqrt(size2) + nearest) continue;
    nearest = std::min(nearest, distance(triangle, p));
  }
  return nearest;
}

static bool isInside(const BlendedSurface& surface, double alpha, const Vector3d& p) {
  double winding = 0;
  for (int t = 0; t < int(surface.triangles.size()); ++t) {
    const Triangle triangle = surface.triangle(t, alpha);
    const Vector3d a = triangle.a - p, b = triangle.b - p, c = triangle.c - p;
    winding += std::atan2(a.dot(b.cross(c)), a.norm() * b.norm() * c.norm() + a.dot(b) * c.norm() +
                                                 b.dot(c) * a.norm() + c.dot(a) * b.norm()) /
               (2 * M_PI);
  }
  return winding > 0.5;
}

// Where the sphere of the tool touches the ellipsoid from above.
static Vector3d touchdown(const TouchShape& shape, double radius) {
  Buckets buckets({shape}, radius, frameAt(*shape, 0));
  SurfaceHit hit;
  EXPECT_TRUE(buckets.sweep({0.012, 0.004, 0.2}, {0, 0, -0.2}, radius, 1, -1, hit));
  return {0.012, 0.004, 0.2 - 0.2 * hit.t};
}

static Vector3d wanderingDevice(double t) {
  const Vector3d smooth(0.09 * std::sin(2.1 * t + 1), 0.06 * std::sin(3.3 * t), 0.05 * std::sin(4.7 * t + 2));
  // A jump now and then: a lost tracker, a trajectory cut together.
  const double block = std::floor(t / 1.7);
  return smooth + 0.05 * Vector3d(std::sin(12.9 * block), std::sin(78.2 * block), std::sin(37.7 * block));
}

static Vector3d wobble(const Vector3d& x, double t) {
  const auto wave = [&](double k, double w, double phase) {
    return std::sin(k * x.y() + w * t + phase) * std::cos(0.8 * k * x.x() - 0.7 * w * t);
  };
  return x + 0.004 * Vector3d(wave(40, 3, 0), wave(35, 5, 1), wave(30, 4, 2)) +
         0.01 * Vector3d(0, std::sin(2 * t), std::sin(9 * t));
}

TEST(Proxy, IsNeverInsideARandomlyDeformingSurface) {
  for (const double radius : {0.003, 0.0003}) {
    Script r;
    r.shape = ellipsoid(18, 14, 7);
    r.device = wanderingDevice;
    r.motion = wobble;
    r.tool.radius = radius;
    r.tool.staticFriction = 0.3;
    r.tool.dynamicFriction = 0.2;
    r.duration = 100;  // 100 000 ticks for each radius
    int n = 0, contacts = 0, tight = 0;
    run(r, [&](double, const ToolState& tool, const BlendedSurface& surface, double alpha) {
      contacts += tool.inContact;
      const double clear = clearance(surface, alpha, tool.proxy, radius);
      tight += clear < radius - 1e-9;
      ASSERT_GT(clear, 0.5 * radius);
      if (++n % 20 == 0) {
        ASSERT_FALSE(isInside(surface, alpha, tool.proxy));
      }
    });
    EXPECT_GT(contacts, 20000);
    EXPECT_EQ(tight, 0);
  }
}

// Ticks in which the surface stands well above the still device but does not hold the proxy off it.
static int lostTicks(double amplitude, double frequency, double radius) {
  Script r;
  r.shape = ellipsoid(32, 32, 50);
  r.tool.radius = radius;
  Vector3d device = touchdown(r.shape, radius) + Vector3d(0, 0, 0.002);
  const double restHeight = r.shape->restNodes[0].z();
  r.device = [=](double) { return device; };
  r.motion = [=](const Vector3d& x, double t) {
    return Vector3d(x.x(), x.y(), x.z() + amplitude * std::sin(2 * M_PI * frequency * t));
  };
  r.duration = 1.5;
  int lost = 0, touched = 0;
  Vector3d last = Vector3d::Zero();
  const double speed = 2 * M_PI * frequency * amplitude;
  run(r, [&](double t, const ToolState& tool, const BlendedSurface& surface, double alpha) {
    if (frequency < 5) {
      EXPECT_LE((tool.force - last).norm(), 3 * r.tool.stiffness * speed * tickDuration) << t;
    }
    last = tool.force;
    if (surface.node(0, alpha).z() - restHeight < 0.0025) return;
    ++touched;
    lost += !tool.inContact || (tool.proxy - tool.device).norm() < 1e-6;
    // The force is that of the surface without the blend's delay; at 10 Hz a frame is an eighth of the motion.
    if (frequency < 5 && r.motion(r.shape->restNodes[0], t).z() - restHeight > 0.0035) lost += tool.force.norm() < 1e-6;
  });
  EXPECT_GT(touched, 400);
  return lost;
}

TEST(Proxy, AStillDeviceFeelsASurfaceThatMovesThroughIt) {
  for (const double frequency : {2.0, 10.0})
    for (const double radius : {0.003, 1e-4, 1e-5})
      EXPECT_EQ(lostTicks(0.01, frequency, radius), 0) << frequency << " Hz, radius " << radius;
}

TEST(Proxy, AThinPlateMovingPastADeviceBehindItKeepsTheProxyInFront) {
  Script r;
  r.shape = plate(20, 0.03, 0.001, 7);
  r.tool.radius = 0.0005;
  r.device = [](double t) { return Vector3d(0.0013, 0.007 - 0.017 * std::min(1.0, t / 0.1), 0.0007); };
  r.motion = [](const Vector3d& x, double t) {
    return Vector3d(x + 0.005 * std::sin(2 * M_PI * 3 * std::max(0.0, t - 0.2)) * Vector3d::UnitY());
  };
  r.duration = 1.2;
  int lost = 0;
  run(r, [&](double t, const ToolState& tool, const BlendedSurface& surface, double alpha) {
    EXPECT_GT(tool.proxy.y(), surface.node(0, alpha).y());
    if (t > 0.16) lost += (tool.proxy - tool.device).norm() < 1e-6;
  });
  EXPECT_EQ(lost, 0);
}

TEST(Proxy, ATapAtAnySpeedIsFelt) {
  for (const double speed : {1.0, 5.0, 100.0})
    for (const double radius : {0.003, 1e-4}) {
      Script r;
      r.shape = ellipsoid(32, 32, 50);
      r.tool.radius = radius;
      const Vector3d touch = touchdown(r.shape, radius);
      r.device = [=](double t) {
        return Vector3d(touch + Vector3d(0, 0, 0.01 - std::clamp(speed * (t - 0.05), 0.0, 0.03)));
      };
      r.duration = 0.3;
      int lost = 0;
      run(r, [&](double t, const ToolState& tool, const BlendedSurface&, double) {
        if (t > 0.051 + 0.0101 / speed) lost += tool.force.norm() < 1e-6;
      });
      EXPECT_EQ(lost, 0) << speed << " m/s, radius " << radius;
    }
}

TEST(Proxy, RestsInACornerWithoutJitter) {
  const double h = 0.02;
  std::vector<Vector3d> nodes;
  nodes.reserve(8);
  for (int i = 0; i < 8; ++i) nodes.emplace_back(i & 1 ? h : -h, i & 2 ? h : -h, i & 4 ? h : -h);
  // Wound to the inside: the tool is in a box.
  Script r;
  r.shape = shapeOf(nodes, {{0, 1, 2},
                            {1, 3, 2},
                            {4, 6, 5},
                            {5, 6, 7},
                            {0, 4, 1},
                            {1, 4, 5},
                            {2, 3, 6},
                            {3, 7, 6},
                            {0, 2, 4},
                            {2, 6, 4},
                            {1, 5, 3},
                            {3, 5, 7}});
  r.device = [](double t) {
    return Vector3d(std::clamp((t - 0.05) / 0.2, 0.0, 1.0) * Vector3d(-0.030, -0.028, -0.026));
  };
  r.duration = 0.6;
  const Vector3d corner = Vector3d::Constant(-h + r.tool.radius);
  Vector3d last;
  run(r, [&](double t, const ToolState& tool, const BlendedSurface&, double) {
    if (t > 0.3) {
      EXPECT_LT((tool.proxy - corner).norm(), 1e-6);
    }
    if (t > 0.31) {
      EXPECT_LT((tool.proxy - last).norm(), 1e-9);
    }
    last = tool.proxy;
  });
}

TEST(Proxy, FollowsTheBottomOfAGroove) {
  for (const double degrees : {90.0, 40.0, 20.0, 10.0}) {
    const double half = degrees * M_PI / 360, height = 0.05, length = 0.04, s = height * std::tan(half);
    Script r;
    r.shape = shapeOf({{-length, 0, 0},
                       {length, 0, 0},
                       {-length, s, height},
                       {length, s, height},
                       {-length, -s, height},
                       {length, -s, height}},
                      {{0, 1, 3}, {0, 3, 2}, {0, 4, 5}, {0, 5, 1}});
    const double bottom = r.tool.radius / std::sin(half);
    r.device = [=](double t) {
      return Vector3d(0.003 + 0.01 * std::clamp((t - 0.3) / 0.2, 0.0, 1.0), 0.002,
                      bottom + 0.003 - 0.010 * std::clamp((t - 0.05) / 0.15, 0.0, 1.0));
    };
    r.duration = 0.7;
    Vector3d last;
    run(r, [&](double t, const ToolState& tool, const BlendedSurface&, double) {
      if (t > 0.55) {
        EXPECT_LT((tool.proxy - Vector3d(tool.device.x(), 0, bottom)).norm(), 1e-6) << degrees;
        EXPECT_LT((tool.proxy - last).norm(), 1e-9) << degrees;
      }
      last = tool.proxy;
    });
  }
}

// Ratio of drag to press, over the way (m) from pressing 2 mm deep on.
static void slideOnPlane(double speed, double way, const std::function<void(double slid, double ratio)>& each) {
  Script r;
  r.shape = plate(20, 0.03, 0.001, 7);
  r.tool.staticFriction = 0.5;
  r.tool.dynamicFriction = 0.3;
  r.device = [=](double t) {
    const double slide = speed * std::max(0.0, t - 0.1);
    return Vector3d(-0.012 + 0.8 * slide, 0.0005 + 0.003 + 0.002 - 0.004 * std::min(1.0, t / 0.05),
                    -0.010 + 0.6 * slide);
  };
  r.duration = 0.1 + way / speed;
  run(r, [&](double t, const ToolState& tool, const BlendedSurface&, double) {
    if (t > 0.06) each(speed * (t - 0.1), std::hypot(tool.force.x(), tool.force.z()) / tool.force.y());
  });
}

TEST(Proxy, SticksUntilStaticFrictionIsReached) {
  double largest = 0;
  // A tick's way is 0.0005 of the depth.
  slideOnPlane(0.001, 0.0012, [&](double, double ratio) { largest = std::max(largest, ratio); });
  EXPECT_NEAR(largest, 0.5, 1e-3);
}

TEST(Proxy, SlidesAgainstDynamicFriction) {
  slideOnPlane(0.05, 0.0175, [&](double slid, double ratio) {
    if (slid > 0.005) {
      EXPECT_NEAR(ratio, 0.3, 1e-3);
    }
  });
}

// Over an ellipsoid of 468 triangles, 3 mm deep: along it, around it and across, as fast as 0.1 m/s.
TEST(Proxy, ACoarseMeshFeelsSmooth) {
  Script r;
  r.shape = ellipsoid(18, 14, 7, 0);
  const Vector3d half(0.10, 0.06, 0.05);
  const auto outward = [&](const Vector3d& p) {
    return Vector3d(p.cwiseQuotient(half.cwiseProduct(half)).normalized());
  };
  r.device = [&](double t) {
    const double theta = 0.5 * M_PI + 0.6 * std::sin(1.3 * t), phi = 0.9 * t;
    const Vector3d on(half.x() * std::cos(theta), half.y() * std::sin(theta) * std::cos(phi),
                      half.z() * std::sin(theta) * std::sin(phi));
    return Vector3d(on + (0.006 - 0.006 * std::min(1.0, t / 0.1)) * outward(on));
  };
  r.duration = 6;
  Vector3d last = Vector3d::Zero(), lastDevice = r.device(0);
  double worstStep = 0, worstAngle = 0, fastest = 0;
  run(r, [&](double t, const ToolState& tool, const BlendedSurface&, double) {
    if (t > 0.15) {
      worstStep = std::max(worstStep, (tool.force - last).norm());
      worstAngle = std::max(worstAngle, std::acos(tool.force.normalized().dot(outward(tool.device))));
      fastest = std::max(fastest, (tool.device - lastDevice).norm() / tickDuration);
    }
    last = tool.force;
    lastDevice = tool.device;
  });
  EXPECT_GT(fastest, 0.09);
  RecordProperty("worst_step", std::to_string(worstStep));
  std::printf("worst step %g N, angle %g deg, fastest %g\n", worstStep, worstAngle * 180 / M_PI, fastest);
  EXPECT_LE(worstStep, 0.03);
  EXPECT_LE(worstAngle * 180 / M_PI, 2);
}

TEST(Proxy, PressingForceHasNoStepsBeyondTheDevicesOwn) {
  Script r;
  r.shape = plate(10, 0.03, 0.01, 5);
  const double speed = 0.1;
  r.device = [=](double t) {
    return Vector3d(0.0013, 0.013 - speed * std::min(t, 0.13) + speed * std::max(0.0, t - 0.4), 0.0007);
  };
  r.duration = 0.6;
  Vector3d last = Vector3d::Zero();
  double largest = 0, work = 0;
  Vector3d lastDevice = r.device(0);
  run(r, [&](double, const ToolState& tool, const BlendedSurface&, double) {
    largest = std::max(largest, (tool.force - last).norm());
    work += last.dot(tool.device - lastDevice);
    last = tool.force;
    lastDevice = tool.device;
  });
  EXPECT_LE(largest, 1.2 * r.tool.stiffness * speed * tickDuration);
  // Sampled springs give out a little: at most k v T per metre travelled (Colgate and Schenkel 1997).
  EXPECT_LE(work, r.tool.stiffness * speed * tickDuration * 0.008 * (1 + 1e-3));
}

TEST(Proxy, SurvivesJumpsOfAMetre) {
  Script r;
  r.shape = ellipsoid(18, 14, 7);
  // From a press to far behind the body, then to the free space above it.
  r.device = [](double t) {
    return t < 0.1 ? Vector3d(0, 0, 0.045) : t < 0.2 ? Vector3d(0.001, 0.0005, -1) : Vector3d(0.9, 0, 0.3);
  };
  r.duration = 0.4;
  run(r, [&](double t, const ToolState& tool, const BlendedSurface& surface, double alpha) {
    ASSERT_GE(clearance(surface, alpha, tool.proxy, r.tool.radius), r.tool.radius - 1e-9);
    ASSERT_LE(tool.force.norm(), r.tool.forceMax * (1 + 1e-12));
    if (t > 0.101 && t < 0.199) {
      EXPECT_EQ(tool.clamped, tool.inContact);
    }
    if (t > 0.35) {
      EXPECT_LT((tool.proxy - tool.device).norm(), 1e-9);
    }
  });
}

TEST(Proxy, ThatStartsInsideIsPutOutside) {
  TestRandom random;
  for (int n = 0; n < 50; ++n) {
    Script r;
    r.shape = ellipsoid(18, 14, 7);
    Vector3d start = random.vector(1).cwiseProduct(Vector3d(0.08, 0.04, 0.03));
    r.device = [=](double) { return start; };
    r.duration = 0.05;
    run(r, [&](double t, const ToolState& tool, const BlendedSurface& surface, double alpha) {
      ASSERT_FALSE(isInside(surface, alpha, tool.proxy));
      if (t > 0.01) {
        ASSERT_GE(clearance(surface, alpha, tool.proxy, r.tool.radius), r.tool.radius - 1e-9);
      }
    });
  }
}

// Two walls close on a still tool until less than its diameter is left between them, and open again.
TEST(Proxy, SqueezedBetweenWallsShrinksAndDoesNotTunnel) {
  Script r;
  const double w = 0.03;
  std::vector<Vector3d> nodes;
  for (const double y : {0.01, -0.01})
    for (const double x : {-w, w})
      for (const double z : {-w, w}) nodes.emplace_back(x, y, z);
  r.shape = shapeOf(nodes, {{0, 2, 3}, {0, 3, 1}, {4, 7, 6}, {4, 5, 7}});
  r.device = [](double) { return Vector3d(0.001, 0.002, 0.0005); };
  r.motion = [](const Vector3d& x, double t) {
    return Vector3d(x.x(), (x.y() > 0 ? 1 : -1) * (0.0055 + 0.0045 * std::cos(10 * t)), x.z());
  };
  r.duration = 1.5;
  run(r, [&](double, const ToolState& tool, const BlendedSurface& surface, double alpha) {
    ASSERT_LT(tool.proxy.y(), surface.node(0, alpha).y());
    ASSERT_GT(tool.proxy.y(), surface.node(4, alpha).y());
  });
}

}  // namespace medulla
