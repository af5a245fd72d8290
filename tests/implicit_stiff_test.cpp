#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "physics/dynamics/implicit_data.h"
#include "tests/contact_bodies.h"
#include "tests/dynamics_states.h"
#include "tests/identified_model.h"

// Implicit steps of stiff bodies: what Newton's iteration begins with is far from where they come to, and a share of
// that must not be enough.
namespace medulla {

using namespace states;

namespace {

WorldSettings settingsOf(int order, double step) {
  WorldSettings s;
  s.integrator = Integrator::implicit;
  s.order = order;
  s.gravity = {0, -9.81, 0};
  s.frameDuration = step;
  s.substeps = 1;
  return s;
}

// m: how far a tube, dropped aslant on a rough floor, slides.
double slideOf(double young, int order, double step) {
  WorldSettings settings = settingsOf(order, step);
  settings.contact = ContactMode::balls;
  BodyDescription body = synthetic::body(synthetic::shortTube(), young);
  body.surface = SurfaceMode::skin;
  body.tissue.friction = 0.3;
  body.worldFromModel = Eigen::AngleAxisd(0.3, Vector3d::UnitZ());
  StaticShape floor;
  floor.worldFromShape = Eigen::Isometry3d(Eigen::Translation3d(0, -0.03, 0));
  floor.friction = 0.3;
  World world(settings, {body}, {floor});
  const auto centre = [&] {
    Vector3d sum = Vector3d::Zero();
    for (int k = 0; k < world.data().spheres.count; ++k) sum += vectorOf(world.data().spheres.position[k]);
    return Vector3d(sum / world.data().spheres.count);
  };
  const double start = centre().x();
  while (world.time() < 0.4) world.advance({});
  return centre().x() - start;
}

// s: when a tube let go beside its pin has first come down to below it.
double fallOf(double young, double step) {
  BodyDescription body = synthetic::body(synthetic::shortTube(), young);
  body.surface = SurfaceMode::skin;
  body.fixed = {{0, FixedFreedom::translation}};
  World world(settingsOf(1, step), {body});
  const WorldData& d = world.data();
  const auto aside = [&] { return d.spheres.position[4].v[0] - d.spheres.position[0].v[0]; };
  double before = aside();
  while (world.time() < 1) {
    world.advance({});
    const double now = aside();
    if (now < 0) return world.time() - step * now / (now - before);
    before = now;
  }
  return world.time();
}

}  // namespace

// Friction beyond Coulomb's limit let tubes of 100 MPa and more slide by 2 to 10 mm in steps of 5 ms.
TEST(ImplicitStiff, SlidesAsFarAtAnyStepAndStiffness) {
  const double fine = slideOf(1e9, 1, 0.0003125);
  EXPECT_NEAR(fine, 0.0025, 0.0003);
  for (const int order : {1, 2})
    for (const double young : {1e8, 1e9})
      for (const double step : {0.005, 0.0025}) {
        EXPECT_NEAR(slideOf(young, order, step), fine, 0.05 * fine) << young << ", " << order << ", " << step;
      }
}

// Left to what turning along its first guess would stretch it, a rod of 10 GPa took three times as long.
TEST(ImplicitStiff, FallsAboutAPinAsFastHoweverStiff) {
  const double soft = fallOf(1e7, 0.005);
  for (const double young : {1e8, 1e9, 1e10}) EXPECT_NEAR(fallOf(young, 0.005), soft, 0.002 * soft) << young;
}

// What the iteration leaves open is in the momentum at the stage's end, too, and no outer force.
TEST(ImplicitStiff, SpinIsKeptToRoundingWhateverTheIterationLeaves) {
  WorldSettings settings = settingsOf(1, 0.005);
  settings.gravity.setZero();
  const auto model = synthetic::withNetwork(*synthetic::shortTube(), {.uneven = 0.3, .surface = 1});
  for (BodyDescription body : {synthetic::body(synthetic::shortTube(), 6e3), synthetic::identifiedBody(model, 6e3)}) {
    body.surface = SurfaceMode::full;
    body.tissue.damping = 0.02;
    World world(settings, {body});
    shake(world.data(), 3, 0.1, 0.0005, 0.3);
    for (int k = 0; k < 20; ++k) {
      const Momentum before = momentum(world.data());
      world.advance({});
      const Momentum after = momentum(world.data());
      EXPECT_LT((after.angular - before.angular).norm(), 1e-13 * before.angularScale) << k;
    }
  }
}

}  // namespace medulla
