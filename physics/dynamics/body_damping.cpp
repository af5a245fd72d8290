#include <Eigen/Dense>
#include <limits>

#include "physics/dynamics/stages.h"
#include "physics/dynamics/whole_motion.h"

// The mass-proportional part of Rayleigh's damping: it slows low modes, which the links' part reaches only at the price
// of the step. Textbooks let it act against the world; here it acts against the body's own rigid motion, as far as what
// is held or driven leaves it one: both momenta of a free body stay, a pendulum swings on, and what is carried along is
// not dragged. Of what a sphere weighs its own mass alone counts:
// alpha allows for what hangs on it (rest_modes.cpp), and must not do so twice where nodes are carried. Spins are
// damped likewise, or the twisting of a tube would hardly be: each as if its own moment of inertia were the least about
// all axes, which spares turning the tensor and takes no less than nothing from any motion.
namespace medulla {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Velocities are v = linear + angular x (x - centre). Vectors as (x, y, z, 0).
struct RigidLanes {
  Lanes centre, linear, angular;
};

// Of spheres' centres about a point.
struct Moments {
  double mass = 0, spinMoment = 0;
  Lanes first = splat(0), momentum = splat(0), angularMomentum = splat(0);  // the last with the spins'
  Lanes squares = splat(0), products = splat(0);                            // m x x and so on; m x y, m y z, m z x
};

Moments momentsAbout(const Lanes& reference, const WorldData& d, const BodyRange& r) {
  const Spheres& s = d.spheres;
  Moments out;
  for (const int i : spheresOf(r)) {
    const double m = d.surface.ownShare[i] * s.groups[i / 4].mass[i % 4], spinning = d.surface.ownMoment[i];
    const Lanes x = load(s.position[i]) - reference, mx = splat(m) * x, v = load(s.velocity[i]);
    out.mass += m;
    out.spinMoment += spinning;
    out.first = out.first + mx;
    out.momentum = fma(splat(m), v, out.momentum);
    out.angularMomentum = fma(splat(spinning), load(s.angularVelocity[i]), out.angularMomentum + crossProduct(mx, v));
    out.squares = fma(mx, x, out.squares);
    out.products = fma(mx, turnedLanes(x), out.products);
  }
  return out;
}

Matrix3d inertiaOf(const Lanes& squares, const Lanes& q, double spinMoment) {
  const double trace = sumOfLanes(squares);
  // Spheres in a line that do not turn do not say how they turn about it, and need not: that moves none of their
  // centres.
  constexpr double kRegular = 1e-14;
  const double regular = kRegular * trace + std::numeric_limits<double>::min();
  Matrix3d inertia;
  inertia << trace - squares[0], -q[0], -q[2], -q[0], trace - squares[1], -q[1], -q[2], -q[1], trace - squares[2];
  inertia.diagonal().array() += regular + spinMoment;
  return inertia;
}

Lanes lanesOf(const Vector3d& v) {
  return load(quadOf(v));
}

Vector3d vectorOf(const Lanes& v) {
  return {v[0], v[1], v[2]};
}

// The rigid motion with the spheres' linear and orbital angular momentum: sums about the body's first sphere, moved to
// the centre of mass by Steiner's theorem.
RigidLanes freeMotion(const WorldData& d, const BodyRange& r) {
  const Lanes reference = load(d.spheres.position[r.firstSphere]);
  const Moments m = momentsAbout(reference, d, r);
  RigidLanes motion;
  const Lanes centre = m.first / splat(m.mass);
  motion.centre = reference + centre;
  motion.linear = m.momentum / splat(m.mass);
  const Matrix3d inertia =
      inertiaOf(fnma(m.first, centre, m.squares), fnma(m.first, turnedLanes(centre), m.products), m.spinMoment);
  const Lanes about = m.angularMomentum - crossProduct(centre, m.momentum);
  motion.angular = lanesOf(inertia.ldlt().solve(vectorOf(about)));
  return motion;
}

// The rotation about a point, or about a line through two, with the spheres' angular momentum there, seen from the
// point's own motion.
RigidLanes supportedMotion(const WorldData& d, int body) {
  const BodyRange& r = d.ranges[body];
  const Pivot pivot = pivotOf(d, body);
  RigidLanes motion{lanesOf(pivot.point), lanesOf(pivot.velocity), splat(0)};
  if (!canTurn(r)) return motion;
  const Moments m = momentsAbout(motion.centre, d, r);
  const Matrix3d inertia = inertiaOf(m.squares, m.products, m.spinMoment);
  const Vector3d momentum = vectorOf(m.angularMomentum - crossProduct(m.first, motion.linear));
  const Vector3d& line = pivot.line;
  motion.angular = lanesOf(pivot.freedom == RigidFreedom::aboutPoint
                               ? Vector3d(inertia.ldlt().solve(momentum))
                               : Vector3d(line.dot(momentum) / line.dot(inertia * line) * line));
  return motion;
}

// Against a motion that does not turn, which most bodies are left, and one that does.
template <bool turns>
void dampAgainst(const RigidLanes& rigid, double lost, const BodyRange& r, WorldData& d) {
  Spheres& s = d.spheres;
  for (const int i : spheresOf(r)) {
    if (s.groups[i / 4].inverseMass[i % 4] == 0) continue;  // held, or moved by a drive
    const Lanes v = load(s.velocity[i]), spin = load(s.angularVelocity[i]);
    Lanes beyond = v - rigid.linear, spinBeyond = spin;
    if constexpr (turns) {
      beyond = beyond - crossProduct(rigid.angular, load(s.position[i]) - rigid.centre);
      spinBeyond = spin - rigid.angular;
    }
    store(s.velocity[i], fma(splat(-lost * d.surface.ownShare[i]), beyond, v));
    store(s.angularMomentum[i], fma(splat(-lost * d.surface.ownMoment[i]), spinBeyond, load(s.angularMomentum[i])));
  }
}

}  // namespace

// Implicit, so that no alpha is too much for a step. Nodes follow through attachments.
void dampBodies(WorldData& d, const Batch& batch) {
  for (const int b : batch.bodies) {
    const BodyRange& r = d.ranges[b];
    const double damping = d.frame < 0 ? r.settlingDamping : r.massDamping;
    if (damping == 0) continue;
    const double lost = 1 - 1 / (1 + d.substep * damping);
    const bool turns = canTurn(r);
    const RigidLanes rigid = isFree(r) ? freeMotion(d, r) : supportedMotion(d, b);
    turns ? dampAgainst<true>(rigid, lost, r, d) : dampAgainst<false>(rigid, lost, r, d);
  }
}

}  // namespace medulla
