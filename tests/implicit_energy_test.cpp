#include <gtest/gtest.h>

#include "app/files/model_file.h"
#include "physics/dynamics/world_data.h"
#include "physics/model/mesh_topology.h"
#include "tests/contact_bodies.h"
#include "tests/dynamics_states.h"
#include "tests/identified_model.h"

// Implicit steps that fail at every length, because a body's energy grows whatever they do: it creeps, and only it.
namespace medulla {

using namespace states;

namespace {

constexpr double kGravity = 9.81;  // m/s2

struct Failing {
  LinkModel links;
  int order;
  double step;  // s
  std::uint64_t seed;
};

WorldSettings settingsOf(const Failing& f) {
  WorldSettings s;
  s.integrator = Integrator::implicit;
  s.order = f.order;
  s.gravity = {0, -kGravity, 0};
  s.frameDuration = f.step;
  s.substeps = 1;
  return s;
}

BodyDescription tube(LinkModel links) {
  BodyDescription b = synthetic::body(synthetic::shortTube(), 6e3);
  if (links == LinkModel::identified)
    b = synthetic::identifiedBody(synthetic::withNetwork(*b.model, {.held = {}, .uneven = 0.1}), 6e3);
  return b;
}

// With its links folded, crossed and shorter than they may be.
void tangle(WorldData& d, std::uint64_t seed) {
  shake(d, seed, 3, 0.05, 5);
}

// m: how far a thrown ball ends from its parabola.
double strayOf(World& world, int body, const Vector3d& velocity, double duration) {
  const Quad& place = world.data().spheres.position[world.data().ranges[body].firstSphere];
  const Vector3d start = vectorOf(place);
  synthetic::throwBody(world, body, velocity);
  while (world.time() < duration - 1e-9) world.advance({});
  const double t = world.time();
  return (vectorOf(place) - start - t * velocity - 0.5 * t * t * Vector3d(0, -kGravity, 0)).norm();
}

}  // namespace

// Which tangle fails hangs on the last digits: from the seed on, the first that does. Of a step in parts the shortest,
// a 64th, may be of order 1, and stray by g p^2 / 2 each; some of a step's are.
TEST(ImplicitEnergy, WhatFliesBesideAFailingBodyFliesOn) {
  constexpr int kTangles = 40;
  const Vector3d velocity(1, 2, 0.3);
  const BodyDescription ball = synthetic::ball("ball", 0.01, {1, 0, 0});
  for (Failing f : {Failing{LinkModel::beam, 1, 0.005, 161}, Failing{LinkModel::identified, 1, 0.005, 2},
                    Failing{LinkModel::identified, 2, 0.05, 1}}) {
    World alone(settingsOf(f), {ball});
    const Quad start = alone.data().spheres.position[0];
    const double expected = strayOf(alone, 0, velocity, 0.5);
    EXPECT_EQ(alone.creep().substeps, 0);
    constexpr int kPartsOfOrderOne = 8;
    const double part = f.step / 64, gravity = settingsOf(f).gravity.norm();
    const double allowed = expected + kPartsOfOrderOne * 0.5 * gravity * part * part;
    bool fails = false;
    for (const std::uint64_t end = f.seed + kTangles; !fails && f.seed < end; ++f.seed) {
      World beside(settingsOf(f), {tube(f.links), ball});
      WorldData& d = beside.data();
      const int sphere = d.ranges[1].firstSphere;
      tangle(d, f.seed);  // the ball, too
      for (std::vector<Quad>* turning : {&d.spheres.angularMomentum, &d.spheres.angularVelocity})
        (*turning)[sphere] = {};
      d.spheres.position[sphere] = start;
      const double stray = strayOf(beside, 1, velocity, 0.5);
      EXPECT_LT(stray, allowed) << f.step;
      EXPECT_FALSE(beside.creep().bodies[1]);
      fails = beside.creep().substeps > 0;
      EXPECT_EQ(beside.creep().bodies[0], fails);
    }
    EXPECT_TRUE(fails) << f.step;
  }
}

// Hung by its thin neck, which folds, undamped: order 2 swings about the energy that gravity has given, but no more.
TEST(ImplicitEnergy, WhatFoldsGainsNoMoreThanOrderTwoSwings) {
  BodyDescription body;
  body.name = "hung";
  body.model =
      std::make_shared<SoftBodyModel>(readModel(MEDULLA_SOURCE_DIR "/assets/gallbladder/gallbladder.model.xml"));
  body.tissue.damping = 0;
  body.surface = SurfaceMode::skin;
  body.fixed = {{5, FixedFreedom::translation}};
  for (const double young : {2e4, 5.7e4}) {
    body.tissue.young = young;
    const WorldSettings s = settingsOf({LinkModel::beam, 2, 0.005, 0});
    World world(s, {body});
    const double volume = enclosedVolume({body.model->restNodes, body.model->triangles});
    const double weight = body.tissue.density * volume * s.gravity.norm();
    double most = 0;
    for (int k = 0; k < 500; ++k) {
      world.advance({});
      const Energies e = world.energies();
      most = std::max(most, e.kinetic + e.elastic);
    }
    // It falls by its length, 0.1 m, and stretches by less than that again.
    EXPECT_LT(most, 1.5 * 0.2 * weight) << young;
    EXPECT_GT(most, 0.02 * weight) << young;
  }
}

// What a contact hands over is in the other's account when they part: nobody is held back for what he was given.
// They are placed on their links. What each attempt's correction of momenta left in them made them "not finite" while
// nothing moved.
TEST(ImplicitEnergy, SkinsHaveNoVelocityOfTheirOwn) {
  BodyDescription b = tube(LinkModel::beam);
  b.surface = SurfaceMode::skin;
  WorldSettings settings = settingsOf({LinkModel::beam, 1, 0.005, 0});
  settings.gravity.setZero();
  World world(settings, {b});
  WorldData& d = world.data();
  for (const int i : spheresOf(d.ranges[0]))
    d.spheres.velocity[i] = quadOf(Vector3d(10, 12, 12).cross(vectorOf(d.spheres.position[i])));
  while (world.time() < 0.5) world.advance({});
  for (const int i : d.ranges[0].node) EXPECT_EQ(vectorAt(d.nodes.velocity, i).norm(), 0) << i;
}

TEST(ImplicitEnergy, BallsThatHaveMetAndPartedTakeWholeSteps) {
  for (const double lightness : {1.0, 0.3}) {
    WorldSettings settings = settingsOf({LinkModel::beam, 2, 0.005, 0});
    settings.contact = ContactMode::balls;
    settings.gravity.setZero();
    World world(settings, {synthetic::ball("thrown", 0.01, Vector3d::Zero()),
                           synthetic::ball("hit", lightness * 0.01, {0.03, 0, 0})});
    synthetic::throwBody(world, 0, {0.2, 0, 0});
    for (int k = 0; k < 100; ++k) world.advance({});
    EXPECT_GT(world.data().spheres.velocity[1].v[0], 0.05);
    world.data().implicit.clear();
    for (int k = 0; k < 20; ++k) world.advance({});
    EXPECT_EQ(world.data().implicit.size(), 1) << "steps of other lengths, or of one stage";
  }
}

// A contact that pushes hands energy on: what it joins is judged together. Of the first tangle that fails while it
// pushes, as above.
TEST(ImplicitEnergy, WhatPushesAFailingBodyCreepsWithIt) {
  std::vector<bool> creeps;
  for (std::uint64_t seed = 55; seed < 255 && creeps != std::vector<bool>{true, true, false}; ++seed) {
    const Failing f{LinkModel::beam, 1, 0.02, seed};
    WorldSettings settings = settingsOf(f);
    settings.contact = ContactMode::balls;
    World world(settings,
                {tube(f.links), synthetic::ball("near", 0.01, {0.5, 0, 0}), synthetic::ball("far", 0.01, {1, 0, 0})});
    WorldData& d = world.data();
    tangle(d, f.seed);
    const int near = d.ranges[1].firstSphere, far = d.ranges[2].firstSphere;
    d.spheres.position[near] = quadOf(vectorOf(d.spheres.position[0]) + Vector3d(0.005, 0, 0));
    d.spheres.velocity[near] = d.spheres.velocity[0];
    d.spheres.position[far] = quadOf({1, 0, 0});
    for (int k = 0; k < 20; ++k) world.advance({});
    creeps = world.creep().bodies;
    EXPECT_FALSE(creeps[1] && !creeps[0]) << seed;
    EXPECT_FALSE(creeps[2]) << seed;
  }
  EXPECT_EQ(creeps, (std::vector<bool>{true, true, false}));
}

}  // namespace medulla
