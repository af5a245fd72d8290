#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tests/complaint.h"
#include "tests/contact_bodies.h"
#include "tests/dynamics_states.h"
#include "tests/synthetic_model.h"

namespace medulla {

using namespace states;

static BodyDescription tube(double young, double damping) {
  BodyDescription b = synthetic::body(synthetic::shortTube(), young, {{0, FixedFreedom::all}});
  b.name = "tube";
  b.tissue.damping = damping;
  return b;
}

TEST(World, TheSameRunTwiceHasTheSameHash) {
  std::uint64_t hash[2];
  for (std::uint64_t& h : hash) {
    World world({}, {tube(6e3, 0.1), tube(9e3, 0.2)});
    for (int i = 0; i < 20; ++i) {
      world.advance({});
      world.energies();  // reading changes nothing
      DynamicsFrame frame;
      world.readFrame(frame);
    }
    h = world.stateHash();
  }
  EXPECT_EQ(hash[0], hash[1]);
  World other({}, {tube(6e3, 0.1), tube(9e3, 0.2)});
  for (int i = 0; i < 20; ++i) {
    const std::uint64_t before = other.stateHash();
    other.advance({});
    EXPECT_NE(other.stateHash(), before);
    EXPECT_EQ(other.stateHash(), other.stateHash());
  }
  EXPECT_EQ(other.stateHash(), hash[0]) << "reading changed the state";
}

// A tube that is held by a tool, and two balls that lie on a plane and on each other.
static World heldTubeAndBalls(Integrator integrator) {
  WorldSettings settings;
  settings.contact = ContactMode::balls;
  settings.integrator = integrator;
  settings.sleepAfter = 10;
  BodyDescription held = tube(6e3, 0.1);
  held.surface = SurfaceMode::contact;
  held.worldFromModel.translation() = Vector3d(0, 0.3, 0);
  StaticShape floor;
  floor.friction = 0.3;
  World world(
      settings,
      {held, synthetic::ball("a", 0.01, {0.3, 0.01, 0}, 0.3), synthetic::ball("b", 0.01, {0.303, 0.0295, 0}, 0.3)},
      {floor});
  Loads loads;
  loads.heldNodes.resize(1);
  loads.heldNodes[0].node = 40;
  loads.heldNodes[0].anchor = held.worldFromModel * held.model->restNodes[40] + Vector3d(0, 0.002, 0.001);
  loads.heldNodes[0].stiffness = 50;
  for (int k = 0; k < 5; ++k) world.advance(loads);
  return world;
}

TEST(World, EveryNumberOfItsStateIsInTheHash) {
  World world = heldTubeAndBalls(Integrator::explicitEuler);
  WorldData& d = world.data();
  const std::uint64_t before = world.stateHash();
  const auto expectKnown = [&](const char* what, double& value) {
    const double kept = value;
    value = std::nextafter(value, 1e9);
    EXPECT_NE(world.stateHash(), before) << what;
    value = kept;
  };
  const auto expectAllKnown = [&](const char* what, Quad& q, int count) {
    for (int k = 0; k < count; ++k) expectKnown(what, q.v[k]);
  };
  for (const int sphere : {0, 2, 4, d.ranges[1].firstSphere, d.ranges[2].firstSphere}) {
    expectAllKnown("position", d.spheres.position[sphere], 3);
    expectAllKnown("velocity", d.spheres.velocity[sphere], 3);
    expectAllKnown("orientation", d.spheres.orientation[sphere], 4);
    expectAllKnown("angular momentum", d.spheres.angularMomentum[sphere], 3);
    expectAllKnown("where it keeps still", d.stillPlace[sphere].position, 3);
    expectAllKnown("as it keeps still", d.stillPlace[sphere].orientation, 4);
  }
  for (int k = 0; k < 4; ++k) {
    const int link = d.ranges[0].firstLink + k;
    expectKnown("turns", d.links.unwoundTwist[link / 4].v[link % 4]);
  }
  for (const int node : {d.ranges[0].node.front(), d.ranges[0].node[40], d.ranges[0].node.back()}) {
    for (int axis = 0; axis < 3; ++axis) {
      for (auto* vectors : {&d.nodes.position, &d.nodes.velocity}) {
        const Vector3d kept = vectorAt(*vectors, node);
        Vector3d changed = kept;
        changed[axis] = std::nextafter(kept[axis], 1e9);
        setVector(*vectors, node, changed);
        EXPECT_NE(world.stateHash(), before) << node << ' ' << axis;
        setVector(*vectors, node, kept);
      }
    }
  }
  ASSERT_FALSE(d.loadForces.empty());
  for (int axis = 0; axis < 3; ++axis) expectKnown("force of a tool", d.loadForces[0][axis]);
  ASSERT_FALSE(d.contact.carried.empty());
  for (CarriedImpulse& c : d.contact.carried) expectAllKnown("impulse of a contact", c.impulse, 3);
  ++d.contact.carried[0].key;
  EXPECT_NE(world.stateHash(), before) << "whose impulse";
  --d.contact.carried[0].key;
  ++d.rest[1].stillFrames;
  EXPECT_NE(world.stateHash(), before) << "for how long it has kept still";
  --d.rest[1].stillFrames;
  EXPECT_EQ(world.stateHash(), before);
}

TEST(World, WhatImplicitStepsRememberIsInTheHash) {
  World world = heldTubeAndBalls(Integrator::implicit);
  const std::uint64_t before = world.stateHash();
  for (EnergyLedger& ledger : world.data().ledger) {
    for (double* value : {&ledger.most, &ledger.due, &ledger.mostDue}) {
      const double kept = *value;
      *value = std::nextafter(kept, 1e9);
      EXPECT_NE(world.stateHash(), before);
      *value = kept;
    }
  }
  EXPECT_EQ(world.stateHash(), before);
}

// Where nothing gives, no stiffness asks for short substeps, but what turns does: about its middle axis it tumbles, and
// in substeps of whole frames it tumbled into four times its energy.
TEST(World, ARigidBodyTumblesWithTheEnergyThatItHas) {
  WorldSettings settings;
  settings.gravity.setZero();
  settings.frameDuration = 0.05;
  BodyDescription stone = synthetic::ball("stone", 0.03, {0, 0, 0});
  auto model = std::make_shared<SoftBodyModel>(*stone.model);
  FillingSphere& sphere = model->spheres[0];
  sphere.secondMoment = sphere.volume * Vector3d(5e-4, 2e-4, 0.5e-4).asDiagonal();
  stone.model = model;
  World world(settings, {stone});
  setAngularVelocity(world.data(), 0, {0.5, 15, 0.3});
  const double before = world.energies().kinetic;
  for (int k = 0; k < 200; ++k) {
    world.advance({});
    ASSERT_NEAR(world.energies().kinetic / before, 1, 0.03) << world.time();
  }
}

// What like bodies share is worked out once: whatever differs must tell them apart.
TEST(World, BodiesOfOneModelMoveAsEachAlone) {
  WorldSettings settings;
  settings.substeps = 60;
  const BodyDescription first = tube(6e3, 0.1);
  std::vector<BodyDescription> bodies(7, first);
  bodies[1].tissue.young = 9e3;
  bodies[2].tissue.damping = 0.3;
  bodies[3].links = LinkModel::springs;
  bodies[4].steered = {{{.flexion = 2}}};
  bodies[5].fixed = {{1, FixedFreedom::all}};
  World together(settings, bodies);
  for (int i = 0; i < 10; ++i) together.advance({});
  DynamicsFrame all;
  together.readFrame(all);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    World alone(settings, {bodies[b]});
    for (int i = 0; i < 10; ++i) alone.advance({});
    DynamicsFrame one;
    alone.readFrame(one);
    EXPECT_EQ(all.bodies[b].nodes, one.bodies[0].nodes) << b;
    if (b >= 1 && b <= 5) {
      EXPECT_NE(all.bodies[b].nodes, all.bodies[0].nodes) << b;
    }
  }
  EXPECT_EQ(all.bodies[6].nodes, all.bodies[0].nodes);
}

