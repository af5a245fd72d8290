#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/model/build.h"
#include "physics/model/build_report.h"
#include "physics/model/mass_properties.h"
#include "physics/model/plane_section.h"
#include "physics/model/render_surface.h"
#include "tests/test_shapes.h"

// What `build` says of a mesh that its model would answer badly for.
namespace medulla {

using Eigen::Vector3d;

TEST(PlaneSection, HolesAreFound) {
  const TriangleMesh solid = ellipsoidMesh(4, {3, 2, 1}), hollow = hollowed(solid, ellipsoidMesh(3, {1.5, 1, 0.5}));
  const auto at = [](double x) { return Plane{{x, 0.1, 0}, Vector3d::UnitY(), Vector3d::UnitZ()}; };
  EXPECT_FALSE(sectionHasHole(solid, at(0.1)));
  EXPECT_TRUE(sectionHasHole(hollow, at(0.1)));
  EXPECT_FALSE(sectionHasHole(hollow, at(2)));
  EXPECT_FALSE(sectionHasHole(solid, at(4)));  // beyond
}

TEST(BuildReport, CountsLinksAcrossWhichTheBodyIsHollow) {
  const TriangleMesh solid = cylinderMesh(0.2, 0.02, 24, 30);
  TriangleMesh core = cylinderMesh(0.18, 0.015, 24, 30);
  for (Vector3d& v : core.vertices) v.x() += 0.01;
  BuildReport report;
  buildModel(asRepaired(solid), nullptr, {}, report);
  EXPECT_EQ(report.hollowLinks, 0);
  buildModel(asRepaired(hollowed(solid, core)), nullptr, {}, report);
  EXPECT_GT(report.hollowLinks, report.links / 2);
}

TEST(BuildReport, CountsLinksThatArePartsOfASheet) {
  const auto sheetLinks = [](const Vector3d& size, int spheres) {
    BuildSettings settings;
    settings.spheres = spheres;
    BuildReport report;
    buildModel(asRepaired(boxMesh(size)), nullptr, settings, report);
    return double(report.sheetLinks) / report.links;
  };
  EXPECT_GT(sheetLinks({0.2, 0.2, 0.008}, 16), 0.5);
  EXPECT_EQ(sheetLinks({0.2, 0.02, 0.004}, 8), 0);  // a strip, whose links stand in a row
  EXPECT_LT(sheetLinks({0.1, 0.1, 0.1}, 16), 0.2);
}

TEST(BuildReport, TellsOfEdgesLongerThanTheBodyIsThick) {
  const auto edges = [](const TriangleMesh& mesh) { return longEdges(mesh, makeSurfaceTree(mesh)); };
  const std::optional<LongEdges> of = edges(cylinderMesh(0.2, 0.02, 64, 1));
  ASSERT_TRUE(of);
  EXPECT_NEAR(of->edge, 0.2, 1e-3);
  EXPECT_NEAR(of->thickness, 0.04, 1e-3);
  EXPECT_TRUE(edges(boxMesh({0.2, 0.04, 0.04})));
  EXPECT_FALSE(edges(boxMesh({0.05, 0.05, 0.05})));
  EXPECT_FALSE(edges(cylinderMesh(0.2, 0.02, 32, 10)));
  for (const char* organ : {"gallbladder/gallbladder.obj", "liver/liver.obj", "stomach/stomach.obj"})
    EXPECT_FALSE(edges(assetMesh(organ))) << organ;
}

// A sphere's limit surface is one, smaller by what its mesh is coarse.
TEST(BuildReport, TellsHowFarTheDrawnSurfaceLiesInside) {
  const auto inside = [](int levels) {
    BuildReport report;
    const TriangleMesh mesh = ellipsoidMesh(levels, {0.05, 0.05, 0.05});
    const SoftBodyModel model = buildModel(asRepaired(mesh), nullptr, {}, report);
    double least = 0.05;  // m, from the centre
    for (const auto& [x, y, z] : model.renderSurface.restPosition) least = std::min(least, Vector3d(x, y, z).norm());
    EXPECT_LE(report.drawnInsideMax, 100 * (0.05 - least) / report.diagonal + 1e-4);
    return report.drawnInsideMax;
  };
  const double coarse = inside(0), fine = inside(2);
  EXPECT_GT(coarse, 5);
  EXPECT_LT(fine, 1);
  EXPECT_GT(fine, 0.1);
}

// A ball in the middle of a sphere, four fifths as wide: everywhere as far from the surface, but for the mesh's chords.
TEST(BuildReport, GapsAndCoverOfABallInASphere) {
  const double radius = 0.05, diagonal = 2 * std::sqrt(3.) * radius;
  const TriangleMesh mesh = ellipsoidMesh(3, {radius, radius, radius});
  BuildReport report;
  SoftBodyModel model = buildModel(asRepaired(mesh), nullptr, {}, report);
  for (FillingSphere& s : model.spheres) {
    s.restBallCentre.setZero();
    s.radius = 0.8 * radius;
  }
  report = measureModel(model);
  EXPECT_NEAR(report.gapMax, 100 * 0.2 * radius / diagonal, 1e-6);
  EXPECT_LT(report.gapMean, 100 * 0.2 * radius / diagonal);
  EXPECT_GT(report.gapMean, 0.98 * 100 * 0.2 * radius / diagonal);
  EXPECT_NEAR(report.gapConesMax, report.gapMax, 1e-9);
  const double share = std::pow(0.8, 3) * 4. / 3 * std::numbers::pi * std::pow(radius, 3) / massProperties(mesh).volume;
  EXPECT_NEAR(report.cover, 100 * share, 1.5);
  EXPECT_EQ(report.coverCones, report.cover);
}

// Equal balls along a round bar's axis: the cones of their links make a rod with round ends.
TEST(BuildReport, CoverOfBallsAndConesAlongABar) {
  const double length = 0.2, radius = 0.02, ball = 0.015, inBalls = 4. / 3 * std::numbers::pi * std::pow(ball, 3);
  const TriangleMesh mesh = cylinderMesh(length, radius, 48, 40);
  BuildReport report;
  SoftBodyModel model = buildModel(asRepaired(mesh), nullptr, {}, report);
  const int count = static_cast<int>(model.spheres.size());
  ASSERT_GE(count, 3);
  ASSERT_LE(count, 8);  // no two balls overlap that are not neighbours
  ASSERT_GE(model.links.size(), static_cast<std::size_t>(count - 1));
  const double spacing = (length - 2 * radius) / (count - 1);
  for (int k = 0; k < count; ++k) {
    model.spheres[k].restBallCentre = Vector3d(radius + k * spacing, 0, 0);
    model.spheres[k].radius = ball;
    if (k > 0) {
      model.links[k - 1].sphere0 = k - 1;
      model.links[k - 1].sphere1 = k;
    }
  }
  model.links.resize(count - 1);
  for (Attachment& a : model.attachments) a.host = a.onLink ? std::min(a.host, count - 2) : a.host;
  report = measureModel(model);
  const double overlap =
      spacing < 2 * ball ? std::numbers::pi / 12 * (4 * ball + spacing) * std::pow(2 * ball - spacing, 2) : 0;
  const double whole = massProperties(mesh).volume;
  const double rod = std::numbers::pi * ball * ball * (length - 2 * radius) + inBalls;
  EXPECT_NEAR(report.cover, 100 * (count * inBalls - (count - 1) * overlap) / whole, 1.5);
  EXPECT_NEAR(report.coverCones, 100 * rod / whole, 1.5);
  EXPECT_GT(report.coverCones, report.cover + 3);
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.degreeMax, 2);
  // Along the flank the rod is 5 mm off; in a rim's corner farther.
  EXPECT_NEAR(report.gapConesMax, 100 * (std::hypot(radius, radius) - ball) / report.diagonal, 1e-6);
}

