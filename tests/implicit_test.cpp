#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/dynamics/implicit_stages.h"
#include "tests/contact_bodies.h"
#include "tests/dynamics_states.h"
#include "tests/identified_model.h"

// The implicit step: its matrix, its order, what it keeps and what it may only lose, loads and contact inside.
namespace medulla {

using namespace states;

static WorldSettings implicitly(double step, int order = 1, const Vector3d& gravity = Vector3d::Zero()) {
  WorldSettings s;
  s.integrator = Integrator::implicit;
  s.order = order;
  s.gravity = gravity;
  s.frameDuration = step;
  s.substeps = 1;
  return s;
}

static BodyDescription tube(SurfaceMode surface, bool held, double damping = 0.1, LinkModel links = LinkModel::beam) {
  BodyDescription b = synthetic::body(synthetic::shortTube(), 6e3);
  std::vector<int> heldNodes;
  if (held)
    for (int i = 0; i < 11; ++i) heldNodes.push_back(i);
  if (links == LinkModel::identified) {
    b = synthetic::identifiedBody(synthetic::withNetwork(*b.model, {.held = heldNodes, .uneven = 0.1}), 6e3);
  } else if (held) {
    b.fixed = {{0, FixedFreedom::all}};
    b.fixedNodes = heldNodes;
  }
  b.surface = surface;
  b.tissue.damping = damping;
  return b;
}

struct ImplicitLinks : testing::TestWithParam<LinkModel> {};
INSTANTIATE_TEST_SUITE_P(All, ImplicitLinks, testing::Values(LinkModel::beam, LinkModel::identified),
                         [](const auto& links) { return links.param == LinkModel::beam ? "beam" : "identified"; });

static double energyOf(const World& world) {
  const Energies e = world.energies();
  return e.kinetic + e.elastic + e.gravity;
}

static void run(World& world, double duration, const Loads& loads = {}) {
  while (world.time() < duration - 1e-9) world.advance(loads);
}

static double farthest(const World& a, const World& b) {
  double out = 0;
  DynamicsFrame fa, fb;
  a.readFrame(fa);
  b.readFrame(fb);
  for (std::size_t k = 0; k < fa.bodies.size(); ++k)
    for (std::size_t i = 0; i < fa.bodies[k].nodes.size(); ++i)
      out = std::max(out, (fa.bodies[k].nodes[i] - fb.bodies[k].nodes[i]).norm());
  return out;
}

// Spheres moved along x from where they are, and forces there.
static void stretch(World& world, double factor) {
  WorldData& d = world.data();
  for (int i = 0; i < d.spheres.count; ++i) d.spheres.position[i].v[0] *= factor;
  runStage(d, evaluateForces);
}

// M + T^2 K + T C against differences of the forces themselves, of a tube along x whose links are all drawn or pressed.
static void expectDerivative(const BodyDescription& body, double stretched) {
  const double duration = 0.01, tiny = 1e-6;
  World world(implicitly(duration), {body});
  world.advance({});  // lays everything out; nothing moves
  WorldData& d = world.data();
  ImplicitData& s = *d.implicit.at(0);
  stretch(world, stretched);
  EXPECT_TRUE(assembleSystem(d, s, false));
  Random random(3);
  Motion x(s.freedom.size()), y(s.freedom.size());
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = quadOf(random.vector());
  hold(s.freedom, x);
  applySystem(d, s, x, y);
  // Forces after `tiny` of a step at the motion x, with damping at that motion.
  World moved(implicitly(duration), {body});
  stretch(moved, stretched);
  WorldData& m = moved.data();
  for (int i = 0; i < m.spheres.count; ++i) {
    m.spheres.position[i] = quadOf(vectorOf(m.spheres.position[i]) + tiny * duration * vectorOf(x[2 * i]));
    turnBy(m, i, tiny * duration * vectorOf(x[2 * i + 1]));
    m.spheres.velocity[i] = quadOf(tiny * vectorOf(x[2 * i]));
    m.spheres.angularVelocity[i] = quadOf(tiny * vectorOf(x[2 * i + 1]));
  }
  for (int i = 0; i < m.nodes.dynamicEnd; ++i) {
    const Vector3d v = tiny * vectorOf(x[2 * m.spheres.count + i]);
    setVector(m.nodes.position, i, vectorAt(m.nodes.position, i) + duration * v);
    setVector(m.nodes.velocity, i, v);
  }
  runStage(m, evaluateForces);
  double largest = 0, error = 0;
  const auto compare = [&](std::size_t quad, const Vector3d& inertial, const Vector3d& gained) {
    const Vector3d expected = vectorOf(s.freedom[quad]).cwiseProduct(inertial - duration / tiny * gained);
    largest = std::max(largest, expected.norm());
    error = std::max(error, (vectorOf(y[quad]) - expected).norm());
  };
  for (int i = 0; i < m.spheres.count; ++i) {
    compare(2 * i, sphereMass(m, i) * vectorOf(x[2 * i]), vectorOf(m.spheres.force[i]) - vectorOf(d.spheres.force[i]));
    compare(2 * i + 1, inertia(d, i) * vectorOf(x[2 * i + 1]),
            vectorOf(m.spheres.torque[i]) - vectorOf(d.spheres.torque[i]));
  }
  for (int i = 0; i < m.nodes.dynamicEnd; ++i) {
    const std::size_t quad = 2 * m.spheres.count + i;
    compare(quad, m.nodes.mass[i] * vectorOf(x[quad]), vectorAt(m.nodes.force, i) - vectorAt(d.nodes.force, i));
  }
  EXPECT_LT(error, 1e-5 * largest) << stretched;
}

TEST_P(ImplicitLinks, TheMatrixIsTheForcesDerivativeAtRest) {
  for (const SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin})
    expectDerivative(tube(surface, true, 0.1, GetParam()), 1);
}

