#include <cstddef>

#include "physics/dynamics/stages.h"

// The six freedoms of the filling spheres (paper 2.2): sums of forces, and the integrator.
namespace medulla {

namespace {

struct Turning {
  Lanes3 q;
  Lanes w;
  Lanes3 momentum;
  Rotation rotation;    // of (q, w)
  Lanes3 bodyMomentum;  // the momentum as the sphere sees it
};

MEDULLA_INLINE void orient(Turning& t) {
  t.rotation = rotationOf(t.q, t.w);
  t.bodyMomentum = rotateBack(t.rotation, t.momentum);
}

MEDULLA_INLINE Turning readTurning(const Spheres& s, std::size_t i) {
  Turning t;
  t.q = gatherFour(s.orientation, i, t.w);
  t.momentum = gatherFour(s.angularMomentum, i);
  orient(t);
  return t;
}

// Orientation after h at the body-frame angular velocity of the half step: the gyroscopic term -omega x L, stepped to
// the middle, is what makes a free top keep its energy to second order; its world angular momentum is exact by
// construction. exp of the half angle vector u as (1, u tan|u|/|u|) normalised; the series is good to 5e-8 at |u| =
// 0.1.
void turn(const SphereGroup& g, Turning& t, Lanes h) {
  const Lanes half = splat(0.5), one = splat(1);
  const Lanes3 start = timesInverseInertia(g, t.bodyMomentum);
  const Lanes3 middle = timesInverseInertia(g, fnma(half * h, cross(start, t.bodyMomentum), t.bodyMomentum));
  const Lanes3 u = (half * h) * middle;
  const Lanes uu = dot(u, u);
  const Lanes3 p = fma(uu, fma(uu, splat(2.0 / 15), splat(1.0 / 3)), one) * u;
  const Lanes3 q = t.q + fma(t.w, p, cross(t.q, p));  // (q, w) times (p, 1)
  const Lanes w = t.w - dot(t.q, p);
  const Lanes scale = one / squareRoot(fma(w, w, dot(q, q)));
  t.q = scale * q;
  t.w = scale * w;
}

MEDULLA_INLINE void storeAngularVelocity(const SphereGroup& g, const Turning& t, Quad* out) {
  const Lanes3 omega = rotate(t.rotation, timesInverseInertia(g, t.bodyMomentum));
  storeFour(omega, out, 0);
}

// Nodes without an inverse mass, fixed or pads, do not fall either.
void stepNodes(Nodes& n, const std::vector<int>& groups, const Quad& gravity, double h) {
  const Lanes zero = splat(0);
  const Lanes3 fall = splat(h) * splat(gravity);
  for (const int g : groups) {
    const Lanes perMass = loadFour(n.inverseMass, 4 * g), moves = isLess(zero, perMass);
    put(fma(splat(h) * perMass, n.force[g], n.velocity[g] + masked(moves, fall)), n.velocity[g]);
  }
}

}  // namespace

void sumSphereForces(WorldData& d, const Batch& batch) {
  Spheres& s = d.spheres;
  const Lanes gravity = load(d.gravity);
  for (const int i : batch.spheres) {
    Lanes force = fma(splat(s.groups[i / 4].mass[i % 4]), gravity, load(s.force[i]));
    Lanes torque = load(s.torque[i]);
    for (int k = s.firstSlot[i]; k < s.firstSlot[i + 1]; ++k) {
      const Slot& slot = d.links.slots[s.slot[k]];
      force = force + load(slot.force);
      torque = torque + load(slot.torque);
    }
    store(s.force[i], force);
    store(s.torque[i], torque);
  }
}

void stepVelocities(WorldData& d, const Batch& batch) {
  Spheres& s = d.spheres;
  const Lanes h = splat(d.substep);
  for (const int i : batch.spheres) {
    const SphereGroup& g = s.groups[i / 4];
    store(s.velocity[i], fma(h * splat(g.inverseMass[i % 4]), load(s.force[i]), load(s.velocity[i])));
    store(s.angularMomentum[i], fma(h * splat(g.freeToTurn[i % 4]), load(s.torque[i]), load(s.angularMomentum[i])));
  }
  stepNodes(d.nodes, batch.nodeGroups, d.gravity, d.substep);
}

void stepPositions(WorldData& d, const Batch& batch) {
  Spheres& s = d.spheres;
  const Lanes h = splat(d.substep);
  for (const int i : batch.spheres) store(s.position[i], fma(h, load(s.velocity[i]), load(s.position[i])));
  for (const int g : batch.sphereGroups) {
    Turning t = readTurning(s, 4 * g);
    turn(s.groups[g], t, h);
    storeFour(t.q, t.w, s.orientation, 4 * g);
    orient(t);
    storeAngularVelocity(s.groups[g], t, &s.angularVelocity[4 * g]);
  }
  for (const int g : batch.nodeGroups) put(fma(h, d.nodes.velocity[g], d.nodes.position[g]), d.nodes.position[g]);
}

void refreshAngularVelocities(WorldData& d) {
  Spheres& s = d.spheres;
  for (std::size_t g = 0; g < s.groups.size(); ++g)
    storeAngularVelocity(s.groups[g], readTurning(s, 4 * g), &s.angularVelocity[4 * g]);
}

}  // namespace medulla
