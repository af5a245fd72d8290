#include "physics/dynamics/fixation.h"

#include "physics/dynamics/region.h"
#include "tests/dynamics_states.h"
#include "tests/synthetic_model.h"

// Parts of the surface that are held, and what they hold.
namespace medulla {

using namespace states;

// Five spheres along x from 0 to 0.08, 20 mm apart.
static std::shared_ptr<const SoftBodyModel> tube() {
  return synthetic::chainModel(synthetic::straightTube(5, 0.08, 0.012, 8, 10));
}

static Region box(const Vector3d& low, const Vector3d& high) {
  Region region;
  region.box = {low, high};
  return region;
}

TEST(Fixation, RegionsFindTheNodesInside) {
  const auto model = tube();
  const double end = model->spheres.back().restFrame.x();
  const auto inBox = nodesInRegion(*model, box({0.6 * end, -1, -1}, {1, 1, 1}));
  Region ball;
  ball.shape = Region::Shape::ball;
  ball.centre = model->spheres[0].restFrame;
  ball.radius = 0.03;
  const auto inBall = nodesInRegion(*model, ball);
  Region below;
  below.shape = Region::Shape::halfSpace;
  below.normal = {2, 1, 0};
  below.distance = end;
  const auto inHalf = nodesInRegion(*model, below);
  EXPECT_FALSE(inHalf.empty());
  EXPECT_FALSE(inBox.empty());
  EXPECT_FALSE(inBall.empty());
  for (int i = 0; i < static_cast<int>(model->restNodes.size()); ++i) {
    const Vector3d& x = model->restNodes[i];
    EXPECT_EQ(std::count(inBox.begin(), inBox.end(), i), x.x() >= 0.6 * end ? 1 : 0);
    EXPECT_EQ(std::count(inBall.begin(), inBall.end(), i), (x - ball.centre).norm() <= 0.03 ? 1 : 0);
    EXPECT_EQ(std::count(inHalf.begin(), inHalf.end(), i), 2 * x.x() + x.y() <= end ? 1 : 0);
  }
}

TEST(Fixation, HoldsSpheresByHalfOfTheirSurface) {
  const auto model = tube();
  std::vector<int> all(model->restNodes.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<int>(i);
  EXPECT_EQ(spheresHeldBy(*model, all).size(), model->spheres.size());
  EXPECT_TRUE(spheresHeldBy(*model, {}).empty());
  EXPECT_TRUE(spheresHeldBy(*model, {0}).empty());
  const double end = model->spheres.back().restFrame.x();
  const auto held = spheresHeldBy(*model, nodesInRegion(*model, box({0.6 * end, -1, -1}, {1, 1, 1})));
  ASSERT_FALSE(held.empty());
  EXPECT_EQ(held.back(), 4);
  EXPECT_GT(held.front(), 1);
}

TEST(Fixation, FixedNodesStayToTheBitAndTheBodyHangsOnThem) {
  BodyDescription b = synthetic::body(tube(), 2e4);
  const double end = b.model->spheres.back().restFrame.x();
  b.fixedNodes = nodesInRegion(*b.model, box({0.9 * end, -1, -1}, {1, 1, 1}));
  ASSERT_FALSE(b.fixedNodes.empty());
  World world({}, {b});
  for (int frame = 0; frame < 50; ++frame) world.advance({});
  DynamicsFrame f;
  world.readFrame(f);
  for (const int node : b.fixedNodes) EXPECT_EQ(f.bodies[0].nodes[node], b.model->restNodes[node]);
  // Held by the surface of one end alone: it sags, and does not fall (1.2 m by then).
  const double sag = f.bodies[0].spheres[0].position.y() - b.model->spheres[0].restFrame.y();
  EXPECT_LT(sag, 0);
  EXPECT_GT(sag, -0.1);
}

TEST(Fixation, NodesThatDoNotExistAreRefused) {
  BodyDescription b = synthetic::body(tube(), 2e4);
  b.fixedNodes = {100000};
  EXPECT_THROW(World({}, {b}), std::runtime_error);
}

}  // namespace medulla