// Tension and pressure across the line, the law of elongation and the damper, which goes by the stiffness at rest.
TEST(Implicit, TheMatrixIsTheForcesDerivativeAlongTheLine) {
  for (const double stretched : {0.9, 1.2}) expectDerivative(tube(SurfaceMode::skin, true), stretched);
}

// An identified tube whose attachments are a hundred times as stiff along the normals as across.
static BodyDescription tubeStiffAlongNormals(double damping) {
  BodyDescription b = tube(SurfaceMode::full, true, damping, LinkModel::identified);
  auto model = std::make_shared<SoftBodyModel>(*b.model);
  auto network = std::make_shared<IdentifiedNetwork>(*model->identified);
  network->layer.normal = 100 * network->layer.tangential;
  model->identified = network;
  b.model = model;
  return b;
}

// Preconditioned by what nodes are held with along their normals, too, whatever damping makes of it.
TEST(Implicit, NormalsStifferThanAllElseCostFewIterations) {
  for (const double damping : {0.1, 1.0, 3.0}) {
    WorldSettings settings = implicitly(0.005, 1, {0, -9.81, 0});
    World world(settings, {tubeStiffAlongNormals(damping)});
    run(world, 0.5);
    const ImplicitData& s = *world.data().implicit.at(0);
    EXPECT_GE(s.solves, 100);
    EXPECT_LE(static_cast<double>(s.iterations), 10 * static_cast<double>(s.solves)) << damping;
  }
}

