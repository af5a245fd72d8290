#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "app/files/model_file.h"
#include "tests/dynamics_states.h"
#include "tests/synthetic_model.h"

// SurfaceMode::contact: nodes are masses of their own where something acts on them, and nobody can tell.
namespace medulla {

using namespace states;

namespace {

constexpr double kTubeRadius = 0.012;

BodyDescription tube(SurfaceMode surface, bool held) {
  BodyDescription b =
      synthetic::body(synthetic::chainModel(synthetic::straightTube(8, 0.16, kTubeRadius, 24, 12)), 5e3);
  b.name = "tube";
  b.surface = surface;
  b.tissue.damping = 0.5;
  if (held) b.fixed = {{0, FixedFreedom::all}, {1, FixedFreedom::all}, {6, FixedFreedom::all}, {7, FixedFreedom::all}};
  return b;
}

World worldOf(const BodyDescription& body, const Vector3d& gravity) {
  WorldSettings s;
  s.gravity = gravity;
  return World(s, {body});
}

Loads holding(const World& world, int node, const Vector3d& shift) {
  HeldNode held;
  held.node = node;
  held.anchor = world.bodies()[0].model->restNodes[node] + shift;
  held.stiffness = 100;
  held.damping = 0.1;
  Loads loads;
  loads.heldNodes = {held};
  return loads;
}

bool isCarried(const WorldData& d, int node) {
  return isCarried(d.surface, node / 4);
}

// add(mass, position, velocity) of spheres and of the nodes that are masses of their own now.
template <class Add>
void forEachMovingMass(const WorldData& d, const Add& add) {
  for (int i = 0; i < d.spheres.count; ++i)
    add(sphereMass(d, i), vectorOf(d.spheres.position[i]), vectorOf(d.spheres.velocity[i]));
  for (int i = 0; i < d.nodes.dynamicEnd; ++i)
    if (!isCarried(d, i)) add(d.nodes.mass[i], vectorAt(d.nodes.position, i), vectorAt(d.nodes.velocity, i));
}

double movingMass(const WorldData& d) {
  double sum = 0;
  forEachMovingMass(d, [&](double m, const Vector3d&, const Vector3d&) { sum += m; });
  return sum;
}

// About the origin.
Momentum movingMomentum(const WorldData& d) {
  Momentum out;
  forEachMovingMass(d, [&](double m, const Vector3d& at, const Vector3d& v) {
    out.linear += m * v;
    out.linearScale += m * v.norm();
    out.angular += m * at.cross(v);
  });
  for (int i = 0; i < d.spheres.count; ++i) out.angular += vectorOf(d.spheres.angularMomentum[i]);
  return out;
}

// The whole tube, stiffly, about its middle.
void turn(WorldData& d, const Vector3d& spin) {
  const Vector3d centre(0.08, 0, 0);
  for (int i = 0; i < d.spheres.count; ++i) {
    d.spheres.velocity[i] = quadOf(spin.cross(vectorOf(d.spheres.position[i]) - centre));
    setAngularVelocity(d, i, spin);
  }
  for (const int i : d.ranges[0].node)
    setVector(d.nodes.velocity, i, spin.cross(vectorAt(d.nodes.position, i) - centre));
}

constexpr int kNode = 200;  // at about two thirds of the length

}  // namespace

TEST(SurfaceParts, NothingMovesWhereNothingActs) {
  World world = worldOf(tube(SurfaceMode::contact, true), {0, -9.81, 0});
  const World full = worldOf(tube(SurfaceMode::full, true), {0, -9.81, 0});
  for (int k = 0; k < 20; ++k) {
    world.advance({});
    EXPECT_EQ(world.dynamicNodes(0), 0);
  }
  const double expected = movingMass(full.data());
  EXPECT_NEAR(movingMass(world.data()), expected, 1e-12 * expected);
}

TEST(SurfaceParts, AToolFeelsAFullSurfaceThoughMostOfItIsCarried) {
  World part = worldOf(tube(SurfaceMode::contact, true), Vector3d::Zero()),
        full = worldOf(tube(SurfaceMode::full, true), Vector3d::Zero());
  double squaredError = 0, squared = 0;
  int most = 0;
  for (int k = 0; k < 60; ++k) {
    const Loads loads = holding(full, kNode, std::min(1.0, k / 40.0) * Vector3d(0, 0.001, 0.003));
    const Vector3d felt = part.advance(loads).at(0), expected = full.advance(loads).at(0);
    squaredError += (felt - expected).squaredNorm();
    squared += expected.squaredNorm();
    most = std::max(most, part.dynamicNodes(0));
  }
  EXPECT_LT(std::sqrt(squaredError / squared), 0.02);
  EXPECT_GT(most, 20);
  EXPECT_LT(most, full.dynamicNodes(0) * 3 / 4);
}

TEST(SurfaceParts, PartsLeaveAgainOnceWhatTheyWereAskedForIsOver) {
  World part = worldOf(tube(SurfaceMode::contact, true), Vector3d::Zero()),
        full = worldOf(tube(SurfaceMode::full, true), Vector3d::Zero());
  const auto both = [&](const Loads& loads) {
    part.advance(loads);
    full.advance(loads);
  };
  for (int k = 0; k < 40; ++k) both(holding(full, kNode, k / 40.0 * Vector3d(0, 0.004, 0)));
  EXPECT_GT(part.dynamicNodes(0), 0);
  DynamicsFrame frame, expected;
  double farthest = 0;
  for (int k = 0; k < 150; ++k) {
    both({});
    part.readFrame(frame);
    full.readFrame(expected);
    for (std::size_t i = 0; i < frame.bodies[0].nodes.size(); ++i)
      farthest = std::max(farthest, (frame.bodies[0].nodes[i] - expected.bodies[0].nodes[i]).norm());
  }
  EXPECT_EQ(part.dynamicNodes(0), 0);
  EXPECT_LT(farthest, 0.02 * kTubeRadius);
}

// Weight presses on a host whose patch of surface is open, so that nodes do not hang still where their weight alone
// would have them: along a tube at its ends, across a slab everywhere.
TEST(SurfaceParts, PartsLeaveAgainUnderTheirWeight) {
  const Vector3d shift(0, 0, 0.0005);
  const auto movingAfterATouch = [&](BodyDescription body, int node, const Vector3d& gravity) {
    body.surface = SurfaceMode::contact;
    body.tissue.damping = 0.5;
    World world = worldOf(body, gravity);
    for (int k = 0; k < 50; ++k) world.advance({});
    EXPECT_EQ(world.dynamicNodes(0), 0);
    for (int k = 0; k < 20; ++k) world.advance(holding(world, node, shift));
    EXPECT_GT(world.dynamicNodes(0), 0);
    for (int k = 0; k < 150; ++k) world.advance({});
    return world.dynamicNodes(0);
  };
  BodyDescription soft = tube(SurfaceMode::contact, true);
  soft.tissue.young = 1e3;
  EXPECT_EQ(movingAfterATouch(soft, 0, {-9.81, 0, 0}), 0);
  BodyDescription slab = synthetic::abdomenScene()[4];
  slab.worldFromModel.setIdentity();
  EXPECT_EQ(movingAfterATouch(slab, 300, {0, 0, -9.81}), 0);
}

namespace {

// How far the two worlds' surfaces are apart at most, over how far the second one's is from `rest`.
double farthestApart(const World& part, const World& full, const DynamicsFrame& rest) {
  DynamicsFrame frame, expected;
  part.readFrame(frame);
  full.readFrame(expected);
  double farthest = 0, largest = 0;
  for (std::size_t i = 0; i < frame.bodies[0].nodes.size(); ++i) {
    farthest = std::max(farthest, (frame.bodies[0].nodes[i] - expected.bodies[0].nodes[i]).norm());
    largest = std::max(largest, (rest.bodies[0].nodes[i] - expected.bodies[0].nodes[i]).norm());
  }
  return farthest / largest;
}

}  // namespace

// Beside fixed nodes edges hold the others, too, moving or carried: whichever they are, the surface is the same.
TEST(SurfaceParts, WeightHangsTheSurfaceWhereAFullOneHangs) {
  const auto hanging = [](SurfaceMode surface) {
    BodyDescription body = tube(surface, false);
    for (std::size_t i = 0; i < body.model->restNodes.size(); ++i)
      if (body.model->restNodes[i].x() < 0.25 * 0.16) body.fixedNodes.push_back(static_cast<int>(i));
    body.tissue.damping = 2;
    return worldOf(body, {0, -1, 0});
  };
  World part = hanging(SurfaceMode::contact), full = hanging(SurfaceMode::full);
  DynamicsFrame rest;
  full.readFrame(rest);
  for (int k = 0; k < 400; ++k) {
    part.advance({});
    full.advance({});
  }
  EXPECT_LT(part.dynamicNodes(0), full.dynamicNodes(0) / 2);
  EXPECT_LT(farthestApart(part, full, rest), 1e-5);
}

// A tool that asks for parts and does nothing leaves a body that hangs at rest where it is: their nodes' weight, which
// the spheres felt, is theirs now, not both's.
TEST(SurfaceParts, PartsThatJoinDoNotWeighTwice) {
  BodyDescription body = tube(SurfaceMode::contact, true);
  body.tissue.damping = 2;
  World world = worldOf(body, {0, -5, 0});
  for (int k = 0; k < 400; ++k) world.advance({});
  const int resting = world.dynamicNodes(0);
  const std::vector<Quad> before = world.data().spheres.position;
  Loads nothing = holding(world, kNode, Vector3d::Zero());
  nothing.heldNodes[0].stiffness = nothing.heldNodes[0].damping = 0;
  double moved = 0;
  for (int k = 0; k < 5; ++k) {
    world.advance(nothing);
    for (int i = 0; i < world.data().spheres.count; ++i)
      moved = std::max(moved, (vectorOf(world.data().spheres.position[i]) - vectorOf(before[i])).norm());
  }
  EXPECT_GT(world.dynamicNodes(0), resting);
  EXPECT_LT(moved, 1e-9);  // 7e-6 where both feel it
}

// Weight is felt where nodes hang, and not at all by a body that falls: it goes on to turn as it was thrown.
TEST(SurfaceParts, AFallingBodyTurnsAsAFullSurfaceDoes) {
  const auto thrown = [](SurfaceMode surface) {
    World world = worldOf(tube(surface, false), {0, -9.81, 0});
    turn(world.data(), {0, 0, 4});
    return world;
  };
  World part = thrown(SurfaceMode::contact), full = thrown(SurfaceMode::full);
  DynamicsFrame rest;
  full.readFrame(rest);
  for (int k = 0; k < 25; ++k) {
    part.advance({});
    full.advance({});
    EXPECT_EQ(part.dynamicNodes(0), 0);
  }
  EXPECT_LT(farthestApart(part, full, rest), 1e-4);
}

// What slows spheres allows for what hangs on them, moving or carried: a tube that sinks under its weight keeps pace.
TEST(SurfaceParts, WeightMovesABodyAsItMovesAFullSurface) {
  const auto sinking = [](SurfaceMode surface) {
    BodyDescription body = tube(surface, false);
    body.fixed = {{0, FixedFreedom::all}, {1, FixedFreedom::all}};
    return worldOf(body, {0, -2, 0});
  };
  World part = sinking(SurfaceMode::contact), full = sinking(SurfaceMode::full);
  ASSERT_GT(full.data().ranges[0].massDamping, 0);
  DynamicsFrame rest;
  full.readFrame(rest);
  double apart = 0;
  for (int k = 0; k < 100; ++k) {
    part.advance({});
    full.advance({});
    if (k % 10 == 9) apart = std::max(apart, farthestApart(part, full, rest));
  }
  EXPECT_LT(apart, 0.002);
}

// Carried nodes hang beside their spheres; what they weigh turns with these, or a swing would gain or lose by it. A
// stub of two spheres, most of whose mass is its surface's, swings on a pin for ten seconds in few frames.
TEST(SurfaceParts, APendulumSwingsAsWithAFullSurface) {
  const auto energyLeft = [](SurfaceMode surface) {
    const auto model = synthetic::chainModel(synthetic::straightTube(2, 0.03, 0.012, 8, 10), 0.9);
    BodyDescription body = synthetic::body(model, 5e4, {{0, FixedFreedom::translation}});
    body.surface = surface;
    World world({.gravity = {0, -9.81, 0}, .frameDuration = 0.05}, {body});
    const auto energy = [&world] {
      const Energies e = world.energies();
      return e.kinetic + e.elastic + e.gravity;
    };
    for (int k = 0; k < 20; ++k) world.advance({});
    const double start = energy();
    double swing = 0;
    for (int k = 0; k < 40; ++k) {
      world.advance({});
      swing = std::max(swing, world.energies().kinetic);
    }
    for (int k = 0; k < 160; ++k) world.advance({});
    return 1 + (energy() - start) / swing;
  };
  const double part = energyLeft(SurfaceMode::contact), full = energyLeft(SurfaceMode::full);
  std::printf("[  reached ] after ten seconds %.4f of a swing is left, with a full surface %.4f\n", part, full);
  EXPECT_NEAR(part, full, 0.02);
  EXPECT_LT(part, 1);
}

static BodyDescription lopsided(SurfaceMode surface, std::vector<FixedSphere> fixed) {
  const auto model =
      std::make_shared<SoftBodyModel>(readModel(MEDULLA_SOURCE_DIR "/assets/gallbladder/gallbladder.model.xml"));
  BodyDescription body = synthetic::body(model, 4e4, std::move(fixed));
  body.surface = surface;
  body.tissue.damping = 0;
  return body;
}

// Kinetic and elastic, at most in four seconds.
static double mostEnergy(World& world) {
  double most = 0;
  for (int k = 0; k < 200; ++k) {
    world.advance({});
    const Energies e = world.energies();
    most = std::max(most, e.kinetic + e.elastic);
  }
  return most;
}

// Nothing damps it: a pin holds a sphere in the midst of a body that is not symmetric about anything.
TEST(SurfaceParts, ALopsidedBodyOnAPinGainsNothing) {
  const auto gain = [](SurfaceMode surface) {
    World world({.gravity = {0.3, -9.81, 0.2}}, {lopsided(surface, {{1, FixedFreedom::translation}})});
    const double first = mostEnergy(world);
    for (int k = 0; k < 4; ++k) mostEnergy(world);
    return mostEnergy(world) / first;
  };
  const double part = gain(SurfaceMode::contact), full = gain(SurfaceMode::full);
  std::printf("[  reached ] after 24 s %.4f of its energy, with a full surface %.4f\n", part, full);
  EXPECT_NEAR(part, full, 0.05);
}

// What is felt in free fall is nothing, however the body spins.
TEST(SurfaceParts, AFallingBodyKeepsItsSpin) {
  World world({}, {lopsided(SurfaceMode::contact, {})});
  WorldData& d = world.data();
  turn(d, {3, 20, 10});
  const auto spin = [&d] {
    Vector3d centre = Vector3d::Zero();
    forEachMovingMass(d, [&](double m, const Vector3d& at, const Vector3d&) { centre += m * at; });
    const Momentum all = movingMomentum(d);
    return Vector3d(all.angular - (centre / movingMass(d)).cross(all.linear));
  };
  for (int k = 0; k < 5; ++k) world.advance({});
  const Vector3d before = spin();
  for (int k = 0; k < 100; ++k) world.advance({});
  EXPECT_EQ(world.dynamicNodes(0), 0);
  std::printf("[  reached ] spin changes by %.2g of itself in two seconds of falling\n",
              (spin() - before).norm() / before.norm());
  EXPECT_LT((spin() - before).norm(), 1e-6 * before.norm());
}

// Its nodes hang under what it feels, which is nothing.
TEST(SurfaceParts, AFallingBodyHasTheShapeOfAFullSurface) {
  World part = worldOf(tube(SurfaceMode::contact, false), {0, -9.81, 0}),
        full = worldOf(tube(SurfaceMode::full, false), {0, -9.81, 0});
  DynamicsFrame rest;
  full.readFrame(rest);
  for (int k = 0; k < 20; ++k) (k % 2 == 0 ? part : full).advance({});
  EXPECT_LT(farthestApart(part, full, rest), 1e-9);
}

// Where the drag bears it, weight is felt no more than in free fall: carried nodes' weight alone would turn it.
TEST(SurfaceParts, ABodyThatSinksDoesNotTurn) {
  World world({.gravity = {0, -9.81, 0}, .ambientDrag = 2}, {lopsided(SurfaceMode::contact, {})});
  for (int k = 0; k < 200; ++k) world.advance({});
  const double cosine = std::min(1.0, std::abs(world.data().spheres.orientation[0].v[3]));
  EXPECT_LT(2 * std::acos(cosine), 1e-3);  // rad
}

// A free tube is pulled along: what the tool gives is what spheres and moving nodes have, while nodes join and leave.
// Not to rounding: what edges pull at carried nodes is nobody's until these join, a frame later.
TEST(SurfaceParts, JoiningAndLeavingKeepMomentum) {
  World world = worldOf(tube(SurfaceMode::contact, false), Vector3d::Zero());
  Vector3d given = Vector3d::Zero();
  for (int k = 0; k < 10; ++k) given += world.advance(holding(world, kNode, {0.0002 * k, 0, 0})).at(0);
  EXPECT_GT(world.dynamicNodes(0), 0);
  EXPECT_LT((movingMomentum(world.data()).linear - given).norm(), 0.01 * given.norm());
  for (int k = 0; k < 100 && world.dynamicNodes(0) > 0; ++k) world.advance({});
  EXPECT_EQ(world.dynamicNodes(0), 0);
  EXPECT_LT((movingMomentum(world.data()).linear - given).norm(), 0.01 * given.norm());
}

// Parts that join a turning body take along what their places turn with, not what their spheres move with.
TEST(SurfaceParts, ATurningBodyKeepsMomentumWhereTheyJoin) {
  World world = worldOf(tube(SurfaceMode::contact, false), Vector3d::Zero());
  WorldData& d = world.data();
  turn(d, {3, 0, 4});
  for (int k = 0; k < 3; ++k) world.advance({});
  ASSERT_EQ(world.dynamicNodes(0), 0);
  const Momentum before = movingMomentum(d);
  Loads nothing = holding(world, kNode, Vector3d::Zero());
  nothing.heldNodes[0].stiffness = nothing.heldNodes[0].damping = 0;
  world.advance(nothing);
  EXPECT_GT(world.dynamicNodes(0), 0);
  const Momentum joined = movingMomentum(d);
  EXPECT_LT((joined.linear - before.linear).norm(), 1e-4 * before.linearScale);
  EXPECT_LT((joined.angular - before.angular).norm(), 1e-4 * before.angular.norm());
  for (int k = 0; k < 100 && world.dynamicNodes(0) > 0; ++k) world.advance({});
  EXPECT_EQ(world.dynamicNodes(0), 0);
  const Momentum left = movingMomentum(d);
  EXPECT_LT((left.linear - before.linear).norm(), 1e-4 * before.linearScale);
  EXPECT_LT((left.angular - before.angular).norm(), 1e-4 * before.angular.norm());
}

// How fast the whole travels is nobody's business.
TEST(SurfaceParts, ATravellingBodyTurnsAsOneThatStays) {
  std::vector<std::vector<Vector3d>> spins;
  for (const Vector3d& velocity : {Vector3d(0, 0, 0), Vector3d(0, 4, -3)}) {
    World world = worldOf(tube(SurfaceMode::contact, false), Vector3d::Zero());
    WorldData& d = world.data();
    turn(d, {3, 0, 4});
    for (int i = 0; i < d.spheres.count; ++i)
      d.spheres.velocity[i] = quadOf(vectorOf(d.spheres.velocity[i]) + velocity);
    for (const int i : d.ranges[0].node) setVector(d.nodes.velocity, i, vectorAt(d.nodes.velocity, i) + velocity);
    Loads nothing = holding(world, kNode, Vector3d::Zero());
    nothing.heldNodes[0].stiffness = nothing.heldNodes[0].damping = 0;
    std::vector<Vector3d>& spin = spins.emplace_back();
    int joined = 0;
    for (int k = 0; k < 60; ++k) {
      world.advance(k == 3 ? nothing : Loads());
      joined = std::max(joined, world.dynamicNodes(0));
      for (int i = 0; i < d.spheres.count; ++i) spin.push_back(vectorOf(d.spheres.angularVelocity[i]));
    }
    EXPECT_GT(joined, 0);
    EXPECT_EQ(world.dynamicNodes(0), 0);
  }
  for (std::size_t k = 0; k < spins[0].size(); ++k) ASSERT_LT((spins[1][k] - spins[0][k]).norm(), 1e-6) << k;
}

// What joins a body under way goes with it from the start: a tube of which a tool wants nothing, drawn along by it.
TEST(SurfaceParts, WhatJoinsAMovingBodyIsNotLeftBehind) {
  World world = worldOf(tube(SurfaceMode::contact, false), Vector3d::Zero());
  WorldData& d = world.data();
  const Vector3d velocity(0, 0, 0.5);
  for (int i = 0; i < d.spheres.count; ++i) d.spheres.velocity[i] = quadOf(velocity);
  for (const int i : d.ranges[0].node) setVector(d.nodes.velocity, i, velocity);
  world.advance({});
  const std::vector<Vector3d>& rest = world.bodies()[0].model->restNodes;
  int joined = 0;
  for (int k = 0; k < 8; ++k) {
    std::vector<bool> wasCarried;
    for (const int i : d.ranges[0].node) wasCarried.push_back(isCarried(d, i));
    Loads loads = holding(world, kNode, Vector3d(0, 0, 0.004) + world.time() * velocity);
    world.advance(loads);
    for (std::size_t n = 0; n < rest.size(); ++n) {
      const int i = d.ranges[0].node[n];
      if (!wasCarried[n] || isCarried(d, i)) continue;
      ++joined;
      EXPECT_LT((vectorAt(d.nodes.position, i) - rest[n] - world.time() * velocity).norm(), 0.006) << "node " << n;
    }
  }
  EXPECT_GT(joined, 20);
}

// The mass of carried nodes is their spheres', and counts once.
TEST(SurfaceParts, EnergiesCountEveryMassOnce) {
  World part = worldOf(tube(SurfaceMode::contact, false), {0, -9.81, 0}),
        full = worldOf(tube(SurfaceMode::full, false), {0, -9.81, 0});
  for (int k = 0; k < 10; ++k) {
    part.advance({});
    full.advance({});
  }
  EXPECT_EQ(part.dynamicNodes(0), 0);
  EXPECT_NEAR(part.energies().kinetic, full.energies().kinetic, 1e-3 * full.energies().kinetic);
  EXPECT_NEAR(part.energies().gravity, full.energies().gravity, 1e-4 * std::abs(full.energies().gravity));
}

// Where a node is has its weight's energy, whether it moves by itself or is carried.
TEST(SurfaceParts, GravitysEnergyKnowsNoJump) {
  BodyDescription body = tube(SurfaceMode::contact, true);
  body.tissue.damping = 2;
  World world = worldOf(body, {0, -5, 0});
  for (int k = 0; k < 400; ++k) world.advance({});
  const double before = world.energies().gravity;
  Loads nothing = holding(world, kNode, Vector3d::Zero());
  nothing.heldNodes[0].stiffness = nothing.heldNodes[0].damping = 0;
  world.advance(nothing);
  EXPECT_NEAR(world.energies().gravity, before, 1e-6 * std::abs(before));
}

TEST(SurfaceParts, ADeadLoadKeepsItsNodesMoving) {
  BodyDescription loaded = tube(SurfaceMode::contact, true);
  loaded.deadLoads = {{kNode, {0, 0, 1e-3}, 0, 0.1}};
  World world = worldOf(loaded, Vector3d::Zero());
  for (int k = 0; k < 50; ++k) world.advance({});
  EXPECT_FALSE(isCarried(world.data(), world.data().ranges[0].node[kNode]));
}

TEST(SurfaceParts, TwiceTheSameAndFullWhereImplicit) {
  std::uint64_t hash[2];
  for (std::uint64_t& h : hash) {
    World world = worldOf(tube(SurfaceMode::contact, true), {0, -9.81, 0});
    for (int k = 0; k < 10; ++k) world.advance(holding(world, kNode, {0, 0.004, 0}));
    for (int k = 0; k < 30; ++k) world.advance({});
    h = world.stateHash();
  }
  EXPECT_EQ(hash[0], hash[1]);
  WorldSettings s;
  s.integrator = Integrator::implicit;
  World contact(s, {tube(SurfaceMode::contact, true)}), full(s, {tube(SurfaceMode::full, true)});
  for (int k = 0; k < 5; ++k) {
    contact.advance({});
    full.advance({});
  }
  EXPECT_EQ(contact.dynamicNodes(0), full.dynamicNodes(0));
  EXPECT_EQ(contact.energies().elastic, full.energies().elastic);
}

}  // namespace medulla
