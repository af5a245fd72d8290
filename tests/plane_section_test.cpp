#include "physics/model/plane_section.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "physics/model/power_cells.h"
#include "physics/model/torsion_constant.h"
#include "tests/test_shapes.h"

namespace medulla {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

TEST(PlaneSection, EllipseAndItsHalves) {
  const TriangleMesh mesh = ellipsoidMesh(5, {3, 2, 1});
  const Plane plane{Vector3d::Zero(), Vector3d::UnitY(), Vector3d::UnitZ()};
  const double area = std::numbers::pi * 2 * 1;
  const SectionMoments whole = planeSection(mesh, plane);
  EXPECT_NEAR(whole.area / area, 1, 3e-3);
  EXPECT_NEAR(whole.secondMoment(0, 0) / (area * 4 / 4), 1, 5e-3);
  EXPECT_NEAR(whole.secondMoment(1, 1) / (area * 1 / 4), 1, 5e-3);
  const PowerSites sites{{{0, -1, 0}, {0, 1, 0}, {5, 1, 0}}, {0, 0, 0}, {9, 9, 9}};
  EXPECT_NEAR(planeSection(mesh, plane, &sites, {0, 1}).area / area, 1, 3e-3);
  EXPECT_NEAR(planeSection(mesh, plane, &sites, {0, 2}).area / area, 0.5, 3e-3);
  EXPECT_NEAR(planeSection(mesh, plane, &sites, {0, 0}).area / area, 0.5, 3e-3);
}

// Of the region between `low(v)` and `high(v)` for 0 < v < `height`, about the centroid that symmetry or the table
// gives.
template <typename Low, typename High>
double torsionOf(double height, const Low& low, const High& high, const Vector2d& centroid) {
  constexpr int kLines = 400;
  std::vector<SectionSpan> spans;
  for (int line = 0; line < kLines; ++line) {
    const double v = (line + 0.5) * height / kLines;
    spans.push_back({low(v), high(v), v, height / kLines});
  }
  return torsionConstant(spans, centroid, height);
}

// Square and rectangles: Timoshenko and Goodier 1970, section 109, table; here cut askew out of a bar.
TEST(TorsionConstant, RectanglesOfMeshes) {
  struct Sides {
    double wide, factor;
  };
  for (const Sides& sides : {Sides{1, 0.1406}, Sides{1.5, 0.196}, Sides{2, 0.229}, Sides{4, 0.281}}) {
    const double thin = 0.02, wide = sides.wide * thin;
    const Vector3d u = Vector3d(0, 0.8, 0.6), v = Vector3d(0, -0.6, 0.8);
    const SectionMoments section = planeSection(boxMesh({0.2, wide, thin}), {Vector3d(0.01, 0.003, 0), u, v});
    EXPECT_NEAR(section.torsionConstant / (sides.factor * wide * std::pow(thin, 3)), 1, 0.01) << sides.wide;
  }
}

// The same book: sections 105 (equilateral triangle, in closed form), 104 (ellipse) and, as Roark's tables have them,
// half a disc, whose twist centre is not its centroid, and a right triangle with two equal sides.
TEST(TorsionConstant, TrianglesEllipsesAndHalfDiscs) {
  const double height = std::sqrt(3) / 2, pi = std::numbers::pi;
  const auto slope = [](double v) { return v / std::sqrt(3.0); };
  EXPECT_NEAR(torsionOf(height, slope, [&](double v) { return 1 - slope(v); }, {0.5, height / 3}) / (std::sqrt(3) / 80),
              1, 1e-4);
  const auto chord = [](double v) { return 3 * std::sqrt(1 - (v - 1) * (v - 1)); };
  EXPECT_NEAR(torsionOf(2, [&](double v) { return -chord(v); }, chord, {0, 1}) / (pi * 27 / 10), 1, 1e-3);
  const auto half = [](double v) { return std::sqrt(1 - v * v); };
  EXPECT_NEAR(torsionOf(1, [&](double v) { return -half(v); }, half, {0, 4 / (3 * pi)}) / 0.2976, 1, 3e-3);
  EXPECT_NEAR(torsionOf(
                  1, [](double) { return 0.0; }, [](double v) { return 1 - v; }, {1 / 3.0, 1 / 3.0}) /
                  0.0261,
              1, 5e-3);
}

// The twist of a section does not ask where its axes come from.
TEST(TorsionConstant, TurnsWithTheSection) {
  const TriangleMesh mesh = ellipsoidMesh(4, {0.03, 0.02, 0.01});
  const SectionMoments a = planeSection(mesh, {Vector3d::Zero(), Vector3d::UnitY(), Vector3d::UnitZ()});
  const SectionMoments b = planeSection(mesh, {Vector3d::Zero(), {0, 0.6, 0.8}, {0, -0.8, 0.6}});
  EXPECT_NEAR(a.torsionConstant / b.torsionConstant, 1, 2e-3);
}

}  // namespace
}  // namespace medulla
