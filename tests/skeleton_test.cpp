#include <gtest/gtest.h>

#include "physics/model/edge_collapse_skeleton.h"
#include "physics/model/link_graph.h"
#include "tests/test_shapes.h"

namespace medulla {

static SphereLinks linksOf(const Skeleton& skeleton) {
  return {skeleton.links.begin(), skeleton.links.end()};
}

TEST(Skeleton, TetrahedronEndsAsOneLink) {
  // Shortest edge 0-1: the two triangles at it vanish, the two others become one; its shortest edge is then 0-2 or 0-3.
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0.5, 5, 0}, {0.5, 3, 4}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  const Skeleton skeleton = collapseEdges(mesh);
  ASSERT_EQ(skeleton.nodes.size(), 2u);
  ASSERT_EQ(skeleton.links.size(), 1u);
  // The first collapse gives (0.5, 0, 0); of the triangle left, the shortest edge is 2-3 (length sqrt 20).
  EXPECT_TRUE(skeleton.nodes[0].isApprox(Eigen::Vector3d(0.5, 0, 0)));
  EXPECT_TRUE(skeleton.nodes[1].isApprox(Eigen::Vector3d(0.5, 4, 2)));
}

TEST(Skeleton, TubeCollapsesToAChainAlongItsAxis) {
  const Skeleton skeleton = collapseEdges(cylinderMesh(0.1, 0.01, 12, 30));
  ASSERT_GE(skeleton.nodes.size(), 4u);
  EXPECT_EQ(skeleton.links.size(), skeleton.nodes.size() - 1);
  EXPECT_EQ(countComponents(static_cast<int>(skeleton.nodes.size()), linksOf(skeleton)), 1);
  for (const Eigen::Vector3d& node : skeleton.nodes) EXPECT_LT(node.tail<2>().norm(), 0.01);
}

TEST(Skeleton, GallbladderIsOneTree) {
  const Skeleton skeleton = collapseEdges(assetMesh("gallbladder/gallbladder.obj"));
  EXPECT_GE(skeleton.nodes.size(), 3u);
  EXPECT_EQ(skeleton.links.size(), skeleton.nodes.size() - 1);
  EXPECT_EQ(countComponents(static_cast<int>(skeleton.nodes.size()), linksOf(skeleton)), 1);
}

TEST(Skeleton, SphereAndEqualLengthsGiveOneAnswer) {
  const TriangleMesh mesh = ellipsoidMesh(2, {1, 1, 1});
  const Skeleton a = collapseEdges(mesh), b = collapseEdges(mesh);
  ASSERT_GE(a.nodes.size(), 1u);
  ASSERT_EQ(a.nodes.size(), b.nodes.size());
  for (std::size_t k = 0; k < a.nodes.size(); ++k) EXPECT_EQ(a.nodes[k], b.nodes[k]);
  EXPECT_EQ(a.links, b.links);
}

}  // namespace medulla
