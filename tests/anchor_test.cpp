#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "physics/dynamics/implicit_stages.h"
#include "physics/dynamics/node_motion.h"
#include "tests/dynamics_states.h"
#include "tests/identified_model.h"

// Where links carry what hangs on them, bent far: rates are the places' differences, loads their transpose. Each of
// these is written more than once (whole surfaces, single nodes, implicit steps), and all must agree.
namespace medulla {

using namespace states;

namespace {

BodyDescription chain(SurfaceMode surface, LinkModel links) {
  BodyDescription body = synthetic::body(synthetic::unevenChain(4, 8), 5e3);
  body.surface = surface;
  body.links = links;
  body.tissue.damping = 0;
  return body;
}

// Nodes on up to three of the chain's frames and of the held patch's, those off the spheres'.
BodyDescription identifiedChain(SurfaceMode surface) {
  const BodyDescription plain = chain(surface, LinkModel::beam);
  BodyDescription body = synthetic::identifiedBody(
      synthetic::withNetwork(*plain.model, {.held = {0, 1, 2, 3, 4}, .uneven = 0.3, .frames = 3}, {0.001, 0.002, 0}),
      5e3);
  body.surface = surface;
  body.tissue.damping = 0;
  return body;
}

// Three links each: the groups of four hold springs and beams side by side.
World chainsOfAllLinks(SurfaceMode surface) {
  WorldSettings settings;
  settings.gravity.setZero();
  return World(settings,
               {chain(surface, LinkModel::springs), chain(surface, LinkModel::beam), identifiedChain(surface)});
}

void moveSpheres(WorldData& d, const Motion& motion, double time) {
  for (int i = 0; i < d.spheres.count; ++i) {
    d.spheres.position[i] = quadOf(vectorOf(d.spheres.position[i]) + time * vectorOf(motion[2 * i]));
    turnBy(d, i, time * vectorOf(motion[2 * i + 1]));
  }
  runStage(d, evaluateLinks);
}

// Of `read(d)`, vectors, along a motion of the spheres.
template <class Read>
std::vector<Vector3d> differences(WorldData& d, const Motion& motion, const Read& read) {
  constexpr double kStep = 1e-7;
  const auto position = d.spheres.position, orientation = d.spheres.orientation;
  std::vector<Vector3d> out[2];
  for (const int side : {0, 1}) {
    d.spheres.position = position;
    d.spheres.orientation = orientation;
    moveSpheres(d, motion, side == 0 ? -kStep : kStep);
    out[side] = read(d);
  }
  d.spheres.position = position;
  d.spheres.orientation = orientation;
  runStage(d, evaluateLinks);
  for (std::size_t i = 0; i < out[0].size(); ++i) out[0][i] = (out[1][i] - out[0][i]) / (2 * kStep);
  return out[0];
}

Motion motionOfSpheres(const WorldData& d) {
  Motion out;
  for (int i = 0; i < d.spheres.count; ++i) {
    out.push_back(d.spheres.velocity[i]);
    out.push_back(d.spheres.angularVelocity[i]);
  }
  return out;
}

double largestOf(const std::vector<Vector3d>& a) {
  double most = 0;
  for (const Vector3d& v : a) most = std::max(most, v.norm());
  return most;
}

class BentAnchors : public testing::TestWithParam<double> {};  // rad about each axis of each sphere

}  // namespace

TEST_P(BentAnchors, VelocitiesOfCarriedNodesAreThePlacesDifferences) {
  World world = chainsOfAllLinks(SurfaceMode::contact);
  ASSERT_EQ(world.dynamicNodes(0), 0);
  WorldData& d = world.data();
  shake(d, 3, GetParam(), 0.003, 0.5);
  const auto places = [](WorldData& of) {
    placeCarriedNodes(of);
    std::vector<Vector3d> out(of.nodes.count);
    for (int i = 0; i < of.nodes.count; ++i) out[i] = vectorAt(of.nodes.position, i);
    return out;
  };
  const std::vector<Vector3d> expected = differences(d, motionOfSpheres(d), places);
  placeCarriedNodes(d);
  for (const BodyRange& range : d.ranges)
    for (const int i : range.node)
      EXPECT_LT((vectorAt(d.nodes.velocity, i) - expected[i]).norm(), 1e-7 * largestOf(expected)) << "node " << i;
}

TEST_P(BentAnchors, OneNodeMovesAsTheWholeSurfaceDoesAndLoadsReturnTheSamePower) {
  World world = chainsOfAllLinks(SurfaceMode::skin), carrying = chainsOfAllLinks(SurfaceMode::contact);
  WorldData& d = world.data();
  for (World* of : {&world, &carrying}) shake(of->data(), 4, GetParam(), 0.003, 0.5);
  placeCarriedNodes(carrying.data());
  const Vector3d force(1, -2, 0.5);
  for (std::size_t b = 0; b < d.ranges.size(); ++b) {
    for (std::size_t n = 0; n < d.ranges[b].node.size(); ++n) {
      const int i = d.ranges[b].node[n];
      const HostPoint point = hostPoint(d, i);
      ASSERT_TRUE(point.count > 0 || d.identified.ofNodeGroup[i / 4] >= 0);  // held nodes hang on no sphere
      Vector3d velocity = Vector3d::Zero();
      double power = 0;
      for (int k = 0; k < point.count; ++k) {
        const Vector3d linear = vectorOf(d.spheres.velocity[point.spheres[k]]),
                       angular = vectorOf(d.spheres.angularVelocity[point.spheres[k]]);
        velocity += point.force[k].transpose() * linear + point.torque[k].transpose() * angular;
        power += linear.dot(point.force[k] * force) + angular.dot(point.torque[k] * force);
      }
      const Vector3d expected = vectorAt(carrying.data().nodes.velocity, carrying.data().ranges[b].node[n]);
      EXPECT_LE((velocity - expected).norm(), 1e-12 * expected.norm());
      EXPECT_NEAR(power, force.dot(expected), 1e-12 * force.norm() * expected.norm());
    }
  }
}

TEST_P(BentAnchors, TheImplicitStepsMapIsTheAnchorsDerivativeAndReturnsItsTranspose) {
  World world = chainsOfAllLinks(SurfaceMode::full);
  WorldData& d = world.data();
  shake(d, 5, GetParam(), 0.003, 0.5);
  runStage(d, evaluateForces);
  const std::size_t nodes = d.nodes.dynamicEnd, quads = 2 * static_cast<std::size_t>(d.spheres.count);
  Random random(9);
  Motion motion(quads + nodes), returned(quads + nodes);
  std::vector<Quad> carried(nodes), impulses(nodes);
  for (Quad& q : motion) q = quadOf(random.vector());
  for (Quad& q : impulses) q = quadOf(random.vector());
  carryMotion(d, motion, carried);
  returnImpulses(d, impulses, returned);
  double onNodes = 0, onSpheres = 0;
  for (std::size_t i = 0; i < nodes; ++i) onNodes += vectorOf(impulses[i]).dot(vectorOf(carried[i]));
  for (std::size_t i = 0; i < quads; ++i) onSpheres += vectorOf(motion[i]).dot(vectorOf(returned[i]));
  EXPECT_NEAR(onSpheres, onNodes, 1e-12 * std::abs(onNodes));

  // Nodes stand still here, so that what they are displaced by falls as the anchors move.
  const std::vector<Vector3d> falling = differences(d, motion, [](WorldData& of) {
    runStage(of, evaluateAttachments);
    std::vector<Vector3d> out(of.nodes.dynamicEnd);
    for (int i = 0; i < of.nodes.dynamicEnd; ++i) out[i] = vectorOf(of.nodes.displaced[i]);
    return out;
  });
  for (const BodyRange& range : d.ranges)
    for (const int i : range.node)
      EXPECT_LT((vectorOf(carried[i]) + falling[i]).norm(), 1e-7 * largestOf(falling)) << "node " << i;
}

INSTANTIATE_TEST_SUITE_P(All, BentAnchors, testing::Values(0.2, 0.9, 1.3));

// An end's single node, however near its sphere, is pressed with a few times its attachment's stiffness at most: the
// pressure's share of the volume has the attachment's floor.
TEST(Pressure, ALoneNodeNearItsSphereCostsNoStep) {
  const auto stableSubstep = [](double nearer) {
    BodyDescription body = synthetic::body(synthetic::chainModel(synthetic::straightTube(8, 0.16, 0.012, 24, 12)), 5e3);
    auto model = std::make_shared<SoftBodyModel>(*body.model);
    const int last = static_cast<int>(model->restNodes.size()) - 1;
    for (int i = 0; i < last; ++i) {
      Attachment& a = model->attachments[i];
      if (a.onLink || a.host != 7) continue;
      a.onLink = true;
      a.host = 6;
      a.along = 1;
    }
    Attachment& lone = model->attachments[last];
    const Vector3d offset = model->restNodes[last] - model->spheres[7].restFrame;
    lone.onLink = false;
    lone.host = 7;
    lone.restOffset = (1 - nearer) * offset;
    model->restNodes[last] -= nearer * offset;
    body.model = model;
    return World({}, {body}).stableSubstep();
  };
  EXPECT_GT(stableSubstep(0.99), 0.9 * stableSubstep(0));
}

}  // namespace medulla