TEST(BuildReport, MassesAndAttachmentsAreMeasuredAgainstTheMesh) {
  const TriangleMesh mesh = boxMesh({0.03, 0.04, 0.12});
  const MassProperties exact = massProperties(mesh);
  BuildReport report;
  SoftBodyModel model = buildModel(asRepaired(mesh), nullptr, {}, report);
  for (Attachment& a : model.attachments) a.volume = 0;
  for (FillingSphere& s : model.spheres) {
    s.volume = 0;
    s.secondMoment.setZero();
  }
  model.spheres[0].volume = 1.1 * exact.volume;
  model.spheres[0].restFrame = exact.centroid + Vector3d(0, 0.0026, 0);
  for (Attachment& a : model.attachments) a.restOffset = {0, 0, 0.001};
  model.attachments[3].restOffset = {0, 0.0039, 0};
  report = measureModel(model);
  EXPECT_NEAR(report.diagonal, 0.13, 1e-12);
  EXPECT_NEAR(report.centreError, 2, 1e-9);
  EXPECT_NEAR(report.massError, 10, 1e-9);
  EXPECT_NEAR(report.inertiaError, 100, 1e-6);  // of a point against that of the box
  EXPECT_NEAR(report.attachmentMax, 3, 1e-9);
}

TEST(RenderSurface, FineMeshesAreNotDividedByThemselves) {
  EXPECT_EQ(renderLevelsFor(12500), 2);
  EXPECT_EQ(renderLevelsFor(12501), 1);
  EXPECT_EQ(renderLevelsFor(327680), 0);
}

TEST(BuildReport, CountsSpheresOfWhichBallOrFrameLiesOutside) {
  BuildReport report;
  SoftBodyModel model = buildModel(asRepaired(boxMesh({0.03, 0.04, 0.12})), nullptr, {}, report);
  EXPECT_EQ(report.centresOutside, 0);
  model.spheres[0].restFrame = {0.5, 0, 0};
  EXPECT_EQ(measureModel(model).centresOutside, 1);
  model.spheres[1].restBallCentre = {0.5, 0, 0};
  EXPECT_EQ(measureModel(model).centresOutside, 2);
}

}  // namespace medulla