// So many that they are stepped in batches; five spheres and four links fill no group of four.
TEST(World, BodiesDoNotDisturbEachOther) {
  WorldSettings settings;
  settings.substeps = 60;
  settings.contact = ContactMode::balls;
  std::vector<BodyDescription> bodies;
  for (int k = 0; k < 40; ++k) {
    bodies.push_back(tube(k % 2 == 0 ? 9e3 : 6e3, 0.1));
    bodies.back().neighbours = std::vector<int>();
    bodies.back().fixed.clear();
  }
  World alone(settings, {bodies[1]}), together(settings, bodies);
  ASSERT_GT(together.data().awake.batches.size(), 2U);
  World odd(settings, {bodies[0]});
  for (int i = 0; i < 10; ++i)
    for (World* world : {&alone, &odd, &together}) world->advance({});
  DynamicsFrame a, b;
  alone.readFrame(a);
  together.readFrame(b);
  for (std::size_t k = 1; k < bodies.size(); k += 2) {
    EXPECT_EQ(a.bodies[0].nodes, b.bodies[k].nodes) << k;
    for (std::size_t i = 0; i < a.bodies[0].spheres.size(); ++i)
      EXPECT_EQ(a.bodies[0].spheres[i].position, b.bodies[k].spheres[i].position) << k << ' ' << i;
  }
  const Energies of = together.energies(), ofOne = alone.energies(), ofOther = odd.energies();
  EXPECT_NEAR(of.kinetic, 20 * (ofOne.kinetic + ofOther.kinetic), 1e-12 * of.kinetic);
  EXPECT_NEAR(of.elastic, 20 * (ofOne.elastic + ofOther.elastic), 1e-12 * (of.kinetic + of.elastic));
}

