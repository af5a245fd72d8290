#include <gtest/gtest.h>

#include <cstdio>

#include "physics/dynamics/world.h"
#include "physics/model/mesh_topology.h"
#include "tests/synthetic_model.h"

namespace medulla {

using Eigen::Vector3d;

constexpr int kPushed = 35;  // a node in the tube's middle

namespace {
// m/N, as estimated and as a push into the surface that grows evenly for a frame shows.
struct Give {
  NodeGive estimated;
  double shown = 0;
};
}  // namespace

// `frames`: how many the push lasts, of which it grows in the first.
static Give pushNode(BodyDescription body, int frames) {
  const Vector3d inward = -vertexNormals({body.model->restNodes, body.model->triangles})[kPushed];
  WorldSettings settings;
  settings.gravity.setZero();
  constexpr double kForce = 1e-5;  // N
  body.deadLoads = {{kPushed, kForce * inward, 0, settings.frameDuration}};
  World world(settings, {body});
  DynamicsFrame frame;
  world.readFrame(frame);
  const Vector3d rest = frame.bodies[0].nodes[kPushed];
  for (int k = 0; k < frames; ++k) world.advance({});
  world.readFrame(frame);
  return {world.nodeGive()[0][kPushed], inward.dot(frame.bodies[0].nodes[kPushed] - rest) / kForce};
}

// The other nodes beyond the neighbours, and the spheres, stand still.
TEST(NodeGive, ANodeGivesByItself) {
  BodyDescription body = synthetic::body(synthetic::shortTube(), 6e3);
  for (int i = 0; i < 5; ++i) body.fixed.push_back({i, FixedFreedom::all});
  body.fixedNodes = {0};
  const Give give = pushNode(body, 100);
  std::printf("[  reached ] a node gives %.4g m/N, estimated %.4g\n", give.shown, give.estimated.own);
  EXPECT_GT(give.estimated.own, 0.7 * give.shown);
  EXPECT_LT(give.estimated.own, 1.1 * give.shown);
  EXPECT_EQ(give.estimated.carried, 0);
  const World world(WorldSettings{}, {body});
  EXPECT_EQ(world.nodeGive()[0][0].own, 0);
}

// Beams' skins follow their spheres wherever their nodes are named.
TEST(NodeGive, NamedNodesOfASkinGiveAsFarAsTheyMove) {
  BodyDescription body = synthetic::body(synthetic::shortTube(), 6e3);
  body.surface = SurfaceMode::skin;
  body.fixedNodes = {kPushed};
  const World world(WorldSettings{}, {body});
  EXPECT_GT(world.nodeGive()[0][kPushed].carried, 0);
}

// On a skin nothing else gives: bodies that hardly move within a frame, and such as go all the way.
TEST(NodeGive, SpheresCarryANodeWithinAFrame) {
  for (const bool isHeld : {true, false}) {
    for (const double young : {1e3, 1e5, 1e7}) {
      BodyDescription body = synthetic::body(synthetic::shortTube(), young);
      body.surface = SurfaceMode::skin;
      if (isHeld) body.fixed = {{0, FixedFreedom::all}};
      const Give give = pushNode(body, 1);
      std::printf("[  reached ] %s, %g Pa: carried by %.4g m/N, estimated %.4g\n", isHeld ? "held" : "free", young,
                  give.shown, give.estimated.carried);
      EXPECT_EQ(give.estimated.own, 0);
      EXPECT_GT(give.estimated.carried, 0.6 * give.shown);
      EXPECT_LT(give.estimated.carried, 1.1 * give.shown);
    }
  }
}

}  // namespace medulla
