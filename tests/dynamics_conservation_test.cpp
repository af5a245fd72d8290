#include <gtest/gtest.h>

#include <memory>
#include <numbers>

#include "app/files/model_file.h"
#include "tests/dynamics_states.h"
#include "tests/synthetic_model.h"

// What the step keeps, and what it may only lose.
namespace medulla {

using namespace states;

static BodyDescription freeTube(double damping, SurfaceMode surface = SurfaceMode::full) {
  BodyDescription b = synthetic::body(synthetic::shortTube(), 6e3);
  b.tissue.damping = damping;
  b.surface = surface;
  return b;
}

TEST(Conservation, MomentaOfAFreeBodyStayWhileItIsDamped) {
  for (SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
    World world(weightless(), {freeTube(0.1, surface)});
    expectMomentaStay(world);
  }
}

TEST(Conservation, EnergyOfAnUndampedBodyDoesNotDrift) {
  World world(weightless(200), {freeTube(0)});
  expectEnergyStays(world);
}

// At the step that it chooses, too, with all its modes swinging: ten seconds of what else grows until nothing is
// finite.
TEST(Conservation, AnUndampedBodyKeepsItsEnergyAtItsOwnStep) {
  BodyDescription body;
  body.name = "gallbladder";
  body.model =
      std::make_shared<SoftBodyModel>(readModel(MEDULLA_SOURCE_DIR "/assets/gallbladder/gallbladder.model.xml"));
  body.tissue = {.young = 9e3, .density = 1040, .damping = 0};
  for (const double share : {0.3, 1.0}) {
    World world(weightless(), {body});
    shake(world.data(), 5, 0.1 * share, 0.0005 * share, 0.05 * share);
    const auto total = [&] { return world.energies().kinetic + world.energies().elastic; };
    const double start = total();
    while (world.time() < 10) world.advance({});
    EXPECT_NEAR(total(), start, 0.05 * start);  // an Euler step's energy comes and goes by 2 %
  }
}

TEST(Conservation, DampingTakesEnergyInEveryFrame) {
  WorldSettings settings = weightless();
  settings.substeps = 400;
  World world(settings, {freeTube(0.1)});
  expectEnergyIsTakenInEveryFrame(world);
}

TEST(Conservation, GravityOnlyTurnsIntoMotion) {
  BodyDescription body = freeTube(0.1);
  WorldSettings settings;
  World world(settings, {body});
  const double start = world.energies().gravity;
  DynamicsFrame first, last;
  world.readFrame(first);
  for (int i = 0; i < 25; ++i) world.advance({});
  world.readFrame(last);
  const Energies e = world.energies();
  // Semi-implicit Euler falls by g h^2 n (n + 1) / 2.
  const double t = world.time(), h = world.substep();
  const Vector3d fall = settings.gravity * (0.5 * t * (t + h));
  for (std::size_t i = 0; i < first.bodies[0].nodes.size(); ++i)
    EXPECT_LT((last.bodies[0].nodes[i] - first.bodies[0].nodes[i] - fall).norm(), 1e-11) << "node " << i;
  EXPECT_NEAR(e.elastic, 0, 1e-12 * e.kinetic);
  EXPECT_NEAR(e.kinetic + e.gravity, start, 2 * h / t * e.kinetic);
}

TEST(Conservation, AFreeTopKeepsItsEnergy) {
  BodyDescription body = synthetic::body(synthetic::chainModel(synthetic::straightTube(2, 0.05, 0.01, 4, 8)), 5e3);
  auto model = std::make_shared<SoftBodyModel>(*body.model);
  model->spheres.resize(1);
  model->spheres[0].secondMoment =
      model->spheres[0].volume * 1e-4 * Vector3d(0.2, 0.5, 1.0).asDiagonal().toDenseMatrix();
  model->links.clear();
  for (Attachment& a : model->attachments) a = {false, 0, 0, model->restNodes[0], a.area, a.volume};
  body.model = model;
  body.surface = SurfaceMode::skin;
  World world(weightless(20), {body});                  // 1 ms
  setAngularVelocity(world.data(), 0, {0.2, 20, 0.1});  // about the middle axis: it tumbles
  const double energy = world.energies().kinetic;
  const Vector3d momentumBefore = vectorOf(world.data().spheres.angularMomentum[0]);
  Vector3d slowest = Vector3d::Ones() * 1e9;
  for (int i = 0; i < 250; ++i) {
    world.advance({});
    const Vector3d inBody =
        orientation(world.data(), 0).conjugate() * vectorOf(world.data().spheres.angularVelocity[0]);
    slowest = slowest.cwiseMin(inBody);
  }
  EXPECT_LT(slowest.y(), -10) << "it did not turn over: the gyroscopic term is missing";
  EXPECT_NEAR(world.energies().kinetic, energy, 1e-3 * energy);
  EXPECT_EQ(vectorOf(world.data().spheres.angularMomentum[0]), momentumBefore);
}

TEST(Conservation, RigidMotionsOfEverythingCarryTheSolutionAlong) {
  const Eigen::Isometry3d turned = Eigen::Translation3d(0.3, -0.2, 0.1) *
                                   Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d(0, 0, 1)));
  DynamicsFrame frames[2];
  for (int k : {0, 1}) {
    BodyDescription body = freeTube(0.1);
    body.fixed = {{0, FixedFreedom::all}, {4, FixedFreedom::translation}};
    WorldSettings settings;
    if (k == 1) {
      body.worldFromModel = turned;
      settings.gravity = turned.rotation() * settings.gravity;
    }
    World world(settings, {body});
    for (int i = 0; i < 25; ++i) world.advance({});
    world.readFrame(frames[k]);
  }
  for (std::size_t i = 0; i < frames[0].bodies[0].nodes.size(); ++i)
    EXPECT_LT((turned * frames[0].bodies[0].nodes[i] - frames[1].bodies[0].nodes[i]).norm(), 1e-10);
}

}  // namespace medulla
