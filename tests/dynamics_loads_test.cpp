#include <gtest/gtest.h>

#include "physics/dynamics/node_motion.h"
#include "physics/dynamics/stages.h"
#include "tests/complaint.h"
#include "tests/contact_bodies.h"
#include "tests/dynamics_states.h"
#include "tests/identified_model.h"
#include "tests/synthetic_model.h"

// Tools on the surface: what they give the body is what they report.
namespace medulla {

using namespace states;

static World tubeWorld(SurfaceMode surface, bool fixed, double damping = 0.1,
                       Integrator integrator = Integrator::explicitEuler) {
  BodyDescription b = synthetic::body(synthetic::shortTube(), 6e3);
  b.surface = surface;
  b.tissue.damping = damping;
  if (fixed) b.fixed = {{0, FixedFreedom::all}, {4, FixedFreedom::all}};
  WorldSettings settings;
  settings.gravity.setZero();
  settings.integrator = integrator;
  return World(settings, {b});
}

static Vector3d restNode(const World& world, int node) {
  return world.bodies()[0].model->restNodes[node];
}

static ToolSpring pushAt(const World& world, int triangle, double depth) {
  const auto& t = world.bodies()[0].model->triangles[triangle];
  ToolSpring s;
  s.nodes = t;
  s.weights = {0.5, 0.3, 0.2};
  const Vector3d a = restNode(world, t[0]), b = restNode(world, t[1]), c = restNode(world, t[2]);
  s.outward = (b - a).cross(c - a).normalized();
  s.anchor = 0.5 * a + 0.3 * b + 0.2 * c - depth * s.outward;
  s.stiffness = 400;
  s.damping = 1;
  return s;
}

TEST(Loads, NodesGainExactlyWhatTheToolsGive) {
  for (SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
    World world = tubeWorld(surface, false);
    Loads loads;
    loads.toolSprings = {pushAt(world, 30, 0.003), pushAt(world, 31, 0.002)};  // sharing nodes
    loads.toolSprings[1].tool = 1;
    for (int node : {40, 41, 42}) {
      HeldNode held;
      held.tool = 2;
      held.node = node;
      held.anchor = restNode(world, node) + Vector3d(0.001, 0.002, -0.001);
      held.anchorVelocity = {0.1, 0, 0};
      held.stiffness = 300;
      held.damping = 0.5;
      loads.heldNodes.push_back(held);
    }
    for (int frame = 0; frame < 10; ++frame) {
      const Momentum before = momentum(world.data());
      const std::vector<Vector3d> impulse = world.advance(loads);
      const Momentum after = momentum(world.data());
      ASSERT_EQ(impulse.size(), 3u);
      const Vector3d given = impulse[0] + impulse[1] + impulse[2];
      EXPECT_GT(given.norm(), 0);
      EXPECT_LT((after.linear - before.linear - given).norm(), 1e-12 * (after.linearScale + given.norm()));
    }
  }
}

// A load on half a dozen nodes that share no symmetry: it turns the body.
static std::vector<DeadLoad> someDeadLoads(const SoftBodyModel& model, const Vector3d& force) {
  DeadLoad whole;
  whole.force = force;
  whole.to = 0;
  return spreadLoad(model, {3, 17, 40, 41, 42, 60}, whole);
}

TEST(DeadLoads, ALoadIsSpreadByArea) {
  const World world = tubeWorld(SurfaceMode::full, false);
  const SoftBodyModel& model = *world.bodies()[0].model;
  const Vector3d force(1, -2, 3);
  const std::vector<DeadLoad> loads = someDeadLoads(model, force);
  ASSERT_EQ(loads.size(), 6u);
  Vector3d sum = Vector3d::Zero();
  for (const DeadLoad& load : loads) {
    sum += load.force;
    EXPECT_LT((load.force / model.attachments[load.node].area - loads[0].force / model.attachments[loads[0].node].area)
                  .norm(),
              1e-9 * loads[0].force.norm() / model.attachments[loads[0].node].area);
  }
  EXPECT_LT((sum - force).norm(), 1e-14 * force.norm());
}

static World loadedWorld(SurfaceMode surface, double from, double to, int substeps) {
  BodyDescription b = synthetic::body(synthetic::shortTube(), 6e3);
  b.surface = surface;
  b.deadLoads = someDeadLoads(*b.model, {0.01, -0.02, 0.005});
  for (DeadLoad& load : b.deadLoads) {
    load.from = from;
    load.to = to;
  }
  WorldSettings settings;
  settings.gravity.setZero();
  settings.substeps = substeps;
  settings.frameDuration = substeps == 1 ? 1e-4 : settings.frameDuration;
  return World(settings, {b});
}

TEST(DeadLoads, AFreeBodyGainsTheirForceAndMomentInOneSubstep) {
  for (SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
    World world = loadedWorld(surface, 0, 0, 1);
    Vector3d force = Vector3d::Zero(), moment = force;
    for (const DeadLoad& load : world.bodies()[0].deadLoads) {
      force += load.force;
      moment += restNode(world, load.node).cross(load.force);
    }
    world.advance({});
    const double h = world.substep();
    const Momentum gained = momentum(world.data());
    EXPECT_LT((gained.linear - h * force).norm(), 1e-12 * h * force.norm());
    EXPECT_LT((gained.angular - h * moment).norm(), 1e-9 * h * moment.norm());
    EXPECT_GT(moment.norm(), 1e-5);
  }
}

// Switched on and off at once, within steps too.
TEST(DeadLoads, APulseGivesItsImpulse) {
  struct Case {
    Integrator integrator;
    int order;
  };
  for (const auto& [integrator, order] :
       {Case{Integrator::explicitEuler, 1}, Case{Integrator::implicit, 1}, Case{Integrator::implicit, 2}}) {
    for (const SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
      BodyDescription b = synthetic::body(synthetic::shortTube(), 6e3);
      b.surface = surface;
      const Vector3d force(0.01, -0.02, 0.005);
      const double from = 0.0217, to = 0.0537;
      for (DeadLoad load : someDeadLoads(*b.model, force)) {
        load.from = load.to = from;
        b.deadLoads.push_back(load);
        load.from = load.to = to;
        load.force = -load.force;
        b.deadLoads.push_back(load);
      }
      World world({.gravity = {0, 0, 0}, .integrator = integrator, .order = order}, {b});
      for (int frame = 0; frame < 4; ++frame) world.advance({});
      const Vector3d impulse = (to - from) * force;
      EXPECT_LT((momentum(world.data()).linear - impulse).norm(), 1e-6 * impulse.norm());
    }
  }
}

// All of a host's at once are what each of them would be alone, by the transpose of its node's velocity; of a body that
// has moved, on links, spheres and frames.
TEST(DeadLoads, ASkinGivesEachOfThemToItsSpheres) {
  for (const LinkModel links : {LinkModel::springs, LinkModel::beam, LinkModel::identified}) {
    BodyDescription b = synthetic::body(synthetic::shortTube(), 6e3);
    if (links == LinkModel::identified)
      b = synthetic::identifiedBody(synthetic::withNetwork(*b.model, {.held = {0, 1, 2}, .uneven = 0.1}), 6e3);
    b.links = links;
    b.surface = SurfaceMode::skin;
    Random random(5);
    for (std::size_t i = 0; i < b.model->restNodes.size(); i += 3)
      b.deadLoads.push_back({static_cast<int>(i), 0.01 * random.vector(), 0, 0.04});
    b.deadLoads.push_back({3, {0.01, 0.02, 0}, 0, 0});  // a second one on its node
    World world(WorldSettings{}, {b});
    world.advance({});
    WorldData& d = world.data();
    runStage(d, evaluateForces);
    const std::vector<Quad> velocity = d.spheres.velocity, momentum = d.spheres.angularMomentum;
    applyDeadLoads(d, 0.03);
    std::vector<Vector3d> linear(d.spheres.count, Vector3d::Zero()), angular = linear;
    for (const NodeForce& load : d.deadLoads) {
      const HostPoint host = hostPoint(d, load.node);
      for (int k = 0; k < host.count; ++k) {
        linear[host.spheres[k]] += d.substep * shareAt(d, load, 0.03, d.substep) * host.force[k] * load.force;
        angular[host.spheres[k]] += d.substep * shareAt(d, load, 0.03, d.substep) * host.torque[k] * load.force;
      }
    }
    for (int i = 0; i < d.spheres.count; ++i) {
      const Vector3d gained = vectorOf(d.spheres.velocity[i]) - vectorOf(velocity[i]);
      EXPECT_LT((gained - d.spheres.groups[i / 4].inverseMass[i % 4] * linear[i]).norm(), 1e-9 * gained.norm());
      const Vector3d turned = vectorOf(d.spheres.angularMomentum[i]) - vectorOf(momentum[i]);
      EXPECT_LT((turned - angular[i]).norm(), 1e-9 * angular[i].norm());
    }
  }
}

TEST(DeadLoads, ThoseOfOneCourseInTimeOnANodeAreOne) {
  BodyDescription b = synthetic::body(synthetic::shortTube(), 6e3);
  const std::vector<DeadLoad> loads = someDeadLoads(*b.model, {0.01, -0.02, 0.005});
  for (int k = 0; k < 100; ++k) b.deadLoads.insert(b.deadLoads.end(), loads.begin(), loads.end());
  for (DeadLoad later : loads) {
    later.to = 0.04;
    b.deadLoads.push_back(later);
  }
  World world(WorldSettings{}, {b, b});
  const std::vector<NodeForce>& laid = world.data().deadLoads;
  ASSERT_EQ(laid.size(), 4 * loads.size());  // of two bodies, at once and growing
  for (std::size_t k = 0; k < laid.size(); ++k) {
    const std::size_t load = k % loads.size();
    const bool grows = k / loads.size() % 2 == 1;
    EXPECT_EQ(laid[k].to, grows ? 0.04 : 0);
    EXPECT_LT((laid[k].force - (grows ? 1 : 100) * loads[load].force).norm(), 1e-13 * laid[k].force.norm());
  }
}

TEST(DeadLoads, TheyGrowLinearlyAndKeepTheirDirectionWhateverTheBodyDoes) {
  for (SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
    World world = loadedWorld(surface, 0.1, 0.3, 50);
    Vector3d force = Vector3d::Zero();
    for (const DeadLoad& load : world.bodies()[0].deadLoads) force += load.force;
    double impulse = 0;  // of a force of 1 N, summed over the substeps' ends
    for (int frame = 0; frame < 40; ++frame) {
      for (int k = 1; k <= 50; ++k)
        impulse += world.substep() * std::clamp((world.time() + k * world.substep() - 0.1) / 0.2, 0.0, 1.0);
      world.advance({});
    }
    EXPECT_NEAR(impulse, 0.6, 1e-3);  // 0.8 s less half of the growth
    const Momentum gained = momentum(world.data());
    EXPECT_LT((gained.linear - impulse * force).norm(), 1e-10 * gained.linearScale);
    const Quaterniond turned = orientation(world.data(), 0);
    EXPECT_GT(turned.angularDistance(Quaterniond::Identity()), 0.5);
  }
}

TEST(DeadLoads, BadOnesAreRefusedByName) {
  const auto refusal = [](const DeadLoad& load) {
    BodyDescription b = synthetic::body(synthetic::shortTube(), 6e3);
    b.deadLoads = {load};
    return complaintOf([&] { World({}, {b}); });
  };
  DeadLoad load;
  EXPECT_EQ(refusal(load), "");
  load.node = 82;
  EXPECT_EQ(refusal(load), "body 'tube' cannot be simulated: it loads node 82: expected 0 to 81");
  load.node = 0;
  load.force.x() = std::nan("");
  EXPECT_EQ(refusal(load), "body 'tube' cannot be simulated: the load on its node 0 is not finite");
  load.force.setZero();
  load.from = 2;
  EXPECT_EQ(refusal(load),
            "body 'tube' cannot be simulated: the load on its node 0 grows from 2 s to 1 s: expected the earlier time "
            "first");
}

TEST(Loads, AtRestTheForceIsStiffnessTimesDistance) {
  for (SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
    World world = tubeWorld(surface, true, 1);
    Loads loads;
    loads.toolSprings = {pushAt(world, 80, 0.003)};
    std::vector<Vector3d> impulse;
    for (int i = 0; i < 400; ++i) impulse = world.advance(loads);
    DynamicsFrame frame;
    world.readFrame(frame);
    Vector3d x = Vector3d::Zero();
    const ToolSpring& s = loads.toolSprings[0];
    for (int k = 0; k < 3; ++k) x += s.weights[k] * frame.bodies[0].nodes[s.nodes[k]];
    const Vector3d expected = s.stiffness * (s.anchor - x) * world.data().settings.frameDuration;
    EXPECT_GT(expected.norm(), 1e-4);
    EXPECT_LT((impulse[0] - expected).norm(), 1e-3 * expected.norm());
  }
}

// Of a surface that moves away at the anchor's velocity and the drift the damper takes nothing.
TEST(Loads, ADamperIsSlackAtItsDriftAgainstTheAnchor) {
  for (const Integrator integrator : {Integrator::explicitEuler, Integrator::implicit})
    for (const SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
      WorldSettings settings = weightless();
      settings.integrator = integrator;
      BodyDescription b = synthetic::body(synthetic::shortTube(), 6e3);
      b.surface = surface;
      const auto impulseWith = [&](double share) {
        World world(settings, {b});
        ToolSpring s = pushAt(world, 30, 0);
        const Vector3d away = 0.1 * s.outward;
        synthetic::throwBody(world, 0, away);
        s.stiffness = 0;
        s.damping = 20;
        s.drift = share * away;
        Loads loads;
        loads.toolSprings = {s};
        return world.advance(loads)[0].norm();
      };
      EXPECT_LT(impulseWith(1), 1e-9);
      EXPECT_GT(impulseWith(0), 1e-3);
    }
}

// What lies on a floor is stopped by it after the loads, which must not yield to the velocity that the floor takes
// away.
TEST(Loads, AtRestOnAFloorTheForceIsStiffnessTimesDistance) {
  for (const double damping : {0.0, 1.0, 20.0}) {
    BodyDescription b = synthetic::body(synthetic::shortTube(), 6e3);
    b.surface = SurfaceMode::skin;
    b.tissue.damping = 1;
    StaticShape floor;
    const FillingSphere& middle = b.model->spheres[2];
    floor.worldFromShape.translation() = middle.restBallCentre;
    floor.worldFromShape.translation().y() -= middle.radius;
    WorldSettings settings;
    settings.gravity.setZero();
    settings.contact = ContactMode::balls;
    World world(settings, {b}, {floor});
    const auto heightOf = [&](int t) {
      double sum = 0;
      for (const int node : b.model->triangles[t]) sum += b.model->restNodes[node].y() / 3;
      return sum - 0.2 * std::abs(b.model->restNodes[b.model->triangles[t][0]].x() - middle.restBallCentre.x());
    };
    int top = 0;
    for (int t = 1; t < int(b.model->triangles.size()); ++t)
      if (heightOf(t) > heightOf(top)) top = t;
    Loads loads;
    loads.toolSprings = {pushAt(world, top, 0.002)};
    ToolSpring& s = loads.toolSprings[0];
    s.outward = Vector3d::UnitY();
    s.damping = damping;
    std::vector<Vector3d> impulse;
    for (int i = 0; i < 300; ++i) impulse = world.advance(loads);
    DynamicsFrame frame;
    world.readFrame(frame);
    double y = 0;
    for (int k = 0; k < 3; ++k) y += s.weights[k] * frame.bodies[0].nodes[s.nodes[k]].y();
    const double expected = s.stiffness * (s.anchor.y() - y) * settings.frameDuration;
    EXPECT_LT(expected, -1e-3) << damping;
    EXPECT_NEAR(impulse[0].y() / expected, 1, 1e-3) << damping;
  }
}

TEST(Loads, APushingSpringNeverPulls) {
  World world = tubeWorld(SurfaceMode::full, true);
  Loads loads;
  loads.toolSprings = {pushAt(world, 80, -0.003)};  // anchor outside
  for (int i = 0; i < 5; ++i) EXPECT_LE(world.advance(loads)[0].dot(loads.toolSprings[0].outward), 1e-15);
}

// A slipping contact is dragged by what friction carries, whichever way and however fast the tool goes.
TEST(Loads, ASlidingSpringDragsByFrictionAlone) {
  for (const Integrator integrator : {Integrator::explicitEuler, Integrator::implicit}) {
    for (const SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
      World world = tubeWorld(surface, true, 1, integrator);
      Loads loads;
      loads.toolSprings = {pushAt(world, 80, 0.003)};
      ToolSpring& s = loads.toolSprings[0];
      s.slides = true;
      s.friction = 0.3;
      const Vector3d along = s.outward.unitOrthogonal();
      const double push = [&] {
        std::vector<Vector3d> impulse;
        for (int i = 0; i < 100; ++i) impulse = world.advance(loads);
        const double normal = -impulse[0].dot(s.outward);
        return normal;
      }();
      for (const double speed : {0.05, -0.5, -2e-4}) {
        s.anchorVelocity = speed * along;
        std::vector<Vector3d> impulse;
        for (int i = 0; i < 100; ++i) impulse = world.advance(loads);
        const double normal = -impulse[0].dot(s.outward), drag = impulse[0].dot(along);
        EXPECT_NEAR(normal, push, 0.2 * push);
        EXPECT_NEAR(drag, (speed > 0 ? 0.3 : -0.3) * normal, 1e-3 * normal) << speed;
      }
    }
  }
}

// Where the push on late tissue is less than it seemed, so is what sticks.
TEST(Loads, ASpringThatSticksHoldsWithinFriction) {
  for (const Integrator integrator : {Integrator::explicitEuler, Integrator::implicit}) {
    for (const double friction : {0.3, 100.0}) {
      World world = tubeWorld(SurfaceMode::full, true, 1, integrator);
      Loads loads;
      loads.toolSprings = {pushAt(world, 80, 0.003)};
      ToolSpring& s = loads.toolSprings[0];
      const Vector3d along = s.outward.unitOrthogonal();
      s.friction = friction;
      s.anchor += 0.004 * along;
      std::vector<Vector3d> impulse;
      for (int i = 0; i < 200; ++i) impulse = world.advance(loads);
      const double normal = -impulse[0].dot(s.outward), drag = impulse[0].dot(along);
      EXPECT_GT(normal, 0);
      if (friction < 1)
        EXPECT_NEAR(drag, friction * normal, 1e-3 * normal);
      else
        EXPECT_GT(drag, 0.5 * normal);
    }
  }
}

TEST(Loads, TheAnchorMovesWithinTheFrame) {
  // A stiff held node follows a moving anchor; with the anchor frozen at the frame's end it would be there from the
  // start.
  World world = tubeWorld(SurfaceMode::full, true, 1);
  Loads loads;
  HeldNode held;
  held.node = 45;
  held.stiffness = 2000;
  held.damping = 2;
  const Vector3d velocity(0, 0.05, 0), start = restNode(world, held.node);
  held.anchorVelocity = velocity;
  DynamicsFrame frame;
  for (int i = 1; i <= 10; ++i) {
    held.anchor = start + velocity * (i * world.data().settings.frameDuration);
    loads.heldNodes = {held};
    world.advance(loads);
    world.readFrame(frame);
    EXPECT_LT((frame.bodies[0].nodes[held.node] - held.anchor).norm(), 2e-4) << "frame " << i;
  }
  EXPECT_NEAR(vectorAt(world.data().nodes.velocity, world.data().ranges[0].node[held.node]).y(), 0.05, 0.005);
}

// However far the anchor is and whichever way the tissue moves within the frame.
TEST(Loads, ALimitedLoadGivesItsLimitAndNoMore) {
  constexpr double most = 0.05;  // N
  for (const Integrator integrator : {Integrator::explicitEuler, Integrator::implicit}) {
    for (const bool holds : {false, true}) {
      World world = tubeWorld(SurfaceMode::full, true, 0.3, integrator);
      Loads loads;
      ToolSpring push = pushAt(world, 80, 0.1);  // 40 N without a limit
      push.forceMax = most;
      push.friction = 0.3;
      push.slides = true;
      HeldNode held;
      held.node = push.nodes[0];
      held.anchor = restNode(world, held.node) + Vector3d(0, 0.1, 0.1);
      held.stiffness = 400;
      held.damping = 1;
      held.forceMax = most;
      if (holds)
        loads.heldNodes = {held};
      else
        loads.toolSprings = {push};
      double last = 0;
      for (int i = 0; i < 50; ++i) {
        last = world.advance(loads)[0].norm() / world.data().settings.frameDuration;
        EXPECT_LE(last, most * (1 + 1e-9));
      }
      EXPECT_NEAR(last, most, 1e-6 * most);
    }
  }
}

TEST(Loads, AStiffToolDoesNotBoundTheStep) {
  World world = tubeWorld(SurfaceMode::full, true);
  Loads loads;
  loads.toolSprings = {pushAt(world, 80, 0.002)};
  loads.toolSprings[0].stiffness = 1e5;
  loads.toolSprings[0].damping = 100;
  for (int i = 0; i < 50; ++i) world.advance(loads);
  DynamicsFrame frame;
  world.readFrame(frame);
  Vector3d x = Vector3d::Zero();
  for (int k = 0; k < 3; ++k)
    x += loads.toolSprings[0].weights[k] * frame.bodies[0].nodes[loads.toolSprings[0].nodes[k]];
  EXPECT_LT((x - loads.toolSprings[0].anchor).norm(), 1e-4);
}

}  // namespace medulla