// What spheres feel of the masses that hang on frames, pairs of frames included: as much as these have, carried along.
TEST(Implicit, MassesOnFramesAreThoseOfTheCarriedNodes) {
  World world(implicitly(0.005), {tubeStiffAlongNormals(0.3)});
  world.advance({});  // lays everything out; nothing moves
  WorldData& d = world.data();
  ImplicitData& s = *d.implicit.at(0);
  runStage(d, evaluateForces);
  s.lumped.assign(s.lumped.size(), Block6::Zero());
  s.lumpedBeside.assign(s.lumpedBeside.size(), Block6::Zero());
  addMassOnFrames(d, s);
  Random random(3);
  Motion x(s.freedom.size());
  for (Quad& q : x) q = quadOf(random.vector());
  carryMotion(d, x, s.carried);
  double ofNodes = 0, ofBlocks = 0;
  for (int i = 0; i < d.nodes.dynamicEnd; ++i) {
    const Vector3d v = vectorOf(s.carried[i]);
    const double along = v.dot(vectorAt(d.nodes.area, i));
    ofNodes += s.carriedMass[i] * v.squaredNorm() + s.carriedNormal[i] * along * along;
  }
  const auto motionOf = [&](int i) {
    Vector6 both;
    both.head<3>() = vectorOf(x[2 * i]);
    both.tail<3>() = vectorOf(x[2 * i + 1]);
    return both;
  };
  for (int i = 0; i < d.spheres.count; ++i) ofBlocks += motionOf(i).dot(s.lumped[i] * motionOf(i));
  for (std::size_t k = 0; k < s.pairs.size(); ++k) {
    const auto [i, j] = s.pairs[k];
    if (j >= 0) ofBlocks += 2 * motionOf(i).dot(s.lumpedBeside[k] * motionOf(j));
  }
  EXPECT_NEAR(ofBlocks, ofNodes, 1e-6 * ofNodes);
  EXPECT_GT(s.lumpedBeside.back().norm(), 0);
}

TEST_P(ImplicitLinks, RestsWhereTheExplicitStepRests) {
  for (const SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
    BodyDescription body = tube(surface, true, 1, GetParam());
    if (GetParam() == LinkModel::identified) body.tissue.young *= 40;  // its patch holds it by a single link
    DeadLoad load;
    load.node = static_cast<int>(body.model->restNodes.size()) - 1;
    load.force = {0.002, 0.004, -0.001};
    load.to = 0.1;
    body.deadLoads = {load};
    WorldSettings explicitly;
    World a(explicitly, {body}), b(implicitly(0.02, 1, explicitly.gravity), {body}),
        c(implicitly(0.02, 2, explicitly.gravity), {body});
    // Torsion, which alpha does not slow, takes longer to die where nothing is held by number.
    for (World* world : {&a, &b, &c}) run(*world, GetParam() == LinkModel::identified ? 24 : 12);
    EXPECT_LT(farthest(a, b), 2e-7);
    EXPECT_LT(farthest(a, c), 2e-7);
  }
}

// A load so small that what it accelerates in a step is of no account adds up all the same.
TEST(Implicit, AMillionthOfALoadBendsAMillionthAsFar) {
  for (const int order : {1, 2}) {
    const auto wayUnder = [order](double share) {
      BodyDescription body = tube(SurfaceMode::full, true, 1);
      DeadLoad load;
      load.node = static_cast<int>(body.model->restNodes.size()) - 1;
      load.force = share * Vector3d(0.002, 0.004, -0.001);
      body.deadLoads = {load};
      World world(implicitly(0.02, order, {0, 0, 0}), {body});
      run(world, 4);
      DynamicsFrame frame;
      world.readFrame(frame);
      return (frame.bodies[0].nodes[load.node] - body.model->restNodes[load.node]).norm() / share;
    };
    const double expected = wayUnder(1e-2);
    EXPECT_GT(expected, 1e-4);
    EXPECT_NEAR(wayUnder(1e-8) / expected, 1, 0.01) << "order " << order;
  }
}

// What holds a body at rest is no load: a thousandth of its rounding kept every step in vain iterations, 300 times as
// long.
TEST_P(ImplicitLinks, AHeldBodyAtRestTakesNoSolve) {
  for (const double young : {1e4, 1e7}) {
    BodyDescription body = tube(SurfaceMode::full, true, 0.1, GetParam());
    body.tissue.young = young;
    // Turned, or nothing is left of its torques: along the axes all sums are exact.
    body.worldFromModel = Eigen::Translation3d(0.1, -0.2, 0.3) * Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized());
    World world(implicitly(0.02, 1, {0, 0, 0}), {body});
    run(world, 1);
    EXPECT_EQ(world.data().implicit[0]->solves, 0) << young;
  }
}

