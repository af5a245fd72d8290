#include <gtest/gtest.h>

#include <numbers>

#include "physics/dynamics/body_mechanics.h"
#include "tests/dynamics_states.h"
#include "tests/synthetic_model.h"

namespace medulla {

using namespace states;

static World bareChain(int spheres, SurfaceMode surface, double damping) {
  BodyDescription b = synthetic::body(synthetic::unevenChain(spheres, 4), 5e3);
  b.surface = surface;
  b.tissue.damping = damping;
  b.steered = {{{1.3, 0.8, 1.6}}};
  WorldSettings settings;
  settings.gravity.setZero();
  return World(settings, {b});
}

TEST(Link, ForcesAreMinusTheEnergyGradient) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    World world = bareChain(4, SurfaceMode::skin, 0);
    const double angle = seed <= 4 ? 0.2 : 1.0;  // rad about each axis: up to 100 degrees between ends
    shake(world.data(), seed, angle, 0.004, 0);
    expectForcesAreMinusGradient(world.data(), 1e-6);
  }
}

TEST(Link, EachWayItDeformsIsSteeredByItsOwnFactor) {
  for (const LinkModel links : {LinkModel::beam, LinkModel::springs}) {
    BodyDescription body = synthetic::body(synthetic::shortTube(), 5e3);
    body.links = links;
    const std::vector<LinkStiffness> plain = bodyMechanics(body).links;
    body.steered = {{{2, 3, 5}}};
    const std::vector<LinkStiffness> steered = bodyMechanics(body).links;
    ASSERT_EQ(plain.size(), 4u);
    for (std::size_t k = 0; k < plain.size(); ++k) {
      EXPECT_NEAR(steered[k].elongation / plain[k].elongation, 2, 1e-12);
      EXPECT_NEAR(steered[k].torsion / plain[k].torsion, 5, 1e-12);
      for (const auto flexion : {&LinkStiffness::flexionU, &LinkStiffness::flexionV}) {
        const FlexionStiffness &now = steered[k].*flexion, &before = plain[k].*flexion;
        EXPECT_NEAR(now.end0 / before.end0, 3, 1e-12);
        EXPECT_NEAR(now.end1 / before.end1, 3, 1e-12);
        EXPECT_NEAR(now.couple, 3 * before.couple, 1e-12 * before.end0);
      }
    }
  }
}

// A flat ribbon's link, thirty-six times as stiff about one axis as about the other, hardly minds being twisted: bent
// besides, it must mind at every twist, and as much again after a whole turn.
TEST(Link, BendingCostsEnergyWhateverTheTwist) {
  BodyDescription b = synthetic::body(synthetic::chainModel(synthetic::straightTube(2, 0.03, 0.01, 4, 6)), 5e3);
  auto model = std::make_shared<SoftBodyModel>(*b.model);
  for (LinkSection& s : model->links[0].sections) s.bendingMomentU *= 36;
  b.model = model;
  b.surface = SurfaceMode::skin;
  b.steered = {{{.torsion = 1e-9}}};
  Random random(7);
  for (int trial = 0; trial < 20; ++trial) {
    World world(weightless(), {b});
    WorldData& d = world.data();
    const Vector3d line = (vectorOf(d.spheres.position[1]) - vectorOf(d.spheres.position[0])).normalized();
    const Vector3d bend0 = 0.1 * line.cross(random.vector()), bend1 = 0.1 * line.cross(random.vector());
    const double straight = elastic(d);
    turnBy(d, 0, bend0);
    double untwisted = 0;
    for (int step = 0; step <= 36; ++step) {
      const Quaterniond twisted = orientation(d, 1);
      turnBy(d, 1, bend1);
      const double energy = elastic(d) - straight;
      if (step == 0) untwisted = energy;
      EXPECT_GT(energy, 1e-3 * untwisted) << "twisted by " << 10 * step << " degrees";
      if (step == 36) {
        EXPECT_NEAR(energy, untwisted, 1e-6 * untwisted);
      }
      setOrientation(d, 1, twisted);
      turnBy(d, 1, 2 * std::numbers::pi / 36 * line);
    }
  }
}

