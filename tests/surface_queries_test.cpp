#include "physics/model/surface_queries.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/test_shapes.h"

namespace medulla {

using Eigen::Vector3d;

TEST(SurfaceQueries, BallAgainstItsOwnMesh) {
  const TriangleMesh mesh = ellipsoidMesh(4, {1, 1, 1});
  const SurfaceTree tree = makeSurfaceTree(mesh);
  EXPECT_TRUE(isInside(tree, {0.3, 0.4, -0.5}));
  EXPECT_FALSE(isInside(tree, {0.3, 0.4, -0.9}));
  EXPECT_NEAR(closestPoint(tree, {0, 0, 3}).distance, 2, 2e-3);
  EXPECT_NEAR(inscribedRadius(tree, {0.2, 0, 0}), 0.8, 3e-3);
  EXPECT_EQ(inscribedRadius(tree, {2, 0, 0}), 0);
  EXPECT_NEAR(firstHit(tree, {-5, 0.1, 0.2}, Vector3d::UnitX(), 10), 5 - std::sqrt(1 - 0.05), 5e-3);
  EXPECT_FALSE(std::isfinite(firstHit(tree, {-5, 0.1, 0.2}, Vector3d::UnitX(), 3)));
  EXPECT_FALSE(segmentCrosses(tree, {0, 0, 0}, mesh.vertices[17], 17));
  EXPECT_TRUE(segmentCrosses(tree, -1.5 * mesh.vertices[17], mesh.vertices[17], 17));
}

// Rays along a side of the tree's boxes meet what lies in it, on whichever side.
TEST(SurfaceQueries, RaysInTheSidesOfABoxMeetIt) {
  TriangleMesh mesh;
  for (int k = 0; k < 8; ++k) mesh.vertices.emplace_back(k & 1, k >> 1 & 1, k >> 2);
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  const SurfaceTree tree = makeSurfaceTree(mesh);
  for (const double x : {0., 0.5, 1.}) EXPECT_EQ(firstHit(tree, {x, 0.3, -1}, Vector3d::UnitZ(), 10), 1) << x;
  EXPECT_FALSE(std::isfinite(firstHit(tree, {1.1, 0.3, -1}, Vector3d::UnitZ(), 10)));
}

}  // namespace medulla