// Free fall deforms nothing: stiffness has no part in it. Backward Euler falls n (n + 1) / 2 steps' ways.
TEST_P(ImplicitLinks, ABodyFallsAsFastHoweverStiff) {
  const double step = 0.005, gravity = 9.81;
  constexpr int kSteps = 40;
  for (const int order : {1, 2}) {
    const double fall = gravity * step * step * 0.5 * kSteps * (order == 1 ? kSteps + 1 : kSteps);
    for (const double young : {1e3, 1e6, 1e9}) {
      BodyDescription body = tube(SurfaceMode::full, false, 0.2, GetParam());
      body.tissue.young = young;
      World world(implicitly(step, order, {0, -gravity, 0}), {body});
      run(world, kSteps * step);
      DynamicsFrame frame;
      world.readFrame(frame);
      for (std::size_t i = 0; i < frame.bodies[0].nodes.size(); ++i) {
        const Vector3d moved = frame.bodies[0].nodes[i] - body.model->restNodes[i];
        EXPECT_LT((moved - Vector3d(0, -fall, 0)).norm(), 1e-4 * fall) << young << ", order " << order;
      }
    }
  }
}

// A body is solved as if it were alone, however light it is beside another.
TEST(Implicit, AnIdleHeavyBodyLeavesALightOneAlone) {
  BodyDescription light = tube(SurfaceMode::full, true, 1), heavy = synthetic::ball("heavy", 0.1, {1, 0, 0});
  heavy.tissue.density = 1e4;
  light.deadLoads = {{static_cast<int>(light.model->restNodes.size()) - 1, {0, 1e-5, 0}, 0, 0.1}};
  for (const int order : {1, 2}) {
    World alone(implicitly(0.02, order), {light}), beside(implicitly(0.02, order), {light, heavy});
    for (World* world : {&alone, &beside}) run(*world, 3);
    DynamicsFrame a, b;
    alone.readFrame(a);
    beside.readFrame(b);
    double way = 0, apart = 0;
    for (std::size_t i = 0; i < a.bodies[0].nodes.size(); ++i) {
      way = std::max(way, (a.bodies[0].nodes[i] - light.model->restNodes[i]).norm());
      apart = std::max(apart, (a.bodies[0].nodes[i] - b.bodies[0].nodes[i]).norm());
    }
    EXPECT_GT(way, 1e-6);
    EXPECT_LT(apart, 1e-3 * way) << "order " << order;
  }
}

// A bending tube, let go: errors against a far finer run shrink as the step and as its square. It falls fast enough for
// these to be far above what the iteration leaves, 1e-5 m/s2 or a tenth of a micrometre by then.
TEST_P(ImplicitLinks, ConvergesWithItsOrder) {
  const auto end = [](double step, int order) {
    auto world = std::make_unique<World>(implicitly(step, order, {0, -8, 2}),
                                         std::vector{tube(SurfaceMode::full, true, 0.3, GetParam())});
    run(*world, 0.16);
    return world;
  };
  const auto finest = end(0.16 / 4096, 2);
  for (const int order : {1, 2}) {
    const double coarse = farthest(*end(0.16 / 64, order), *finest), fine = farthest(*end(0.16 / 128, order), *finest);
    EXPECT_NEAR(std::log2(coarse / fine), order, 0.15) << coarse << " " << fine;
  }
}

TEST_P(ImplicitLinks, EnergyNeverGrowsInOrderOne) {
  for (const double damping : {0.0, 0.2}) {
    for (const double step : {0.001, 0.01, 0.05}) {
      World world(implicitly(step), {tube(SurfaceMode::full, false, damping, GetParam())});
      shake(world.data(), 3, 1.5, 0.01, 1);
      double before = energyOf(world);
      const double start = before;
      for (int i = 0; i < 60; ++i) {
        world.advance({});
        const double now = energyOf(world);
        EXPECT_LE(now, before + 1e-12 * start) << step << " s, step " << i;
        before = now;
      }
    }
  }
}