// An end that folds beyond 116 degrees, of a link that is bent at its other end: what it does goes on without a jump.
TEST(Link, MomentsDoNotJumpAtTheFold) {
  constexpr double kFold = 2.028757838110434, kBeside = 1e-7;  // rad; tan(fold) = -fold
  BodyDescription b = synthetic::body(synthetic::chainModel(synthetic::straightTube(2, 0.03, 0.01, 4, 6)), 5e3);
  auto model = std::make_shared<SoftBodyModel>(*b.model);
  for (LinkSection& s : model->links[0].sections) s.bendingMomentU *= 1.7;
  b.model = model;
  b.surface = SurfaceMode::skin;
  b.tissue.damping = 0;
  const auto torquesAt = [&b](double angle, double twist, double tolerance = 0) {
    World world(weightless(), {b});
    WorldData& d = world.data();
    const Vector3d line = (vectorOf(d.spheres.position[1]) - vectorOf(d.spheres.position[0])).normalized();
    const Vector3d across = line.cross(Vector3d(0.3, 1, 0.2)).normalized();
    turnBy(d, 0, 0.9 * line.cross(across) + 0.3 * across);
    turnBy(d, 1, twist * line);
    turnBy(d, 1, angle * across);
    runStage(d, evaluateForces);
    if (tolerance > 0) expectForcesAreMinusGradient(d, tolerance);
    return std::pair(vectorOf(d.spheres.torque[0]), vectorOf(d.spheres.torque[1]));
  };
  for (const double twist : {0.0, 0.7}) {
    const auto before = torquesAt(kFold - kBeside, twist), after = torquesAt(kFold + kBeside, twist);
    EXPECT_LT((after.first - before.first).norm(), 1e-5 * before.first.norm());
    EXPECT_LT((after.second - before.second).norm(), 1e-5 * before.second.norm());
    for (const double angle : {1.2, 1.5, 1.9, 2.2, 2.5, 2.7, 3.1}) torquesAt(angle, twist, 1e-6);
  }
}

// An end that swings round beside 180 degrees, near enough for its twist to move by all but a whole turn, comes back as
// it was.
TEST(Link, SwingingPastTheFoldWindsNothingUp) {
  BodyDescription b = synthetic::body(synthetic::chainModel(synthetic::straightTube(2, 0.03, 0.01, 4, 6)), 5e3);
  b.surface = SurfaceMode::skin;
  World world(weightless(), {b});
  WorldData& d = world.data();
  const Vector3d line = (vectorOf(d.spheres.position[1]) - vectorOf(d.spheres.position[0])).normalized();
  const Vector3d across = line.unitOrthogonal(), beside = line.cross(across);
  const Quaterniond rest = orientation(d, 1);
  constexpr double kMissed = 0.25;  // rad
  constexpr int kSteps = 90;
  for (int step = 0; step <= kSteps; ++step) {  // its rest line leads once round a cone about `beside`
    const double angle = 2 * std::numbers::pi * step / kSteps;
    setOrientation(d, 1, rest);
    turnBy(d, 1, kMissed * std::sin(0.5 * angle) * across);
    turnBy(d, 1, angle * beside);
    runStage(d, evaluateForces);
  }
  EXPECT_LT(elastic(d), 1e-12);
  // Folded by 160 degrees it knows no twist.
  const Vector3d fold = 160.0 / 180 * std::numbers::pi * beside;
  turnBy(d, 1, fold);
  const double folded = elastic(d);
  turnBy(d, 1, Eigen::AngleAxisd(fold.norm(), beside) * line);
  EXPECT_GT(folded, 1e-5);
  EXPECT_NEAR(elastic(d), folded, 1e-9 * folded);
}

TEST(Attachment, ForcesOnNodesAndSpheresAreMinusTheEnergyGradient) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    World world = bareChain(4, SurfaceMode::full, 0);
    shake(world.data(), seed, seed <= 2 ? 0.2 : 0.9, 0.003, 0);
    expectForcesAreMinusGradient(world.data(), 1e-6);
  }
}

}  // namespace medulla
