#include <gtest/gtest.h>

#include "physics/model/build.h"
#include "physics/model/build_report.h"
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

TEST(RenderSurface, FineMeshesAreNotDividedByThemselves) {
  EXPECT_EQ(renderLevelsFor(12500), 2);
  EXPECT_EQ(renderLevelsFor(12501), 1);
  EXPECT_EQ(renderLevelsFor(327680), 0);
}

}  // namespace medulla