TEST_P(ImplicitLinks, OrderTwoStaysBounded) {
  for (const double step : {0.001, 0.01, 0.05}) {
    World world(implicitly(step, 2), {tube(SurfaceMode::full, true, 0, GetParam())});
    shake(world.data(), 3, 1, 0.01, 1);
    // What is held does not move.
    world.data().spheres.velocity[0] = world.data().spheres.angularMomentum[0] = {};
    refreshAngularVelocities(world.data());
    for (int i = 0; i < 11; ++i)
      setVector(world.data().nodes.velocity, world.data().ranges[0].node[i], Vector3d::Zero());
    const double start = energyOf(world);
    for (int i = 0; i < 100; ++i) {
      world.advance({});
      EXPECT_LT(energyOf(world), 1.5 * start) << step << " s, step " << i;
    }
  }
}

TEST_P(ImplicitLinks, AFreeBodyKeepsItsMomentum) {
  World world(implicitly(0.005), {tube(SurfaceMode::full, false, 0.1, GetParam())});
  shake(world.data(), 5, 0.2, 0.001, 0.2);
  const Momentum before = momentum(world.data());
  run(world, 1);
  const Momentum after = momentum(world.data());
  EXPECT_LT((after.linear - before.linear).norm(), 1e-5 * before.linearScale);
  EXPECT_LT((after.angular - before.angular).norm(), 1e-3 * before.angularScale);
}

static void spin(World& world, const Vector3d& velocity, const Vector3d& spin) {
  WorldData& d = world.data();
  for (int i = 0; i < d.spheres.count; ++i) {
    d.spheres.velocity[i] = quadOf(velocity + spin.cross(vectorOf(d.spheres.position[i])));
    d.spheres.angularMomentum[i] = quadOf(inertia(d, i) * spin);
  }
  refreshAngularVelocities(d);
  for (int i = 0; i < d.nodes.dynamicEnd; ++i)
    setVector(d.nodes.velocity, i, velocity + spin.cross(vectorAt(d.nodes.position, i)));
}

// What tangents of a turning body and Newton's last residual lose is given back: stiff tissue spins on as a rigid body.
// By a twentieth of a radian in a step and by a quarter. Each node on its own tangent a stiff body lies far from its
// shape then, and a thousandth of that residual is more than all that acts on it.
TEST(Implicit, StiffTissueSpinsOn) {
  for (const int order : {1, 2}) {
    for (const double speed : {1.0, 5.0}) {
      BodyDescription body = tube(SurfaceMode::full, false);
      body.tissue.young = 1e7;
      World world(implicitly(0.005, order), {body});
      spin(world, {0.1, 0, 0}, speed * Vector3d(3, 8, 5));
      const Momentum before = momentum(world.data());
      run(world, 1);
      const Momentum after = momentum(world.data());
      EXPECT_LT((after.linear - before.linear).norm(), 5e-3 * before.linear.norm()) << order << ", " << speed;
      EXPECT_LT((after.angular - before.angular).norm(), 0.01 * before.angular.norm()) << order << ", " << speed;
    }
  }
}

TEST(Implicit, ATurnedAndMovedWorldIsTheSameWorld) {
  const auto node = [](const Eigen::Isometry3d& place) {
    BodyDescription body = tube(SurfaceMode::full, true);
    body.worldFromModel = place;
    World world(implicitly(0.01, 1, place.linear() * Vector3d(0, -9.81, 0)), {body});
    run(world, 0.3);
    DynamicsFrame frame;
    world.readFrame(frame);
    return Vector3d(place.inverse() * frame.bodies[0].nodes.back());
  };
  Eigen::Isometry3d place(Eigen::AngleAxisd(0.8, Vector3d(1, -2, 0.5).normalized()));
  place.translation() = Vector3d(0.3, 0.1, -0.2);
  EXPECT_LT((node(place) - node(Eigen::Isometry3d::Identity())).norm(), 1e-6);
}

// By contact a step may be long while no ball outruns what is looked at: where nothing stands still, but for how fast
// all travel together.
TEST(Implicit, WhereThereIsNothingToTouchASpeedCostsNothing) {
  const auto node = [](ContactMode contact) {
    WorldSettings settings = implicitly(0.01, 1, {0, 0, 0});
    settings.contact = contact;
    World world(settings, {tube(SurfaceMode::full, false)});
    spin(world, {0, 8, -6}, {3, 8, 5});
    run(world, 0.2);
    DynamicsFrame frame;
    world.readFrame(frame);
    return frame.bodies[0].nodes.back();
  };
  EXPECT_LT((node(ContactMode::balls) - node(ContactMode::none)).norm(), 1e-12);
}

