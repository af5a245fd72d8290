#include <Eigen/Dense>

#include "physics/dynamics/stages.h"

// The mass-proportional part of Rayleigh's damping: it slows low modes, which the links' part reaches only at the price
// of the step. Textbooks let it act against the world; here it acts against the body's own rigid motion, so that both
// momenta stay and neither free fall nor free rotation is slowed.
namespace medulla {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Velocities are v = linear + angular x (x - centre): the rigid motion with the spheres' linear and orbital angular
// momentum.
struct RigidMotion {
  Vector3d centre = Vector3d::Zero(), linear = Vector3d::Zero(), angular = Vector3d::Zero();
};

RigidMotion rigidMotionOf(const Spheres& s, const BodyRange& r) {
  RigidMotion motion;
  double total = 0;
  const auto mass = [&](int i) { return s.groups[i / 4].mass[i % 4]; };
  for (int i = r.firstSphere; i < r.firstSphere + r.sphereCount; ++i) {
    total += mass(i);
    motion.centre += mass(i) * vectorOf(s.position[i]);
    motion.linear += mass(i) * vectorOf(s.velocity[i]);
  }
  motion.centre /= total;
  motion.linear /= total;
  Matrix3d inertia = Matrix3d::Zero();
  Vector3d momentum = Vector3d::Zero();
  for (int i = r.firstSphere; i < r.firstSphere + r.sphereCount; ++i) {
    const Vector3d x = vectorOf(s.position[i]) - motion.centre;
    inertia += mass(i) * (x.squaredNorm() * Matrix3d::Identity() - x * x.transpose());
    momentum += mass(i) * x.cross(vectorOf(s.velocity[i]) - motion.linear);
  }
  // Spheres in a line do not say how they turn about it, and need not: that turning moves none of their centres.
  constexpr double kRegular = 1e-16;
  inertia += (kRegular * inertia.trace() + std::numeric_limits<double>::min()) * Matrix3d::Identity();
  motion.angular = inertia.ldlt().solve(momentum);
  return motion;
}

}  // namespace

// Implicit, so that no alpha is too much for a step. Spins and nodes follow through links and attachments.
void dampBodies(WorldData& d) {
  Spheres& s = d.spheres;
  for (const BodyRange& r : d.ranges) {
    if (r.massDamping == 0) continue;
    const double lost = 1 - 1 / (1 + d.substep * r.massDamping);
    const RigidMotion motion = r.held ? RigidMotion() : rigidMotionOf(s, r);
    for (int i = r.firstSphere; i < r.firstSphere + r.sphereCount; ++i) {
      const Vector3d v = vectorOf(s.velocity[i]);
      const Vector3d rigid = motion.linear + motion.angular.cross(vectorOf(s.position[i]) - motion.centre);
      s.velocity[i] = quadOf(v - lost * (v - rigid));
    }
  }
}

}  // namespace medulla
