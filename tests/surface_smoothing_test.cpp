#include "app/surface_smoothing.h"

#include <gtest/gtest.h>

#include "app/files/model_file.h"
#include "app/scene_view.h"
#include "physics/model/render_surface.h"
#include "tests/synthetic_model.h"

namespace medulla {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

constexpr int kRings = 101, kSegments = 72;
constexpr double kRadius = 0.012;  // m

// 16 cm long, of some 14 000 triangles with edges of a millimetre and a half.
static std::shared_ptr<SoftBodyModel> fineTube() {
  auto model = synthetic::chainModel(synthetic::straightTube(10, 0.16, kRadius, kRings, kSegments));
  model->renderSurface = makeRenderSurface({model->restNodes, model->triangles}, 0, nullptr);
  return model;
}

// Thinner by a tenth beyond x, as where a stretched link begins.
static Points thinnedBeyond(double x, Points nodes) {
  for (Vector3d& p : nodes)
    if (p.x() > x) p = {p.x(), 0.9 * p.y(), 0.9 * p.z()};
  return nodes;
}

// Off the middle, m; the rims of its ends are sharp.
static double offMiddle(const SoftBodyModel& model, std::size_t node) {
  return std::abs(model.restNodes[node].x() - 0.08);
}
constexpr double kWall = 0.06;

// The largest slope of the radius along the tube's wall.
static double steepest(const SoftBodyModel& model, const Points& nodes) {
  double slope = 0;
  for (const auto& [a, b] : model.edges) {
    if (offMiddle(model, a) > kWall || offMiddle(model, b) > kWall) continue;
    const double way = nodes[a].tail<2>().norm() - nodes[b].tail<2>().norm();
    slope = std::max(slope, std::abs(way) / (model.restNodes[a] - model.restNodes[b]).norm());
  }
  return slope;
}

TEST(SurfaceSmoothing, CoarseMeshesAreDrawnAsTheyAre) {
  for (const char* file : {"abdomen/colon", "abdomen/small_intestine", "liver/liver", "stomach/stomach"}) {
    const SoftBodyModel model = readModel(std::string(MEDULLA_SOURCE_DIR "/assets/") + file + ".model.xml");
    EXPECT_TRUE(makeSurfaceSmoothing(model).share.empty()) << file;
  }
}

TEST(SurfaceSmoothing, TheShapeAtRestAndRigidMotionsStay) {
  const auto model = fineTube();
  const SurfaceSmoothing smoothing = makeSurfaceSmoothing(*model);
  ASSERT_FALSE(smoothing.share.empty());
  const Eigen::Isometry3d motion =
      Eigen::Translation3d(1, -2, 3) * Eigen::AngleAxisd(2, Vector3d(1, 2, 3).normalized());
  Points moved;
  for (const Vector3d& x : model->restNodes) moved.push_back(motion * x);
  const Points rest = smoothed(smoothing, model->restNodes), out = smoothed(smoothing, moved);
  for (std::size_t i = 0; i < moved.size(); ++i) {
    ASSERT_LT((rest[i] - model->restNodes[i]).norm(), 1e-14);
    ASSERT_LT((out[i] - moved[i]).norm(), 1e-12);
  }
}

// Where a picture shows the nodes.
static std::vector<glm::vec3> inPicture(const std::shared_ptr<const SoftBodyModel>& model, const Points& nodes) {
  LoadedScene loaded;
  SceneBody body;
  body.model = model;
  body.look = "liver";
  loaded.scene.bodies = {body};
  loaded.scene.camera.resize(1);
  PictureState state;
  state.frame.bodies.resize(1);
  state.frame.bodies[0].nodes = model->restNodes;
  state.frame.bodies[0].spheres.resize(model->spheres.size());
  Renderer renderer(rendererSettings(32, 32, "auto", Quality::draft));
  const SceneView view(loaded, state.frame, renderer);
  state.frame.bodies[0].nodes = nodes;
  Picture picture;
  view.compose(state, ViewKind::tissue, {}, picture);
  return picture.surfaces[0].positions;
}

TEST(SurfaceSmoothing, AStepBetweenHostsIsASlopeInThePicture) {
  const auto model = fineTube();
  const Points stepped = thinnedBeyond(0.08, model->restNodes);
  const std::vector<glm::vec3> shown = inPicture(model, stepped);
  Points drawn;
  for (const glm::vec3& p : shown) drawn.emplace_back(p.x, p.y, p.z);
  EXPECT_GT(steepest(*model, stepped), 0.7);
  EXPECT_LT(steepest(*model, drawn), 0.35);
  std::vector<glm::vec3> asItIs;
  evaluateRenderSurface(model->renderSurface, stepped, asItIs);
  for (std::size_t i = 0; i < asItIs.size(); ++i) {
    if (offMiddle(*model, i) < 0.015 || offMiddle(*model, i) > kWall) continue;
    ASSERT_LT(glm::length(asItIs[i] - shown[i]), 1e-4f);
  }
}

TEST(SurfaceSmoothing, NodesOfAStateCacheAreDrawnAsThoseOfTheRun) {
  const auto model = fineTube();
  const Points stepped = thinnedBeyond(0.08, model->restNodes);
  Points cached;
  for (const Vector3d& p : stepped) cached.emplace_back(p.cast<float>().cast<double>());
  EXPECT_TRUE(inPicture(model, stepped) == inPicture(model, cached));
}

// As deep as the tip of a tool of 5 mm radius dents soft tissue, and as wide.
TEST(SurfaceSmoothing, AToolsDentKeepsItsDepth) {
  const auto model = fineTube();
  Points dented = model->restNodes;
  const Vector3d place(0.08, 0, kRadius);
  for (Vector3d& p : dented) p.z() -= 0.004 * std::exp(-(p - place).squaredNorm() / (0.006 * 0.006));
  const Points drawn = smoothed(makeSurfaceSmoothing(*model), dented);
  double deepest = 0;
  for (std::size_t i = 0; i < drawn.size(); ++i) deepest = std::max(deepest, model->restNodes[i].z() - drawn[i].z());
  EXPECT_GT(deepest, 0.0034);
}

}  // namespace medulla
