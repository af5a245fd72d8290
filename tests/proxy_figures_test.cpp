#include <algorithm>
#include <cstdio>
#include <numbers>

#include "tests/proxy_run.h"
#include "tests/tool_run.h"

// Figures that a proxy has to reach. Each is printed beside its limit:
//   build/medulla_tests --gtest_filter='ProxyFigures.*' | grep reached
namespace medulla {

using Eigen::Vector3d;

static void expectReached(const char* what, double reached, double limit) {
  std::printf("[  reached ] %s: %.4g, to hold <= %.4g\n", what, reached, limit);
  EXPECT_LE(reached, limit) << what;
}

// Where the sphere of the tool touches the ellipsoid from above.
static Vector3d touchdown(const TouchShape& shape, double radius) {
  Buckets buckets({{shape}}, radius, frameAt(*shape, 0));
  SurfaceHit hit;
  EXPECT_TRUE(buckets.sweep({0.012, 0.004, 0.2}, {0, 0, -0.2}, radius, 1, -1, hit));
  return {0.012, 0.004, 0.2 - 0.2 * hit.t};
}

namespace {
struct Felt {
  int lost = 0;     // ticks in which the surface stands well above the still device but does not hold the proxy off it
  double step = 0;  // N, largest from tick to tick
};
}  // namespace

static Felt feelMovingSurface(double amplitude, double frequency, double radius) {
  ProxyRun r;
  r.shape = ellipsoid(32, 32, 50);
  r.tool.radius = radius;
  Vector3d device = touchdown(r.shape, radius) + Vector3d(0, 0, 0.002);
  const double restHeight = r.shape->restNodes[0].z();
  r.device = [=](double) { return device; };
  r.motion = [=](const Vector3d& x, double t) {
    return Vector3d(x.x(), x.y(), x.z() + amplitude * std::sin(2 * std::numbers::pi * frequency * t));
  };
  r.duration = 1.5;
  Felt felt;
  int touched = 0;
  Vector3d last = Vector3d::Zero();
  r.run([&](double t, const ToolState& tool, const BlendedSurface& surface, double alpha) {
    felt.step = std::max(felt.step, (tool.force - last).norm());
    last = tool.force;
    if (surface.node(0, alpha).z() - restHeight < 0.0025) return;
    ++touched;
    felt.lost += !tool.inContact || (tool.proxy - tool.device).norm() < 1e-6;
    // The force is that of the surface without the blend's delay; at 10 Hz a frame is an eighth of the motion.
    if (frequency < 5 && r.motion(r.shape->restNodes[0], t).z() - restHeight > 0.0035)
      felt.lost += tool.force.norm() < 1e-6;
  });
  EXPECT_GT(touched, 400);
  return felt;
}

TEST(ProxyFigures, AStillDeviceFeelsASurfaceThatMovesThroughIt) {
  for (const double radius : {0.003, 1e-4, 1e-5}) {
    const Felt slow = feelMovingSurface(0.01, 2, radius), fast = feelMovingSurface(0.01, 10, radius);
    const std::string what = "surface +-10 mm, radius " + std::to_string(1e3 * radius) + " mm, ";
    expectReached((what + "2 Hz, lost ticks").c_str(), slow.lost, 0);
    expectReached((what + "2 Hz, force step (N)").c_str(), slow.step,
                  3 * 400 * 2 * std::numbers::pi * 2 * 0.01 * tickDuration);
    expectReached((what + "10 Hz, lost ticks").c_str(), fast.lost, 0);
  }
}

TEST(ProxyFigures, AThinPlateMovingPastADeviceBehindItKeepsTheProxyInFront) {
  for (const double radius : {0.003, 0.0005}) {
    ProxyRun r;
    r.shape = plate(20, 0.03, 0.001, 7);
    r.tool.radius = radius;
    r.device = [](double t) { return Vector3d(0.0013, 0.007 - 0.017 * std::min(1.0, t / 0.1), 0.0007); };
    r.motion = [](const Vector3d& x, double t) {
      return Vector3d(x + 0.005 * std::sin(2 * std::numbers::pi * 3 * std::max(0.0, t - 0.2)) * Vector3d::UnitY());
    };
    r.duration = 1.2;
    int lost = 0;
    r.run([&](double t, const ToolState& tool, const BlendedSurface& surface, double alpha) {
      EXPECT_GT(tool.proxy.y(), surface.node(0, alpha).y());
      if (t > 0.16) lost += (tool.proxy - tool.device).norm() < 1e-6;
    });
    expectReached("thin plate between device and proxy, lost ticks", lost, 0);
  }
}

TEST(ProxyFigures, ATapAtAnySpeedIsFelt) {
  for (const double speed : {1.0, 5.0, 100.0}) {
    int lost = 0;
    for (const double radius : {0.003, 1e-4}) {
      ProxyRun r;
      r.shape = ellipsoid(32, 32, 50);
      r.tool.radius = radius;
      const Vector3d touch = touchdown(r.shape, radius);
      r.device = [=](double t) {
        return Vector3d(touch + Vector3d(0, 0, 0.01 - std::clamp(speed * (t - 0.05), 0.0, 0.03)));
      };
      r.duration = 0.3;
      r.run([&](double t, const ToolState& tool, const BlendedSurface&, double) {
        if (t > 0.051 + 0.0101 / speed) lost += tool.force.norm() < 1e-6;
      });
    }
    expectReached(("tap at " + std::to_string(int(speed)) + " m/s, lost ticks").c_str(), lost, 0);
  }
}

TEST(ProxyFigures, RestsInACornerWithoutJitter) {
  const double h = 0.02;
  std::vector<Vector3d> nodes;
  nodes.reserve(8);
  for (int i = 0; i < 8; ++i) nodes.emplace_back(i & 1 ? h : -h, i & 2 ? h : -h, i & 4 ? h : -h);
  // Wound to the inside: the tool is in a box.
  ProxyRun r;
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
  double off = 0, jitter = 0;
  r.run([&](double t, const ToolState& tool, const BlendedSurface&, double) {
    if (t > 0.3) off = std::max(off, (tool.proxy - corner).norm());
    if (t > 0.31) jitter = std::max(jitter, (tool.proxy - last).norm());
    last = tool.proxy;
  });
  expectReached("corner of three planes, off by (m)", off, 1e-6);
  expectReached("corner of three planes, jitter (m)", jitter, 1e-9);
}

// Along x, open towards z, its edge at the origin.
static TouchShape grooveOf(double half) {
  const double height = 0.05, length = 0.04, s = height * std::tan(half);
  return shapeOf({{-length, 0, 0},
                  {length, 0, 0},
                  {-length, s, height},
                  {length, s, height},
                  {-length, -s, height},
                  {length, -s, height}},
                 {{0, 1, 3}, {0, 3, 2}, {0, 4, 5}, {0, 5, 1}});
}

TEST(ProxyFigures, FollowsTheBottomOfAGroove) {
  for (const double degrees : {90.0, 40.0, 20.0, 10.0}) {
    const double half = degrees * std::numbers::pi / 360;
    ProxyRun r;
    r.shape = grooveOf(half);
    const double bottom = r.tool.radius / std::sin(half);
    r.device = [=](double t) {
      return Vector3d(0.003 + 0.01 * std::clamp((t - 0.3) / 0.2, 0.0, 1.0), 0.002,
                      bottom + 0.003 - 0.010 * std::clamp((t - 0.05) / 0.15, 0.0, 1.0));
    };
    r.duration = 0.7;
    Vector3d last;
    double off = 0, jitter = 0;
    r.run([&](double t, const ToolState& tool, const BlendedSurface&, double) {
      if (t > 0.55) {
        off = std::max(off, (tool.proxy - Vector3d(tool.device.x(), 0, bottom)).norm());
        jitter = std::max(jitter, (tool.proxy - last).norm());
      }
      last = tool.proxy;
    });
    const std::string what = "groove of " + std::to_string(int(degrees)) + " degrees, ";
    expectReached((what + "off by (m)").c_str(), off, 1e-6);
    expectReached((what + "jitter (m)").c_str(), jitter, 1e-9);
  }
}

// Friction is that of what presses on the walls, 1 / sin(half the angle) of what presses the tool down.
TEST(ProxyFigures, BothWallsOfAGrooveHoldBack) {
  for (const double degrees : {120.0, 90.0, 60.0}) {
    const double half = degrees * std::numbers::pi / 360;
    ProxyRun r;
    r.shape = grooveOf(half);
    r.tool.staticFriction = 0.3;
    r.tool.dynamicFriction = 0.2;
    const double bottom = r.tool.radius / std::sin(half);
    r.device = [=](double t) {
      return Vector3d(0.01 * std::clamp(t - 0.3, 0.0, 1.0), 0, bottom + 0.001 - 0.003 * std::min(1.0, t / 0.2));
    };
    r.duration = 1.3;
    double off = 0;
    r.run([&](double t, const ToolState& tool, const BlendedSurface&, double) {
      if (t > 0.6) off = std::max(off, std::abs(-tool.force.x() / tool.force.z() * std::sin(half) - 0.2));
    });
    expectReached(("friction of 0.2 in a groove of " + std::to_string(int(degrees)) + " degrees, off by").c_str(), off,
                  1e-3);
  }
}

// Over a fine mesh, deep in a dent that goes along with it: three of its walls and more hold the proxy by turns.
TEST(ProxyFigures, SlidesOverFineMeshesAreFeltWithoutSteps) {
  ProxyRun r;
  r.shape = plate(24, 0.03, 0.01, 5);
  r.tool.radius = 0.003;
  r.tool.staticFriction = 0.3;
  r.tool.dynamicFriction = 0.2;
  const auto place = [](double t) { return 0.007 * (std::max(0.0, t - 0.2) - 1); };
  const auto pressed = [](double t) { return std::min(1.0, t / 0.1); };
  r.motion = [=](const Vector3d& x, double t) {
    const double away = std::hypot(x.x() - place(t), x.z() - 0.3 * place(t)) / 0.004;
    return Vector3d(x.x(), x.y() - (x.y() > 0 ? 0.0025 * pressed(t) * std::exp(-away * away / 2) : 0), x.z());
  };
  r.device = [=](double t) { return Vector3d(place(t), 0.008 - 0.003 * pressed(t), 0.3 * place(t)); };
  r.duration = 2.2;
  double step = 0, most = 0;
  Vector3d last = Vector3d::Zero();
  r.run([&](double t, const ToolState& tool, const BlendedSurface&, double) {
    if (t > 0.5) step = std::max(step, (tool.force - last).norm());
    last = tool.force;
    most = std::max(most, last.norm());
  });
  expectReached("slide in a dent of fine triangles, force step of the force", step / most, 0.02);
}

// In a dent that goes along with it, over a line of the mesh: the tool comes off one of the dent's walls by micrometres
// each tick, and both hold it back.
TEST(ProxyFigures, BothWallsOfADentThatMovesHoldBack) {
  for (const int n : {8, 20}) {
    ProxyRun r;
    r.shape = plate(n, 0.03, 0.01, 5);
    r.tool.radius = 0.005;
    r.tool.staticFriction = 0.25;
    r.tool.dynamicFriction = 0.2;
    const auto place = [](double t) { return 0.015 * (std::max(0.0, t - 0.2) - 1); };
    const auto pressed = [](double t) { return std::min(1.0, t / 0.1); };
    r.motion = [=](const Vector3d& x, double t) {
      const double away = std::hypot(x.x() - place(t), x.z()) / 0.008;
      return Vector3d(x.x(), x.y() - (x.y() > 0 ? 0.0025 * pressed(t) * std::exp(-away * away / 2) : 0), x.z());
    };
    r.device = [=](double t) { return Vector3d(place(t), 0.010 - 0.0035 * pressed(t), 0); };
    r.duration = 2.2;
    double off = 0;
    r.run([&](double t, const ToolState& tool, const BlendedSurface&, double) {
      if (t > 0.5) off = std::max(off, std::abs(tool.force.z()) / tool.force.y());
    });
    expectReached("friction of 0.2 in a dent that moves, beside its way", off, 0.02);
  }
}

// Ratio of drag to press, over the way (m) from pressing 2 mm deep on.
static void slideOnPlane(double speed, double way, const std::function<void(double slid, double ratio)>& each) {
  ProxyRun r;
  r.shape = plate(20, 0.03, 0.001, 7);
  r.tool.staticFriction = 0.5;
  r.tool.dynamicFriction = 0.3;
  r.device = [=](double t) {
    const double slide = speed * std::max(0.0, t - 0.1);
    return Vector3d(-0.012 + 0.8 * slide, 0.0005 + 0.003 + 0.002 - 0.004 * std::min(1.0, t / 0.05),
                    -0.010 + 0.6 * slide);
  };
  r.duration = 0.1 + way / speed;
  r.run([&](double t, const ToolState& tool, const BlendedSurface&, double) {
    if (t > 0.06) each(speed * (t - 0.1), std::hypot(tool.force.x(), tool.force.z()) / tool.force.y());
  });
}

TEST(ProxyFigures, SticksUntilStaticFrictionIsReached) {
  double largest = 0;
  // A tick's way is 0.0005 of the depth.
  slideOnPlane(0.001, 0.0012, [&](double, double ratio) { largest = std::max(largest, ratio); });
  expectReached("static friction of 0.5, off by", std::abs(largest - 0.5), 1e-3);
}

TEST(ProxyFigures, SlidesAgainstDynamicFriction) {
  double off = 0;
  slideOnPlane(0.05, 0.0175, [&](double slid, double ratio) {
    if (slid > 0.005) off = std::max(off, std::abs(ratio - 0.3));
  });
  expectReached("dynamic friction of 0.3, off by", off, 1e-3);
}

// Along a trough that is bent by 2 degrees every 5.2 mm, 2 mm deep, then still. `each` gets the ratio of drag to press,
// against the round trough's normal; by the mesh's a degree more or less is right.
static void slideAlongTrough(const std::function<void(double time, double ratio)>& each) {
  constexpr double round = 0.15, bend = 2 * std::numbers::pi / 180, halfWidth = 0.03;  // m, rad, m
  constexpr int half = 10;
  std::vector<Vector3d> nodes;
  std::vector<std::array<int, 3>> triangles;
  for (int i = -half; i <= half; ++i)
    for (const double z : {-halfWidth, halfWidth})
      nodes.emplace_back(round * std::sin(i * bend), -round * std::cos(i * bend), z);
  for (int i = 0; i < 4 * half; i += 2) {
    triangles.push_back({i, i + 1, i + 3});
    triangles.push_back({i, i + 3, i + 2});
  }
  ProxyRun r;
  r.shape = shapeOf(nodes, triangles);
  r.tool.staticFriction = 0.3;
  r.tool.dynamicFriction = 0.2;
  const auto angle = [=](double t) { return bend * (-6.3 + 11.6 * std::clamp((t - 0.2) / 3, 0.0, 1.0)); };
  r.device = [=](double t) {
    const double depth = round - r.tool.radius + 0.002 * std::min(1.0, t / 0.1);
    return Vector3d(depth * std::sin(angle(t)), -depth * std::cos(angle(t)), 0.004);
  };
  r.duration = 4;
  r.run([&](double t, const ToolState& tool, const BlendedSurface&, double) {
    const Vector3d along(std::cos(angle(t)), std::sin(angle(t)), 0), out(-along.y(), along.x(), 0);
    each(t, -tool.force.dot(along) / tool.force.dot(out));
  });
}

TEST(ProxyFigures, CreasesOfTheMeshDoNotChangeFriction) {
  double off = 0, least = 1;
  slideAlongTrough([&](double t, double ratio) {
    if (t > 0.6 && t < 3.2) off = std::max(off, std::abs(ratio - 0.2));
    if (t > 3.2) least = std::min(least, ratio);
  });
  expectReached("friction of 0.2 over creases of 2 degrees, off by", off, 0.025);
  expectReached("the same, still: less by", 0.2 - least, 0.025);
}

// A tool comes down on a plate that moves sideways, and moves along with it: nothing is dragged, though the surface
// that the tool sees is a frame late.
TEST(ProxyFigures, WhatMovesAlongIsNotDragged) {
  constexpr double speed = 0.02, late = 0.02;  // m/s, s
  ProxyRun r;
  r.shape = plate(10, 0.03, 0.01, 5);
  r.tool.staticFriction = r.tool.dynamicFriction = 0.5;
  r.motion = [](const Vector3d& x, double t) { return Vector3d(x.x() + speed * t, x.y(), x.z()); };
  r.device = [](double t) {
    return Vector3d(0.001 + speed * t, 0.010 - 0.004 * std::clamp((t - 0.1) / 0.1, 0.0, 1.0), 0.002);
  };
  double drag = 0;
  r.run([&](double, const ToolState& tool, const BlendedSurface&, double) {
    drag = std::max(drag, std::abs(tool.force.x()));
  });
  expectReached("moves along with what it touches, drag (N)", drag, 0.1 * r.tool.stiffness * speed * late);
}

// Around the edge of a box, whose top's triangles are three times as large as its side's: nodes' mean normals are near
// the one and far from the other.
TEST(ProxyFigures, AnEdgeOfUnevenTrianglesIsFeltAsAnEdge) {
  constexpr double depth = 0.001, degree = std::numbers::pi / 180;
  std::vector<Vector3d> nodes;
  std::vector<std::array<int, 3>> triangles;
  for (int i = 0; i <= 10; ++i) {
    const double z = 0.006 * (i - 5);
    nodes.insert(nodes.end(), {{0.03, 0, z}, {0, 0, z}, {0, -0.01, z}});
  }
  for (int i = 0; i < 10; ++i)
    for (const int a : {3 * i, 3 * i + 1}) {
      triangles.push_back({a, a + 1, a + 4});
      triangles.push_back({a, a + 4, a + 3});
    }
  ProxyRun r;
  r.shape = shapeOf(nodes, triangles);
  const auto outward = [=](double t) {
    const double angle = degree * (5 + 80 * std::clamp(t - 0.2, 0.0, 1.0));
    return Vector3d(-std::sin(angle), std::cos(angle), 0);
  };
  r.device = [=](double t) -> Vector3d {
    return (r.tool.radius + 0.001 - (0.001 + depth) * std::min(1.0, t / 0.1)) * outward(t) + Vector3d(0, 0, 0.001);
  };
  r.duration = 1.4;
  double off = 0;
  r.run([&](double t, const ToolState& tool, const BlendedSurface&, double) {
    if (t < 0.15) return;
    off = std::max(off, (tool.force - r.tool.stiffness * depth * outward(t)).norm());
  });
  expectReached("around an edge of uneven triangles: force off by (N)", off, 0.001);
}

// Over an ellipsoid of 468 triangles, 3 mm deep: along it, around it and across, as fast as 0.1 m/s.
TEST(ProxyFigures, ACoarseMeshFeelsSmooth) {
  ProxyRun r;
  r.shape = ellipsoid(18, 14, 7, 0);
  const Vector3d half(0.10, 0.06, 0.05);
  const auto outward = [&](const Vector3d& p) {
    return Vector3d(p.cwiseQuotient(half.cwiseProduct(half)).normalized());
  };
  r.device = [&](double t) {
    const double theta = 0.5 * std::numbers::pi + 0.6 * std::sin(1.3 * t), phi = 0.9 * t;
    const Vector3d on(half.x() * std::cos(theta), half.y() * std::sin(theta) * std::cos(phi),
                      half.z() * std::sin(theta) * std::sin(phi));
    return Vector3d(on + (0.006 - 0.006 * std::min(1.0, t / 0.1)) * outward(on));
  };
  r.duration = 6;
  Vector3d last = Vector3d::Zero(), lastDevice = r.device(0);
  double worstStep = 0, worstAngle = 0, fastest = 0;
  r.run([&](double t, const ToolState& tool, const BlendedSurface&, double) {
    if (t > 0.15) {
      worstStep = std::max(worstStep, (tool.force - last).norm());
      worstAngle = std::max(worstAngle, std::acos(tool.force.normalized().dot(outward(tool.device))));
      fastest = std::max(fastest, (tool.device - lastDevice).norm() / tickDuration);
    }
    last = tool.force;
    lastDevice = tool.device;
  });
  EXPECT_GT(fastest, 0.09);
  expectReached("ellipsoid of 468 triangles, force step (N)", worstStep, 0.03);
  expectReached("ellipsoid of 468 triangles, off the normal (degrees)", worstAngle * 180 / std::numbers::pi, 2);
}

TEST(ProxyFigures, PressingSomethingRigid) {
  ProxyRun r;
  r.shape = plate(10, 0.03, 0.01, 5);
  const double speed = 0.1;
  r.device = [=](double t) {
    return Vector3d(0.0013, 0.013 - speed * std::min(t, 0.13) + speed * std::max(0.0, t - 0.4), 0.0007);
  };
  r.duration = 0.6;
  Vector3d last = Vector3d::Zero(), lastDevice = r.device(0);
  double largest = 0, energy = 0, work = 0;
  r.run([&](double, const ToolState& tool, const BlendedSurface&, double) {
    largest = std::max(largest, (tool.force - last).norm());
    work += last.dot(tool.device - lastDevice);
    last = tool.force;
    lastDevice = tool.device;
    energy = tool.energy;
  });
  EXPECT_NEAR(energy, work, 1e-12);
  const double perTick = r.tool.stiffness * speed * tickDuration;
  expectReached("rigid, 8 mm at 0.1 m/s, force step (N)", largest, 1.2 * perTick);
  // Sampled springs give out k v T D (Colgate and Schenkel 1997); the depth D is 8 mm and what the proxy stops short
  // by.
  expectReached("rigid, 8 mm at 0.1 m/s, energy handed to the user (J)", energy, perTick * (0.008 + 1e-7));
  EXPECT_GT(energy, 0.5 * perTick * 0.008);
}

// 1984 triangles, 50 dynamics frames to 1000 ticks.
TEST(ProxyFigures, PressingSomethingSoft) {
  const double speed = 0.1;
  ToolRun run{SpringBody(ellipsoid(32, 32, 50, 0.3)), {}, {}, 20, tickDuration, {}};
  run.tool.damping = run.tool.staticFriction = run.tool.dynamicFriction = 0;
  const Vector3d touch = touchdown(run.body.shape, run.tool.radius);
  run.device = [=](double t) {
    const double down = std::min(0.011, speed * t), up = std::clamp(speed * (t - 0.6), 0.0, 0.02);
    return deviceAt(touch + (0.003 - down + up) * Vector3d::UnitZ());
  };
  Vector3d last = Vector3d::Zero();
  double largest = 0, energy = 0, most = 0;
  run.run(1, [&](double, const ToolState& tool) {
    largest = std::max(largest, (tool.force - last).norm());
    most = std::max(most, tool.force.norm());
    last = tool.force;
    energy = tool.energy;
  });
  EXPECT_GT(most, 0.3);
  expectReached("soft, 8 mm at 0.1 m/s, force step (N)", largest, 1.2 * run.tool.stiffness * speed * tickDuration);
  expectReached("soft, 8 mm at 0.1 m/s, energy handed to the user (J)", energy, 0);
}

}  // namespace medulla
