#include "haptics/inside.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "physics/model/mesh_topology.h"
#include "tests/touch_shapes.h"

namespace medulla {

using Eigen::Vector3d;

// `from` and `to`: where each body stands in the two frames.
static Buckets bucketsOf(const std::vector<TouchShape>& shapes, const std::vector<Vector3d>& from,
                         const std::vector<Vector3d>& to) {
  std::vector<TouchableBody> bodies;
  DynamicsFrame frames[2];
  for (std::size_t b = 0; b < shapes.size(); ++b) {
    bodies.push_back({shapes[b]});
    for (const auto& [frame, place] : {std::pair(&frames[0], from[b]), {&frames[1], to[b]}}) {
      frame->bodies.emplace_back().nodes = shapes[b]->restNodes;
      for (Vector3d& node : frame->bodies.back().nodes) node += place;
    }
  }
  frames[1].time = 0.05;
  Buckets buckets(bodies, 3e-3, frames[0]);
  const std::vector<Vector3d> steps(buckets.surface().from.size(), Vector3d::Zero());
  buckets.commit(frames[0], frames[1], {steps, steps, steps});
  return buckets;
}

static double windingBySolidAngles(const BlendedSurface& surface, double alpha, const Vector3d& p) {
  double angle = 0;
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    const Triangle triangle = surface.triangle(t, alpha);
    angle += solidAngle(triangle.a, triangle.b, triangle.c, p);
  }
  return angle / (4 * std::numbers::pi);
}

TEST(Inside, CrossingsSayWhatSolidAnglesSay) {
  // Another, turned inside out, around a part of the first: winding numbers from -1 to 1.
  const TouchShape body = ellipsoid(18, 14, 12), turned = ellipsoid(18, 14, 12);
  for (auto& [a, b, c] : turned->triangles) std::swap(b, c);
  const Buckets buckets =
      bucketsOf({body, turned}, {Vector3d::Zero(), {0.08, 0, 0}}, {{0.01, -0.02, 0.005}, {0.08, 0, 0}});
  TestRandom random;
  int met[3] = {0, 0, 0};
  for (int k = 0; k < 3000; ++k) {
    const double alpha = random.uniform();
    const Vector3d p = random.vector(0.1);
    const int winding = windingNumber(buckets, alpha, p);
    EXPECT_NEAR(winding, windingBySolidAngles(buckets.surface(), alpha, p), 1e-6);
    ASSERT_LE(std::abs(winding), 1);
    ++met[winding + 1];
  }
  for (const int count : met) EXPECT_GT(count, 100);
}

// A ray that meets a corner or runs along an edge crosses the surface once there.
TEST(Inside, RaysThroughCornersAndAlongEdgesCrossOnce) {
  const Buckets buckets = bucketsOf({ellipsoid(18, 14, 12, 0)}, {Vector3d::Zero()}, {Vector3d::Zero()});
  const BlendedSurface& surface = buckets.surface();
  int inside = 0;
  for (const auto& t : surface.triangles) {
    for (int k = 0; k < 3; ++k) {
      const Vector3d a = surface.from[t[k]], b = surface.from[t[(k + 1) % 3]];
      for (const Vector3d& on : {a, Vector3d(0.5 * (a + b))}) {
        for (const double z : {-1., -0.03, -0.01, 0.013, 0.04, 1.}) {
          const Vector3d p(on.x(), on.y(), z);
          const double exact = windingBySolidAngles(surface, 0, p);
          if (std::abs(z - on.z()) < 1e-3 || std::abs(exact - std::round(exact)) > 1e-6) continue;  // on the surface
          EXPECT_EQ(windingNumber(buckets, 0, p), std::lround(exact));
          inside += exact > 0.5 ? 1 : 0;
        }
      }
    }
  }
  EXPECT_GT(inside, 1000);
}

// Two plates that overlap: out of the one through its top is still in the other.
TEST(Inside, TheWayOutLeadsOutOfBothBodies) {
  const TouchShape body = plate(4, 0.1, 0.02, 1);
  const std::vector<Vector3d> places = {Vector3d::Zero(), {0, 0.005, 0}};
  const Buckets buckets = bucketsOf({body, body}, places, places);
  const Vector3d p(0.001, 0.008, 0.003);
  EXPECT_EQ(windingNumber(buckets, 1, p), 2);
  const Vector3d out = outOfBodies(buckets, 1, 1e-6, p);
  EXPECT_EQ(windingNumber(buckets, 1, out), 0);
  EXPECT_NEAR(out.y(), 0.015 + 1e-6, 1e-9);
}

// Where two surfaces cross, the nearest of either leads into the other body.
TEST(Inside, TheWayOutOfBodiesThatCrossIsFound) {
  const TouchShape body = ellipsoid(18, 14, 12);
  const std::vector<Vector3d> places = {Vector3d::Zero(), {0.03, 0.01, 0}};
  const Buckets buckets = bucketsOf({body, body}, places, places);
  TestRandom random;
  int inside = 0;
  for (int k = 0; k < 300; ++k) {
    const Vector3d p = random.vector(0.06);
    inside += windingNumber(buckets, 1, p) > 0;
    EXPECT_EQ(windingNumber(buckets, 1, outOfBodies(buckets, 1, 1e-6, p)), 0) << p.transpose();
  }
  EXPECT_GT(inside, 20);
}

// A blade's tip: what lies just below is outside, though ten slivers of its upper side meet there and one triangle of
// its lower.
TEST(Inside, ATipHasTwoSidesHoweverTheyAreDivided) {
  constexpr int kSlivers = 10;
  constexpr double kLength = 0.05, kHalfHeight = 0.018, kHalfWidth = 0.02;
  std::vector<Vector3d> nodes = {
      {0, 0, 0}, {-kLength, -kHalfHeight, -kHalfWidth}, {-kLength, -kHalfHeight, kHalfWidth}};
  for (int k = 0; k <= kSlivers; ++k) nodes.emplace_back(-kLength, kHalfHeight, kHalfWidth * (2.0 * k / kSlivers - 1));
  const int first = 3, last = 3 + kSlivers;
  std::vector<std::array<int, 3>> triangles = {{0, 2, 1}, {0, 1, first}, {0, last, 2}, {1, 2, last}};
  for (int k = first; k < last; ++k) triangles.insert(triangles.end(), {{0, k, k + 1}, {1, k + 1, k}});
  const Buckets buckets = bucketsOf({shapeOf(nodes, triangles)}, {Vector3d::Zero()}, {Vector3d::Zero()});
  EXPECT_EQ(windingNumber(buckets, 1, {-0.04, 0, 0}), 1);
  const Vector3d below = Vector3d(kHalfHeight, -kLength, 0).normalized();  // across the lower side
  EXPECT_FALSE(liesBehind(buckets, 1, 1e-3 * (below + Vector3d(0.1, 0, 0))));
  EXPECT_TRUE(liesBehind(buckets, 1, {-1e-3, 0, 0}));
}

}  // namespace medulla