TEST(World, RestIsRest) {
  WorldSettings settings;
  settings.gravity.setZero();
  for (SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
    BodyDescription body = tube(6e3, 0.1);
    body.surface = surface;
    World world(settings, {body});
    for (int i = 0; i < 10; ++i) world.advance({});
    DynamicsFrame frame;
    world.readFrame(frame);
    for (std::size_t i = 0; i < frame.bodies[0].nodes.size(); ++i)
      EXPECT_LT((frame.bodies[0].nodes[i] - body.model->restNodes[i]).norm(), 1e-14);
    EXPECT_NEAR(world.volumeRatio(0), 1, 1e-12);
  }
}

TEST(World, StableAtTheEstimateAndUnstableWellAbove) {
  for (double damping : {0.0, 0.1, 10.0, 1000.0}) {
    for (SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
      BodyDescription body = tube(6e3, damping);
      body.surface = surface;
      WorldSettings settings;
      settings.gravity.setZero();
      const double stable = World(settings, {body}).stableSubstep();
      const auto energyAfter = [&](double share) {
        settings.frameDuration = share * stable * 10;
        settings.substeps = 10;
        World world(settings, {body});
        WorldData& d = world.data();
        shake(d, 11, 1e-4, 1e-6, 1e-4);
        d.spheres.velocity[0] = d.spheres.angularVelocity[0] = d.spheres.angularMomentum[0] = {};  // what is held
        const double before = world.energies().kinetic + world.energies().elastic;
        for (int i = 0; i < 200; ++i) world.advance({});
        return (world.energies().kinetic + world.energies().elastic) / before;
      };
      EXPECT_LT(energyAfter(0.95), 20) << damping;
      double above = std::numeric_limits<double>::infinity();
      try {
        above = energyAfter(1.3);
      } catch (const std::runtime_error&) {
        // not finite: as unstable as it gets
      }
      EXPECT_GT(above, 1e6) << "the estimate is too careful: damping " << damping;
    }
  }
}

// Each body by its own: one that can take any step asks for nothing, damped or not.
TEST(World, UndampedBodiesAskForShorterSubsteps) {
  const auto share = [](const std::vector<BodyDescription>& bodies) {
    WorldSettings settings;
    settings.frameDuration = 0.5;  // of many substeps
    const World world(settings, bodies);
    return world.substep() / world.stableSubstep();
  };
  EXPECT_NEAR(share({tube(6e3, 0.1)}), 0.8, 0.01);
  EXPECT_NEAR(share({tube(6e3, 0)}), 0.4, 0.01);
  BodyDescription soft = tube(6, 0);
  EXPECT_NEAR(share({tube(6e3, 0.1), soft}), 0.8, 0.01);
}

TEST(World, ABlowUpNamesBodyTimeAndCause) {
  WorldSettings settings;
  settings.substeps = 1;
  World world(settings, {tube(1e6, 0.1)});
  const std::string message = complaintOf([&] {
    for (int i = 0; i < 2000; ++i) world.advance({});
  });
  EXPECT_NE(message.find("body 'tube'"), std::string::npos) << message;
  EXPECT_NE(message.find("not finite at"), std::string::npos) << message;
  EXPECT_NE(message.find("more substeps"), std::string::npos) << message;
}

TEST(World, DescriptionsThatCannotBeSimulatedAreRefused) {
  const auto refusal = [](const std::function<void(BodyDescription&)>& spoil) {
    BodyDescription body = tube(6e3, 0.1);
    spoil(body);
    return complaintOf([&] { World world({}, {body}); });
  };
  const auto expectSays = [](const std::string& message, const char* words) {
    EXPECT_NE(message.find(words), std::string::npos) << message;
    EXPECT_NE(message.find("body 'tube'"), std::string::npos) << message;
  };
  expectSays(refusal([](BodyDescription& b) { b.tissue.young = -1; }), "Young's modulus");
  expectSays(refusal([](BodyDescription& b) { b.tissue.poisson = 0.5; }), "Poisson's ratio");
  expectSays(refusal([](BodyDescription& b) { b.tissue.density = std::nan(""); }), "density");
  expectSays(refusal([](BodyDescription& b) { b.tissue.damping = -0.1; }), "damping ratio");
  expectSays(refusal([](BodyDescription& b) { b.steered = {{{.flexion = 0}}}; }), "flexion factor");
  expectSays(refusal([](BodyDescription& b) { b.fixed = {{99, FixedFreedom::all}}; }), "sphere 99");
  expectSays(refusal([](BodyDescription& b) { b.model = std::make_shared<SoftBodyModel>(); }), "no spheres");
}

}  // namespace medulla
