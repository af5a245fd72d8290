#include "haptics/buckets.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "haptics/swept_triangle.h"
#include "tests/touch_shapes.h"

namespace medulla {

using Eigen::Vector3d;

// ---- Triangle tests --------------------------------------------------------------------------------------

static Triangle randomTriangle(TestRandom& random) {
  const Vector3d middle = random.vector(0.02);
  return {middle + random.vector(0.02), middle + random.vector(0.02), middle + random.vector(0.02)};
}

static double distance(const Triangle& triangle, const Vector3d& p) {
  return (closestPoint(triangle, p).point - p).norm();
}

TEST(SweptTriangle, ClosestPointBeatsEverySampledPointAndItsWeightsGiveIt) {
  TestRandom random;
  for (int n = 0; n < 2000; ++n) {
    const Triangle triangle = randomTriangle(random);
    const Vector3d p = random.vector(0.05);
    const TrianglePoint q = closestPoint(triangle, p);
    EXPECT_NEAR(q.weights.sum(), 1, 1e-12);
    EXPECT_GE(q.weights.minCoeff(), -1e-12);
    EXPECT_LT((q.weights.x() * triangle.a + q.weights.y() * triangle.b + q.weights.z() * triangle.c - q.point).norm(),
              1e-12);
    for (int k = 0; k < 50; ++k) {
      double u = random.uniform(), v = random.uniform();
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const Vector3d sample = triangle.a + u * (triangle.b - triangle.a) + v * (triangle.c - triangle.a);
      ASSERT_LE((q.point - p).norm(), (sample - p).norm() + 1e-12);
    }
  }
}

TEST(SweptTriangle, SweepStopsExactlyAtTheRadiusAndMissesNothing) {
  TestRandom random;
  int hits = 0;
  for (int n = 0; n < 20000; ++n) {
    const Triangle triangle = randomTriangle(random);
    const double radius = random.uniform(1e-4, 0.01);
    const Vector3d start = random.vector(0.06), motion = random.vector(0.08);
    if (distance(triangle, start) < 1.001 * radius) continue;
    SweepHit hit;
    const bool found = sweepSphere(start, motion, radius, triangle, 1, hit);
    if (found) {
      ++hits;
      const Vector3d centre = start + hit.t * motion, q = closestPoint(triangle, centre).point;
      ASSERT_NEAR((centre - q).norm(), radius, 1e-10);
      ASSERT_NEAR((centre - q).normalized().dot(hit.normal), 1, 1e-7);
    }
    const double clear = found ? hit.t : 1;
    for (int k = 0; k < 40; ++k) ASSERT_GE(distance(triangle, start + clear * (k / 40.0) * motion), radius - 1e-10);
  }
  EXPECT_GT(hits, 300);
}

TEST(SweptTriangle, TouchingAtTheStartHitsOnlyWhenApproaching) {
  const Triangle triangle{{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}};
  SweepHit hit;
  EXPECT_TRUE(sweepSphere({0.02, 0.02, 0.003}, {0, 0, -0.01}, 0.003, triangle, 1, hit));
  EXPECT_NEAR(hit.t, 0, 1e-12);
  EXPECT_TRUE(sweepSphere({0.02, 0.02, 0.002}, {0.01, 0, -0.01}, 0.003, triangle, 1, hit));
  EXPECT_EQ(hit.t, 0);
  EXPECT_FALSE(sweepSphere({0.02, 0.02, 0.002}, {0.01, 0, 0.01}, 0.003, triangle, 1, hit));
}

TEST(SweptTriangle, DegenerateTrianglesCountAsTheirEdges) {
  const Vector3d a(0, 0, 0), b(0.01, 0, 0), c(0.004, 0, 0);
  for (const Triangle& triangle : {Triangle{a, b, c}, Triangle{a, a, b}, Triangle{a, b, b}, Triangle{c, a, b}}) {
    EXPECT_LT((closestPoint(triangle, {0.005, 0.002, 0}).point - Vector3d(0.005, 0, 0)).norm(), 1e-15);
    SweepHit hit;
    ASSERT_TRUE(sweepSphere({0.005, 0.02, 0}, {0, -0.04, 0}, 0.003, triangle, 1, hit));
    EXPECT_NEAR(hit.t, (0.02 - 0.003) / 0.04, 1e-12);
  }
  SweepHit hit;
  ASSERT_TRUE(sweepSphere({0, 0.02, 0}, {0, -0.04, 0}, 0.003, {a, a, a}, 1, hit));
  EXPECT_NEAR(hit.t, (0.02 - 0.003) / 0.04, 1e-12);
}

// ---- Buckets ---------------------------------------------------------------------------------------------

static SurfaceHit bruteForce(const BlendedSurface& surface, const Vector3d& start, const Vector3d& motion,
                             double radius, double alpha) {
  SurfaceHit best;
  for (int t = 0; t < int(surface.triangles.size()); ++t) {
    SweepHit hit;
    if (!sweepSphere(start, motion, radius, surface.triangle(t, alpha), 1, hit)) continue;
    if (best.triangle >= 0 && hit.t >= best.t) continue;
    static_cast<SweepHit&>(best) = hit;
    best.triangle = t;
  }
  return best;
}

TEST(Buckets, SweepsEqualBruteForceBitForBitForAnyNumberOfBuckets) {
  TestRandom random;
  const SurfaceMotion wave = [](const Vector3d& x, double t) {
    return Vector3d(x + 0.004 * Vector3d(std::sin(40 * x.y() + t), std::sin(35 * x.x() + t), 0));
  };
  for (const int count : {1, 7, 40}) {
    const TouchShape shape = ellipsoid(18, 14, count);
    Buckets buckets({{shape}}, 0.003, frameAt(*shape, 0));
    const auto still = buckets.surface().steps;
    for (int frame = 0; frame < 5; ++frame) {
      buckets.commit(frameAt(*shape, frame, wave), frameAt(*shape, frame + 1, wave), still);
      if (frame % 2 == 0) buckets.refitNear(Vector3d::Zero(), 0.1);  // others are searched triangle by triangle
      for (int n = 0; n < 400; ++n) {
        const Vector3d start = random.vector(0.12), motion = random.vector(n % 2 ? 0.15 : 0.002);
        const double alpha = random.uniform(), radius = n % 3 ? 0.003 : 0.0004;
        const SurfaceHit expected = bruteForce(buckets.surface(), start, motion, radius, alpha);
        SurfaceHit hit;
        buckets.sweep(start, motion, radius, alpha, n % (count + 1) - 1, hit);
        ASSERT_EQ(hit.triangle, expected.triangle);
        ASSERT_EQ(hit.t, expected.t);
      }
    }
  }
}

TEST(Buckets, AtASharedEdgeTheLowestTriangleOfTheEarliestTimeWins) {
  const TouchShape shape = plate(4, 0.04, 0.01, 3);
  Buckets buckets({{shape}}, 0.003, frameAt(*shape, 0));
  for (const Vector3d& start : {Vector3d(0, 0.05, 0), Vector3d(0.01, 0.05, 0.01), Vector3d(0.02, 0.05, 0.005)}) {
    const SurfaceHit expected = bruteForce(buckets.surface(), start, {0, -0.06, 0}, 0.003, 1);
    SurfaceHit hit;
    ASSERT_TRUE(buckets.sweep(start, {0, -0.06, 0}, 0.003, 1, -1, hit));
    EXPECT_EQ(hit.triangle, expected.triangle);
    EXPECT_NEAR(hit.t, (0.05 - 0.005 - 0.003) / 0.06, 1e-9);
  }
}

TEST(Buckets, NearMissesNoTriangleWithinReach) {
  TestRandom random;
  const TouchShape shape = ellipsoid(18, 14, 7);
  Buckets buckets({{shape}}, 0.003, frameAt(*shape, 0));
  for (int n = 0; n < 300; ++n) {
    const Vector3d p = random.vector(0.1);
    const double reach = random.uniform(0, 0.01);
    const std::vector<int>& found = buckets.near(p, reach);
    for (int t = 0; t < int(shape->triangles.size()); ++t) {
      if (distance(buckets.surface().triangle(t, 1), p) < 0.003 + reach) {
        ASSERT_TRUE(std::binary_search(found.begin(), found.end(), t));
      }
    }
  }
}

}  // namespace medulla
