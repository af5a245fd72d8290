#include "haptics/proxy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "haptics/half_spaces.h"
#include "tests/proxy_run.h"

namespace medulla {

using Eigen::Vector3d;

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
    ASSERT_TRUE(nearestInHalfSpaces(goal, std::span(planes, count), x, pressure));
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

// Faces of a smooth mesh, a hundredth of a radian apart: what is lost by rounding makes no wall.
TEST(HalfSpaces, FacesThatLieNearlyAlikeLeaveRoomAtAnyDepth) {
  TestRandom random;
  int missed = 0;
  for (const double depth : {1e-3, 1e-5, 1e-7}) {
    for (int n = 0; n < 2000; ++n) {
      const Vector3d goal = random.vector(0.1), normal = random.vector(1).normalized();
      const Vector3d corner = goal + depth * normal + random.vector(0.005 * depth);  // all three are active by turns
      HalfSpace planes[3];
      for (HalfSpace& plane : planes) {
        plane.normal = (normal + random.vector(0.01)).normalized();
        plane.offset = plane.normal.dot(corner);
      }
      Vector3d x;
      std::array<double, 3> pressure;
      if (!nearestInHalfSpaces(goal, planes, x, pressure)) ++missed;
    }
  }
  EXPECT_EQ(missed, 0);
}

TEST(HalfSpaces, OppositeWallsWithoutRoomAreReported) {
  const HalfSpace walls[2] = {{Vector3d::UnitX(), 0.001}, {-Vector3d::UnitX(), 0.001}};
  Vector3d x;
  std::array<double, 3> pressure;
  EXPECT_FALSE(nearestInHalfSpaces({0, 0, 0}, walls, x, pressure));
}

// ---- Whole ticks -----------------------------------------------------------------------------------------

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
    ProxyRun r;
    r.shape = ellipsoid(18, 14, 7);
    r.device = wanderingDevice;
    r.motion = wobble;
    r.tool.radius = radius;
    r.tool.staticFriction = 0.3;
    r.tool.dynamicFriction = 0.2;
    r.duration = 100;  // 100 000 ticks for each radius
    int n = 0, contacts = 0, tight = 0;
    r.run([&](double, const ToolState& tool, const BlendedSurface& surface, double alpha) {
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

TEST(Proxy, SurvivesJumpsOfAMetre) {
  ProxyRun r;
  r.shape = ellipsoid(18, 14, 7);
  // From a press to far behind the body, then to the free space above it.
  r.device = [](double t) {
    return t < 0.1 ? Vector3d(0, 0, 0.045) : t < 0.2 ? Vector3d(0.001, 0.0005, -1) : Vector3d(0.9, 0, 0.3);
  };
  r.duration = 0.4;
  r.run([&](double t, const ToolState& tool, const BlendedSurface& surface, double alpha) {
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
    ProxyRun r;
    r.shape = ellipsoid(18, 14, 7);
    Vector3d start = random.vector(1).cwiseProduct(Vector3d(0.08, 0.04, 0.03));
    r.device = [=](double) { return start; };
    r.duration = 0.05;
    r.run([&](double t, const ToolState& tool, const BlendedSurface& surface, double alpha) {
      ASSERT_FALSE(isInside(surface, alpha, tool.proxy));
      if (t > 0.01) {
        ASSERT_GE(clearance(surface, alpha, tool.proxy, r.tool.radius), r.tool.radius - 1e-9);
      }
    });
  }
}

// Two walls close on a still tool until less than its diameter is left between them, and open again.
TEST(Proxy, SqueezedBetweenWallsShrinksAndDoesNotTunnel) {
  ProxyRun r;
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
  r.run([&](double, const ToolState& tool, const BlendedSurface& surface, double alpha) {
    ASSERT_LT(tool.proxy.y(), surface.node(0, alpha).y());
    ASSERT_GT(tool.proxy.y(), surface.node(4, alpha).y());
    const double room = 0.5 * (surface.node(0, alpha) - surface.node(4, alpha)).y();
    if (room < 0.5 * r.tool.radius) {
      ASSERT_TRUE(tool.squeezed);
    } else if (room > r.tool.radius) {
      ASSERT_FALSE(tool.squeezed);
    }
  });
}

// The planes of two walls that are all but parallel meet metres away: no room for the tool.
TEST(Proxy, IsNotThrownOutOfAWedge) {
  for (const double slant : {0.0, 1e-6, 1e-5, 1e-4, 1e-3}) {
    ProxyRun r;
    const double w = 0.03;
    std::vector<Vector3d> nodes;
    for (const double y : {0.01, -0.01})
      for (const double x : {-w, w})
        for (const double z : {-w, w}) nodes.emplace_back(x, y + (y > 0 ? slant * x : 0), z);
    r.shape = shapeOf(nodes, {{0, 2, 3}, {0, 3, 1}, {4, 7, 6}, {4, 5, 7}});
    r.device = [](double) { return Vector3d(0.001, 0.002, 0.0005); };
    r.motion = [](const Vector3d& x, double t) {
      return Vector3d(x.x(), x.y() - (x.y() > 0 ? 1 : -1) * std::min(0.008, 0.02 * t), x.z());
    };
    r.duration = 0.6;
    Vector3d last(0.001, 0.002, 0.0005);
    r.run([&](double, const ToolState& tool, const BlendedSurface&, double) {
      ASSERT_LT((tool.proxy - last).norm(), 0.001) << slant;
      last = tool.proxy;
    });
  }
}

// A fan of needles and points without area in the middle of a plate, which is slid over along its shared edges.
TEST(Proxy, SlidesOverDegenerateTrianglesAndAlongSharedEdges) {
  const TouchShape whole = plate(8, 0.02, 0.004, 3);
  auto shape = std::make_shared<SoftBodyModel>(*whole);
  const std::vector<std::array<int, 3>> triangles = shape->triangles;
  for (const auto& [a, b, c] : triangles) {
    shape->triangles.push_back({a, a, b});
    shape->triangles.push_back({c, c, c});
    shape->triangles.push_back({a, b, a});
  }
  fillBuckets(*shape, 3);
  ProxyRun r;
  r.shape = shape;
  r.device = [](double t) {
    const double down = 0.005 * std::min(1.0, t / 0.05), slide = 0.03 * std::clamp((t - 0.1) / 0.3, 0.0, 1.0);
    return Vector3d(0, 0.006 - down, -0.015 + slide);  // x = 0 is a row of edges
  };
  r.duration = 0.5;
  r.run([&](double t, const ToolState& tool, const BlendedSurface&, double) {
    if (t < 0.06) return;
    ASSERT_NEAR(tool.proxy.y(), 0.005, 2e-7) << t;
    ASSERT_NEAR(tool.proxy.x(), 0, 1e-9) << t;
    ASSERT_NEAR(tool.force.normalized().y(), 1, 1e-6) << t;
  });
}

TEST(Proxy, SweptExactlyDownOntoASharedEdgeStopsThere) {
  for (const double x : {0.0, 0.005, 0.0025}) {  // edge across, node, diagonal
    ProxyRun r;
    r.shape = plate(8, 0.02, 0.004, 3);
    r.tool.radius = 1e-5;
    r.device = [=](double t) { return Vector3d(x, 0.01 - 0.02 * t, x); };
    r.duration = 0.9;
    r.run([&](double t, const ToolState& tool, const BlendedSurface&, double) {
      if (t > 0.41) {
        ASSERT_GT(tool.proxy.y(), 0.002) << t;
      }
    });
  }
}

// Frames at 20 ms, swapped while the tool slides over a surface that moves: no step in the force.
TEST(Proxy, ASwapOfFramesInMidSlideIsNotFelt) {
  ProxyRun r;
  r.shape = ellipsoid(32, 32, 50, 0);
  r.motion = [](const Vector3d& x, double t) {
    return Vector3d(x + 0.002 * std::sin(2 * std::numbers::pi * 3 * t) * Vector3d::UnitZ());
  };
  r.device = [](double t) {
    return Vector3d(0.03 * std::sin(2 * t), 0.01 * std::sin(3 * t), 0.06 - 0.012 * std::min(1.0, t / 0.2));
  };
  r.duration = 2;
  Vector3d last = Vector3d::Zero();
  double atSwap = 0, elsewhere = 0;
  int n = 0;
  r.run([&](double t, const ToolState& tool, const BlendedSurface&, double) {
    double& largest = n++ % 20 == 0 ? atSwap : elsewhere;
    if (t > 0.3) largest = std::max(largest, (tool.force - last).norm());
    last = tool.force;
  });
  EXPECT_GT(last.norm(), 0.5);
  EXPECT_LT(atSwap, 1.5 * elsewhere);
  EXPECT_LT(elsewhere, 3 * r.tool.stiffness * 0.06 * tickDuration);
}

// A pole of 36 triangles of 2 mm that trembles by most of that from tick to tick: some turn over as they pass a tool of
// 3 mm, and the surface passes through itself. What it takes in for a tick it puts out again.
TEST(Proxy, TrianglesThatTurnOverDoNotKeepItInside) {
  ProxyRun r;
  r.shape = ellipsoid(36, 60, 12, 0);
  r.ticksPerFrame = 1;
  r.tool.radius = 0.003;
  r.device = [](double t) { return Vector3d(0.105 - 0.02 * std::min(1.0, t / 0.3), 0, 0); };
  r.motion = [random = TestRandom{8}](const Vector3d& rest, double time) mutable {
    const Vector3d tremor = random.vector(rest.x() > 0.09 ? 0.0015 : 0);
    return Vector3d(rest + std::min(1.0, time / 0.1) * tremor);
  };
  int touched = 0, inside = 0;
  r.run([&](double, const ToolState& tool, const BlendedSurface& surface, double alpha) {
    touched += tool.inContact;
    inside += isInside(surface, alpha, tool.proxy);
  });
  EXPECT_GT(touched, 500);
  EXPECT_LT(inside, 10);
}

// As a body does that diverges, in the frame before its numbers are none any more.
TEST(Proxy, ASurfaceThatCarriesItAwayIsNotFiniteInEffect) {
  ProxyRun r;
  r.shape = ellipsoid(16, 16, 50, 0);
  r.device = [](double t) { return Vector3d(0, 0, 0.06 - 0.012 * std::min(1.0, t / 0.2)); };
  r.motion = [](const Vector3d& x, double t) { return Vector3d(x + 1e7 * std::max(0.0, t - 0.4) * Vector3d::UnitZ()); };
  bool touched = false;
  EXPECT_THROW(
      r.run([&](double, const ToolState& tool, const BlendedSurface&, double) { touched = touched || tool.inContact; }),
      NotFinite);
  EXPECT_TRUE(touched);
}

}  // namespace medulla
