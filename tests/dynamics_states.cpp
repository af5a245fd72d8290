#include "tests/dynamics_states.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace medulla::states {

Quaterniond orientation(const WorldData& d, int i) {
  return quaternionOf(d.spheres.orientation[i]);
}
void setOrientation(WorldData& d, int i, const Quaterniond& q) {
  d.spheres.orientation[i] = {{q.x(), q.y(), q.z(), q.w()}};
}
void turnBy(WorldData& d, int i, const Vector3d& rotation) {
  if (rotation.norm() == 0) return;
  setOrientation(d, i, Quaterniond(Eigen::AngleAxisd(rotation.norm(), rotation.normalized())) * orientation(d, i));
}

Eigen::Matrix3d inertia(const WorldData& d, int i) {
  const Eigen::Matrix3d r = orientation(d, i).toRotationMatrix();
  return r * inverseInertiaOf(d.spheres.groups[i / 4], i % 4).inverse() * r.transpose();
}
void setAngularVelocity(WorldData& d, int i, const Vector3d& omega) {
  d.spheres.angularMomentum[i] = quadOf(inertia(d, i) * omega);
  d.spheres.angularVelocity[i] = quadOf(omega);
}
double sphereMass(const WorldData& d, int i) {
  return d.spheres.groups[i / 4].mass[i % 4];
}

void shake(WorldData& d, std::uint64_t seed, double angle, double shift, double speed) {
  Random random(seed);
  for (int i = 0; i < d.spheres.count; ++i) {
    turnBy(d, i, angle * random.vector());
    d.spheres.position[i] = quadOf(vectorOf(d.spheres.position[i]) + shift * random.vector());
    d.spheres.velocity[i] = quadOf(speed * random.vector());
    setAngularVelocity(d, i, 30 * speed * random.vector());
  }
  for (const BodyRange& r : d.ranges) {
    for (int i : r.node) {
      if (i >= d.nodes.dynamicEnd) continue;
      const Vector3d moved = shift * random.vector(), thrown = speed * random.vector();
      if (d.nodes.inverseMass[i] == 0) continue;  // fixed
      setVector(d.nodes.position, i, vectorAt(d.nodes.position, i) + moved);
      setVector(d.nodes.velocity, i, thrown);
    }
  }
  runStage(d, evaluateLinks);
}

WorldSettings weightless(int substeps) {
  WorldSettings s;
  s.gravity.setZero();
  s.substeps = substeps;
  return s;
}

Momentum momentum(const WorldData& d) {
  Momentum m;
  const auto add = [&m](const Vector3d& x, const Vector3d& p, const Vector3d& spin) {
    m.linear += p;
    m.angular += x.cross(p) + spin;
    m.linearScale += p.norm();
    m.angularScale += x.norm() * p.norm() + spin.norm();
  };
  for (int i = 0; i < d.spheres.count; ++i)
    add(vectorOf(d.spheres.position[i]), sphereMass(d, i) * vectorOf(d.spheres.velocity[i]),
        vectorOf(d.spheres.angularMomentum[i]));
  for (int i = 0; i < d.nodes.dynamicEnd; ++i)
    add(vectorAt(d.nodes.position, i), d.nodes.mass[i] * vectorAt(d.nodes.velocity, i), Vector3d::Zero());
  return m;
}

double elastic(WorldData& d) {
  runStage(d, evaluateLinks);
  runStage(d, evaluateAttachments);
  return medulla::elasticEnergy(d);
}

void expectForcesAreMinusGradient(WorldData& d, double tolerance) {
  runStage(d, evaluateForces);
  const std::vector<Quad> force = d.spheres.force, torque = d.spheres.torque;
  const Lanes3* ofNodes = d.nodes.force.data();
  const std::vector<Lanes3> nodeForce(ofNodes, ofNodes + d.nodes.dynamicEnd / 4);
  double forceScale = 0, torqueScale = 0;
  for (int i = 0; i < d.spheres.count; ++i) {
    forceScale = std::max(forceScale, vectorOf(force[i]).norm());
    torqueScale = std::max(torqueScale, vectorOf(torque[i]).norm());
  }
  const double step = 1e-6;
  for (int i = 0; i < d.spheres.count; ++i) {
    for (int k = 0; k < 3; ++k) {
      const Quad position = d.spheres.position[i], q = d.spheres.orientation[i];
      double energy[2] = {};
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
      double energy[2] = {};
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

void expectMomentaStay(World& world) {
  shake(world.data(), 3, 0.3, 0.002, 0.1);
  const Momentum before = momentum(world.data());
  for (int i = 0; i < 50; ++i) world.advance({});
  const Momentum after = momentum(world.data());
  EXPECT_LT((after.linear - before.linear).norm(), 1e-12 * before.linearScale);
  EXPECT_LT((after.angular - before.angular).norm(), 1e-12 * before.angularScale);
}

void expectEnergyStays(World& world) {
  shake(world.data(), 5, 0.1, 0.0005, 0.05);
  const Energies start = world.energies();
  double largest = 0;
  for (int i = 0; i < 250; ++i) {
    world.advance({});
    const Energies e = world.energies();
    largest = std::max(largest, std::abs(e.kinetic + e.elastic - start.kinetic - start.elastic));
  }
  // The symplectic step swings about the true energy by a share of order step times frequency (8 % for the fastest).
  EXPECT_LT(largest, 0.02 * (start.kinetic + start.elastic));
  EXPECT_GT(world.energies().kinetic, 0.05 * start.kinetic);
}

void expectEnergyIsTakenInEveryFrame(World& world) {
  shake(world.data(), 7, 0.3, 0.002, 0.1);
  double before = world.energies().kinetic + world.energies().elastic;
  const double start = before;
  for (int i = 0; i < 40; ++i) {
    world.advance({});
    const double now = world.energies().kinetic + world.energies().elastic;
    EXPECT_LE(now, before + 1e-9 * start) << "frame " << i;
    before = now;
  }
  EXPECT_LT(before, 0.5 * start);
}

}  // namespace medulla::states