TEST(Implicit, AToolFeelsWhatTheBodyGets) {
  for (const int order : {1, 2}) {
    for (const SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
      World world(implicitly(0.01, order), {tube(surface, false)});
      Loads loads;
      HeldNode held;
      held.node = 40;
      held.anchor = world.bodies()[0].model->restNodes[40] + Vector3d(0.001, 0.003, -0.002);
      held.stiffness = 300;
      held.damping = 1;
      loads.heldNodes = {held};
      const Momentum before = momentum(world.data());
      const Vector3d given = world.advance(loads).at(0);
      const Momentum after = momentum(world.data());
      EXPECT_GT(given.norm(), 0);
      EXPECT_LT((after.linear - before.linear - given).norm(), 5e-3 * given.norm()) << "order " << order;
    }
  }
}

// It sinks in as half a period per step says, or by its weight over ten times E r where that is stiffer.
TEST(Implicit, ABallRestsOnAPlane) {
  StaticShape floor;
  floor.friction = 0.5;
  WorldSettings settings = implicitly(0.005, 1, {0, -9.81, 0});
  settings.contact = ContactMode::balls;
  for (const double young : {1e2, 2e4}) {
    BodyDescription ball = synthetic::ball("ball", 0.01, {0, 0.012, 0}, 0.5);
    ball.tissue.young = young;
    World world(settings, {ball}, {floor});
    run(world, 1);
    const double omega = std::numbers::pi / 0.005, mass = world.data().spheres.groups[0].mass[0];
    const double depth = 9.81 * mass / std::max(mass * omega * omega, 10 * young * 0.01);
    EXPECT_NEAR(world.data().spheres.position[0].v[1], 0.01 - depth, 0.01 * depth) << young;
  }
}

TEST(Implicit, FrictionHoldsOnASlopeAndSlidesOnASteeperOne) {
  for (const double slope : {0.2, 0.5}) {
    StaticShape floor;
    floor.friction = 0.3;
    WorldSettings settings = implicitly(0.005, 1, 9.81 * Vector3d(std::sin(slope), -std::cos(slope), 0));
    settings.contact = ContactMode::balls;
    // Three balls in a triangle, linked: they do not roll.
    const auto model = synthetic::ballModel({{{0, 0, 0}, 0.01}, {{0.05, 0, 0}, 0.01}, {{0.025, 0, 0.04}, 0.01}},
                                            {{0, 1}, {1, 2}, {2, 0}});
    BodyDescription body = synthetic::ballBody("tripod", model, {0, 0.01, 0}, 0.3);
    body.tissue.young = 1e6;
    World world(settings, {body}, {floor});
    run(world, 1);
    const double moved = world.data().spheres.position[0].v[0], free = 9.81 * (std::sin(slope) - 0.3 * std::cos(slope));
    if (free < 0) {
      EXPECT_LT(std::abs(moved), 1e-3);
    } else {
      EXPECT_NEAR(moved, 0.5 * free, 0.03 * free);
    }
  }
}

TEST(Implicit, TheSameRunTwiceHasTheSameHash) {
  const auto hash = [] {
    World world(implicitly(0.01, 1, {0, -9.81, 0}), {tube(SurfaceMode::full, true)});
    run(world, 0.3);
    return world.stateHash();
  };
  EXPECT_EQ(hash(), hash());
}

TEST(Implicit, ALedSphereIsOnItsPath) {
  for (const int order : {1, 2}) {
    BodyDescription body = tube(SurfaceMode::skin, false);
    DrivenSphere driven;
    driven.amplitude = 0.01;
    body.driven = {driven};
    WorldSettings explicitly;
    explicitly.gravity.setZero();
    World a(implicitly(0.01, order), {body}), b(explicitly, {body});
    run(a, 0.7);
    run(b, 0.7);
    EXPECT_LT((vectorOf(a.data().spheres.position[0]) - vectorOf(b.data().spheres.position[0])).norm(), 1e-6);
  }
}

}  // namespace medulla
