#include <Eigen/Dense>

#include "physics/dynamics/stages.h"

// The mass-proportional part of Rayleigh's damping: it slows low modes, which the links' part reaches only at the price
// of the step. Textbooks let it act against the world; here it acts against the body's own rigid motion, so that both
// momenta stay and neither free fall nor free rotation is slowed. Of what a sphere weighs its own mass alone counts:
// alpha allows for what hangs on it (rest_modes.cpp), and must not do so twice where nodes are carried.
namespace medulla {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Velocities are v = linear + angular x (x - centre): the rigid motion with the spheres' linear and orbital angular
// momentum. Vectors as (x, y, z, 0).
struct RigidMotion {
  Lanes centre, linear, angular;
};

// One pass: sums about the body's first sphere, moved to the centre of mass by Steiner's theorem.
RigidMotion rigidMotionOf(const Spheres& s, const std::vector<double>& ownShare, const BodyRange& r) {
  const Lanes reference = load(s.position[r.firstSphere]), zero = splat(0);
  Lanes first = zero, momentum = zero, angularMomentum = zero, squares = zero, products = zero;
  double mass = 0;
  for (const int i : spheresOf(r)) {
    const double m = ownShare[i] * s.groups[i / 4].mass[i % 4];
    const Lanes x = load(s.position[i]) - reference, mx = splat(m) * x, v = load(s.velocity[i]);
    mass += m;
    first = first + mx;
    momentum = fma(splat(m), v, momentum);
    angularMomentum = angularMomentum + crossProduct(mx, v);
    squares = fma(mx, x, squares);
    products = fma(mx, turnedLanes(x), products);  // xy, yz, zx
  }
  RigidMotion motion;
  const Lanes centre = first / splat(mass);
  motion.centre = reference + centre;
  motion.linear = momentum / splat(mass);
  const Lanes moved = fnma(first, centre, squares);
  const Lanes q = fnma(first, turnedLanes(centre), products);
  const double trace = sumOfLanes(moved);
  // Spheres in a line do not say how they turn about it, and need not: that turning moves none of their centres.
  constexpr double kRegular = 1e-14;
  const double regular = kRegular * trace + std::numeric_limits<double>::min();
  Matrix3d inertia;
  inertia << trace - moved[0], -q[0], -q[2], -q[0], trace - moved[1], -q[1], -q[2], -q[1], trace - moved[2];
  inertia.diagonal().array() += regular;
  const Lanes about = angularMomentum - crossProduct(centre, momentum);
  motion.angular = load(quadOf(inertia.ldlt().solve(Vector3d(about[0], about[1], about[2]))));
  return motion;
}

}  // namespace

// Implicit, so that no alpha is too much for a step. Spins and nodes follow through links and attachments.
void dampBodies(WorldData& d, const Batch& batch) {
  Spheres& s = d.spheres;
  const std::vector<double>& ownShare = d.surface.ownShare;
  for (const int b : batch.bodies) {
    const BodyRange& r = d.ranges[b];
    if (r.massDamping == 0) continue;
    const double lost = 1 - 1 / (1 + d.substep * r.massDamping);
    const auto slow = [&](const auto& rigidAt) {
      for (const int i : spheresOf(r)) {
        const Lanes v = load(s.velocity[i]);
        store(s.velocity[i], fma(splat(-lost * ownShare[i]), v - rigidAt(i), v));
      }
    };
    if (r.held) {
      slow([](int) { return splat(0); });
      continue;
    }
    const RigidMotion m = rigidMotionOf(s, ownShare, r);
    slow([&](int i) { return m.linear + crossProduct(m.angular, load(s.position[i]) - m.centre); });
  }
}

}  // namespace medulla
