#include "physics/model/render_surface.h"

#include <gtest/gtest.h>

#include "tests/test_shapes.h"

namespace medulla {

using Eigen::Vector3d;

struct Drawn {
  std::vector<Vector3d> points, normals;
};

// As RenderSurface documents it.
static Drawn draw(const RenderSurface& surface, const std::vector<Vector3d>& nodes) {
  Drawn drawn;
  for (std::size_t v = 0; v + 1 < surface.first.size(); ++v) {
    Vector3d x = Vector3d::Zero(), a = x, b = x;
    for (int k = surface.first[v]; k < surface.first[v + 1]; ++k) {
      x += double(surface.weight[k]) * nodes[surface.node[k]];
      a += double(surface.tangent0[k]) * nodes[surface.node[k]];
      b += double(surface.tangent1[k]) * nodes[surface.node[k]];
    }
    const Vector3d t0 = a.normalized(), n = a.cross(b).normalized();
    const auto& o = surface.offset[v];
    drawn.points.push_back(x + double(o[0]) * t0 + double(o[1]) * n.cross(t0) + double(o[2]) * n);
    drawn.normals.push_back(n);
  }
  return drawn;
}

TEST(RenderSurface, WeightsSumToOneAndTangentsToZero) {
  const RenderSurface s = makeRenderSurface(assetMesh("gallbladder/gallbladder.obj"), 2, nullptr);
  EXPECT_EQ(s.triangles.size(), 466u * 16);
  EXPECT_EQ(s.first.size(), s.restPosition.size() + 1);
  EXPECT_EQ(s.offset.size(), s.restPosition.size());
  for (std::size_t v = 0; v + 1 < s.first.size(); ++v) {
    double w = 0, a = 0, b = 0;
    for (int k = s.first[v]; k < s.first[v + 1]; ++k) {
      w += double(s.weight[k]);
      a += double(s.tangent0[k]);
      b += double(s.tangent1[k]);
    }
    ASSERT_NEAR(w, 1, 1e-7);
    ASSERT_NEAR(a, 0, 1e-7);
    ASSERT_NEAR(b, 0, 1e-7);
  }
}

TEST(RenderSurface, IsClosedAndManifold) {
  const RenderSurface s = makeRenderSurface(ellipsoidMesh(1, {1, 2, 1}), 2, nullptr);
  std::map<std::pair<int, int>, int> directed;
  for (const auto& t : s.triangles) {
    for (int k = 0; k < 3; ++k) ++directed[{t[k], t[(k + 1) % 3]}];
  }
  for (const auto& [edge, count] : directed) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(directed.count({edge.second, edge.first}), 1u);
  }
}

// On a sphere every limit normal has to be radial, and neighbouring triangles to meet at angles that fall with the
// square of the level: no facets.
TEST(RenderSurface, SphereIsSmooth) {
  const TriangleMesh mesh = ellipsoidMesh(2, {1, 1, 1});
  const RenderSurface s = makeRenderSurface(mesh, 2, nullptr);
  const Drawn drawn = draw(s, mesh.vertices);
  double low = 2, high = 0;
  for (std::size_t v = 0; v < drawn.points.size(); ++v) {
    EXPECT_GT(drawn.normals[v].dot(drawn.points[v].normalized()), std::cos(0.03));
    low = std::min(low, drawn.points[v].norm());
    high = std::max(high, drawn.points[v].norm());
    EXPECT_LT((drawn.points[v].cast<float>() - Eigen::Map<const Eigen::Vector3f>(s.restPosition[v].data())).norm(),
              1e-6f);
  }
  EXPECT_GT(low, 0.95);
  EXPECT_LT(high - low, 0.012);
  for (const auto& t : s.triangles) {
    const Vector3d &a = drawn.points[t[0]], &b = drawn.points[t[1]], &c = drawn.points[t[2]];
    const Vector3d facet = (b - a).cross(c - a).normalized();
    for (const int corner : t) EXPECT_GT(facet.dot(drawn.normals[corner]), std::cos(0.1));
  }
}

TEST(RenderSurface, RigidMotionOfTheNodesCarriesItRigidly) {
  const TriangleMesh mesh = assetMesh("gallbladder/gallbladder.obj");
  const TriangleMesh fine = assetMesh("gallbladder/gallbladder_fine.obj");
  const RenderSurface s = makeRenderSurface(mesh, 2, &fine);
  const Eigen::Isometry3d motion =
      Eigen::Translation3d(1, -2, 0.5) * Eigen::AngleAxisd(2.1, Vector3d(1, 2, -1).normalized());
  std::vector<Vector3d> moved;
  for (const Vector3d& v : mesh.vertices) moved.push_back(motion * v);
  const Drawn before = draw(s, mesh.vertices), after = draw(s, moved);
  for (std::size_t v = 0; v < before.points.size(); ++v) {
    ASSERT_LT((motion * before.points[v] - after.points[v]).norm(), 1e-6);
  }
}

TEST(RenderSurface, OffsetReachesTheFineShape) {
  const TriangleMesh coarse = ellipsoidMesh(2, {1, 1, 1}), fine = ellipsoidMesh(5, {1, 1, 1});
  const RenderSurface s = makeRenderSurface(coarse, 2, &fine);
  for (const Vector3d& p : draw(s, coarse.vertices).points) EXPECT_NEAR(p.norm(), 1, 2e-3);
}

// From a flat side, which is its own fine shape, rays would go on to the opposite one.
TEST(RenderSurface, AFlatSideOfAPlateStaysThere) {
  TriangleMesh plate = ellipsoidMesh(4, {1, 1, 1});
  for (Vector3d& x : plate.vertices) {  // its lower side at 0, where limit points lie on it to the last bit
    x = (x / x.cwiseAbs().maxCoeff()).cwiseProduct(Vector3d(0.1, 0.002, 0.1));
    x.y() += 0.002;
  }
  const std::vector<Vector3d> points = draw(makeRenderSurface(plate, 1, &plate), plate.vertices).points,
                              smooth = draw(makeRenderSurface(plate, 1, nullptr), plate.vertices).points;
  int seen = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (std::abs(smooth[k].x()) > 0.06 || std::abs(smooth[k].z()) > 0.06) continue;
    ++seen;
    ASSERT_LT((points[k] - smooth[k]).norm(), 1e-7);
  }
  EXPECT_GT(seen, 300);
}

TEST(RenderSurface, AFineShapeThatLiesElsewhereIsRefused) {
  const TriangleMesh coarse = ellipsoidMesh(2, {1, 1, 1});
  TriangleMesh fine = ellipsoidMesh(3, {9, 9, 9});
  EXPECT_THROW(makeRenderSurface(coarse, 1, &fine), std::runtime_error);
  // A third of it is: there the surface stays where it is.
  fine = ellipsoidMesh(3, {1, 1, 1});
  for (Vector3d& x : fine.vertices)
    if (x.z() > 0.3) x.z() += 9;
  const RenderSurface s = makeRenderSurface(coarse, 1, &fine);
  int still = 0;
  for (const auto& o : s.offset) still += o == std::array<float, 3>{0, 0, 0} ? 1 : 0;
  EXPECT_GT(still, 0);
  EXPECT_LT(2 * still, static_cast<int>(s.offset.size()));
}

}  // namespace medulla
