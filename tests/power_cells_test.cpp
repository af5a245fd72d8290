#include "physics/model/power_cells.h"

#include <gtest/gtest.h>

#include "physics/model/surface_queries.h"
#include "tests/test_shapes.h"

namespace medulla {
namespace {

TEST(PowerCells, SumToTheBodyAndVoxelsAloneAreClose) {
  const TriangleMesh mesh = ellipsoidMesh(3, {0.05, 0.03, 0.02});
  const MassProperties exact = massProperties(mesh);
  const VoxelBody voxels = voxelise(mesh, exact.volume, 60000);
  double volume = 0;
  for (const VoxelPiece& piece : voxels.pieces) volume += piece.volume;
  EXPECT_NEAR(volume / exact.volume, 1, 1e-3);
  const PowerCells cells = divideByPower(voxels, {{{-0.02, 0, 0}, 0.015}, {{0.015, 0, 0}, 0.018}}, exact);
  const MassProperties sum = combined(cells.cells);
  EXPECT_NEAR(sum.volume / exact.volume, 1, 1e-12);
  EXPECT_LT((sum.centroid - exact.centroid).norm(), 1e-12);
  EXPECT_LT((sum.secondMoment - exact.secondMoment).norm(), 1e-10 * exact.secondMoment.norm());
  EXPECT_EQ(contactAreas(voxels, cells.cellOfPiece).size(), 1u);
}

// Voxels of 1 mm bridge a slit of a fifth of one. The third ball's cell has a slice of the first block, too.
TEST(PowerCells, WallsAcrossASlitAreNotInTouch) {
  const TriangleMesh mesh = blocksMesh(0.0002);
  const MassProperties exact = massProperties(mesh);
  const VoxelBody voxels = voxelise(mesh, exact.volume, 20000);
  const std::vector<Ball> balls{{{0.012, 0.005, 0.01}, 0.005},
                                {{0.038, 0.005, 0.01}, 0.005},
                                {{0.012, 0.015, 0.01}, 0.007},
                                {{0.038, 0.015, 0.01}, 0.005}};
  const PowerCells cells = divideByPower(voxels, balls, exact);
  EXPECT_EQ(cellAt(cells.sites, {0.012, 0.0095, 0.01}), 2);
  const ContactAreas bridged = contactAreas(voxels, cells.cellOfPiece);
  EXPECT_TRUE(bridged.contains({0, 2}));
  EXPECT_TRUE(bridged.contains({1, 3}));
  const ContactAreas within = contactAreasWithin(makeSurfaceTree(mesh), voxels, cells.cellOfPiece);
  ASSERT_EQ(within.size(), 2u);
  EXPECT_NEAR(within.at({0, 1}) / (0.01 * 0.02), 1, 0.2);  // without the slice
  EXPECT_NEAR(within.at({2, 3}) / (0.01 * 0.02), 1, 0.1);
}

}  // namespace
}  // namespace medulla
