#include "physics/dynamics/fixation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/dynamics/body_mechanics.h"
#include "physics/dynamics/region.h"
#include "physics/model/build.h"
#include "tests/dynamics_states.h"
#include "tests/synthetic_model.h"
#include "tests/test_shapes.h"

// Parts of the surface that are held, and what they hold.
namespace medulla {

using namespace states;

static Region box(const Vector3d& low, const Vector3d& high) {
  Region region;
  region.box = {low, high};
  return region;
}

TEST(Fixation, RegionsFindTheNodesInside) {
  const auto model = synthetic::shortTube();
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
  const auto model = synthetic::shortTube();
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

// m: how long a uniform beam is that turns as a link does where the same moment acts at both its ends.
static double freeLength(const FlexionStiffness& k, double youngTimesMoment) {
  const double determinant = k.end0 * k.end1 - k.couple * k.couple;
  return youngTimesMoment * (k.end0 + k.end1 + 2 * k.couple) / determinant;
}

// A rim of height cos(2 angle) clamps by 0.4 of it farther out in one plane, and nearer in the other: mean(cos(2a)
// cos(a)^2) / mean(cos(a)^2) = 1/2, of which 4/5 count for the fan over the rim. Askew it bends nothing. All that
// beside its mean along the rim, whose edges are not alike.
TEST(Fixation, AJaggedRimClampsABeamFartherOutInOnePlane) {
  constexpr double kTube = 0.012, kWave = 0.002, kRimAt = 0.0075;
  const auto flat = synthetic::chainModel(synthetic::straightTube(3, 0.06, kTube, 12, 8));
  const Vector3d high = Vector3d(0, 0.6, 0.8);
  double meanRim = 0;
  const auto mechanicsOf = [&](double wave, double slope) {
    auto model = std::make_shared<SoftBodyModel>(*flat);
    BodyDescription body;
    body.model = model;
    body.fixed.push_back({0});
    for (int i = 0; i < 17; ++i) body.fixedNodes.push_back(i);  // a pole and two rings of eight
    for (int i = 9; i < 17; ++i) {
      const Vector3d out = Vector3d(0, model->restNodes[i].y(), model->restNodes[i].z()) / kTube;
      const double along = high.dot(out);
      model->restNodes[i].x() += wave * (2 * along * along - 1) + slope * out.y();
    }
    double sum = 0, whole = 0;
    for (int i = 9; i < 17; ++i) {
      const Vector3d &a = model->restNodes[i], &b = model->restNodes[i < 16 ? i + 1 : 9];
      sum += 0.5 * (a.x() + b.x()) * (a - b).norm();
      whole += (a - b).norm();
    }
    meanRim = sum / whole;
    return bodyMechanics(body);
  };
  const Tissue tissue;
  const double ei = tissue.young * flat->links[0].sections[0].bendingMomentU;
  const double length = 0.03 - kRimAt - tissue.poisson * tissue.poisson * kTube / 2;
  for (const double slope : {0.0, 0.001}) {
    const LinkStiffness even = mechanicsOf(0, slope).links[0], wavy = mechanicsOf(kWave, slope).links[0];
    const double beyondMean = length + kRimAt - meanRim;
    EXPECT_NEAR(freeLength(even.flexionU, ei), length, 1e-9);
    EXPECT_NEAR(freeLength(even.flexionV, ei), length, 1e-9);
    const bool alongU = std::abs(wavy.restU.dot(high)) > 0.5;
    EXPECT_NEAR(std::abs(wavy.restU.dot(high)), alongU ? 1 : 0, 1e-9);
    EXPECT_NEAR(freeLength(alongU ? wavy.flexionV : wavy.flexionU, ei), beyondMean - 0.4 * kWave, 1e-9);
    EXPECT_NEAR(freeLength(alongU ? wavy.flexionU : wavy.flexionV, ei), beyondMean + 0.4 * kWave, 1e-9);
  }
}

// Wherever the spheres happen to lie: of seven to ten the part of the rim that hangs on the first free link or its
// held sphere is half of it to all.
TEST(Fixation, ARegionAcrossALinkHoldsItWhereItsWholeRimLies) {
  constexpr double kFiniteElements = 0.834;  // Hz, of a model that these identified for the same nodes
  Region ball;
  ball.shape = Region::Shape::ball;
  ball.centre = {-0.025, -0.008, -0.017};
  ball.radius = 0.016;
  for (const int spheres : {7, 8, 9, 10}) {
    BuildSettings settings;
    settings.spheres = spheres;
    BuildReport report;
    BodyDescription b;
    b.tissue.young = 9e3;
    b.tissue.poisson = 0.45;
    b.tissue.density = 1060;
    b.model = std::make_shared<const SoftBodyModel>(
        buildModel(repairMesh(assetMesh("gallbladder/gallbladder.obj")), nullptr, settings, report));
    b.fixedNodes = nodesInRegion(*b.model, ball);
    for (const int sphere : spheresHeldBy(*b.model, b.fixedNodes)) b.fixed.push_back({sphere});
    const World world({}, {b});
    EXPECT_NEAR(world.lowestFrequency(0) / (2 * std::numbers::pi), kFiniteElements, 0.08 * kFiniteElements) << spheres;
  }
}

TEST(Fixation, FixedNodesStayToTheBitAndTheBodyHangsOnThem) {
  BodyDescription b = synthetic::body(synthetic::shortTube(), 2e4);
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
  BodyDescription b = synthetic::body(synthetic::shortTube(), 2e4);
  b.fixedNodes = {100000};
  EXPECT_THROW(World({}, {b}), std::runtime_error);
}

}  // namespace medulla
