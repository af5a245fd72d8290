#include "tests/dynamics_states.h"
#include "tests/synthetic_model.h"

namespace medulla {

using namespace states;

static World bareChain(int spheres, SurfaceMode surface, double damping) {
  BodyDescription b =
      synthetic::body(synthetic::chainModel(synthetic::straightTube(spheres, 0.02 * (spheres - 1), 0.01, 4, 6)), 5e3);
  // Unequal sections and factors: no symmetry hides a wrong axis.
  auto model = std::make_shared<SoftBodyModel>(*b.model);
  for (ElasticLink& l : model->links) {
    for (int k = 0; k < ElasticLink::kSections; ++k) {
      LinkSection& s = l.sections[k];
      const double taper = 1 + 0.1 * k;
      s = {taper * s.area, 1.7 * taper * s.bendingMomentU, taper * s.bendingMomentV, taper * taper * s.torsionConstant};
    }
  }
  model->spheres.front().restLinkEnd += Vector3d(-0.004, 0.002, 0.001);  // links end off their frames
  model->spheres.back().restLinkEnd += Vector3d(0.003, -0.001, 0.002);
  b.model = model;
  b.surface = surface;
  b.tissue.damping = damping;
  b.factors = {1.3, 0.8, 1.6};
  WorldSettings settings;
  settings.gravity.setZero();
  return World(settings, {b});
}

// Central differences of the elastic energy along every freedom, against the forces.
static void expectForcesAreMinusGradient(WorldData& d, double tolerance) {
  runStage(d, evaluateForces);
  const std::vector<Quad> force = d.spheres.force, torque = d.spheres.torque;
  const std::vector<Lanes3> nodeForce = d.nodes.force;
  double forceScale = 0, torqueScale = 0;
  for (int i = 0; i < d.spheres.count; ++i) {
    forceScale = std::max(forceScale, vectorOf(force[i]).norm());
    torqueScale = std::max(torqueScale, vectorOf(torque[i]).norm());
  }
  const double step = 1e-6;
  for (int i = 0; i < d.spheres.count; ++i) {
    for (int k = 0; k < 3; ++k) {
      const Quad position = d.spheres.position[i], q = d.spheres.orientation[i];
      double energy[2];
      for (int side : {0, 1}) {
        d.spheres.position[i].v[k] = position.v[k] + (side == 0 ? -1 : 1) * 0.1 * step;
        energy[side] = elastic(d);
        d.spheres.position[i] = position;
      }
      EXPECT_NEAR(force[i].v[k], -(energy[1] - energy[0]) / (0.2 * step), tolerance * forceScale)
          << "sphere " << i << " axis " << k;
      for (int side : {0, 1}) {
        turnBy(d, i, (side == 0 ? -step : step) * Vector3d::Unit(k));
        energy[side] = elastic(d);
        d.spheres.orientation[i] = q;
      }
      EXPECT_NEAR(torque[i].v[k], -(energy[1] - energy[0]) / (2 * step), tolerance * torqueScale)
          << "sphere " << i << " about " << k;
    }
  }
  for (int i = 0; i < d.nodes.dynamicEnd; i += 5) {
    for (int k = 0; k < 3; ++k) {
      const Vector3d position = vectorAt(d.nodes.position, i);
      double energy[2];
      for (int side : {0, 1}) {
        setVector(d.nodes.position, i, position + (side == 0 ? -1 : 1) * 0.1 * step * Vector3d::Unit(k));
        energy[side] = elastic(d);
        setVector(d.nodes.position, i, position);
      }
      EXPECT_NEAR(vectorAt(nodeForce, i)[k], -(energy[1] - energy[0]) / (0.2 * step), tolerance * forceScale)
          << "node " << i << " axis " << k;
    }
  }
}

TEST(Link, ForcesAreMinusTheEnergyGradient) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    World world = bareChain(4, SurfaceMode::skin, 0);
    const double angle = seed <= 4 ? 0.2 : 1.0;  // rad about each axis: up to 100 degrees between ends
    shake(world.data(), seed, angle, 0.004, 0);
    expectForcesAreMinusGradient(world.data(), 1e-6);
  }
}

TEST(Attachment, ForcesOnNodesAndSpheresAreMinusTheEnergyGradient) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    World world = bareChain(4, SurfaceMode::full, 0);
    shake(world.data(), seed, seed <= 2 ? 0.2 : 0.9, 0.003, 0);
    expectForcesAreMinusGradient(world.data(), 1e-6);
  }
}

}  // namespace medulla
