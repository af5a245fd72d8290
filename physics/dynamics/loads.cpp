#include "physics/dynamics/loads.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <utility>

#include "physics/dynamics/node_motion.h"
#include "physics/dynamics/point_spring.h"
#include "physics/dynamics/stages.h"

// Springs between tools and surface nodes. A node weighs tens of milligrams and a virtual coupling has hundreds of N/m
// and up to 1 N s/m: explicitly that needs substeps of 0.05 ms. Each load therefore solves
//   f = k (a - x - h v) + c (s - v)
// with the velocity s at which the damper is slack and the velocity v that all other forces *and f itself* leave at the
// substep's end. Rejected: raising the number of substeps while a tool touches (6 times the cost, and a step that
// depends on the tool).
namespace medulla {

namespace {

using Eigen::Vector3d;

// Angular velocity after stepVelocities: new momentum, orientation of the substep's beginning.
Vector3d angularVelocity(const WorldData& d, int sphere) {
  const Eigen::Matrix3d r = quaternionOf(d.spheres.orientation[sphere]).toRotationMatrix();
  const Vector3d momentum =
      vectorOf(d.spheres.angularMomentum[sphere]) + vectorOf(d.contact.change[sphere].angularMomentum);
  return r * (inverseInertiaOf(d.spheres.groups[sphere / 4], sphere % 4) * (r.transpose() * momentum));
}

void addImpulse(WorldData& d, int sphere, const Vector3d& linear, const Vector3d& angular) {
  const SphereGroup& g = d.spheres.groups[sphere / 4];
  addTo(d.spheres.velocity[sphere], load(quadOf(g.inverseMass[sphere % 4] * linear)));
  addTo(d.spheres.angularMomentum[sphere], load(quadOf(g.freeToTurn[sphere % 4] * angular)));
}

// On a skin, with what contacts will presumably make of it: as much as a substep ago. Contacts come after the loads,
// and a damper, and the spring at the substep's end, would yield to a velocity that they take away: a grip at rest on
// what lies on a floor gave down to a tenth of its spring's force.
Vector3d nodeVelocity(const WorldData& d, int node, const HostPoint& host) {
  if (host.count == 0) return vectorAt(d.nodes.velocity, node);
  Vector3d sum = Vector3d::Zero();
  for (int k = 0; k < host.count; ++k) {
    const int i = host.spheres[k];
    sum += host.force[k].transpose() * (vectorOf(d.spheres.velocity[i]) + vectorOf(d.contact.change[i].velocity));
    sum += host.torque[k].transpose() * angularVelocity(d, i);
  }
  return sum;
}

// The drag, solved implicitly, takes its part of these forces, too.
void addNodeImpulse(WorldData& d, int node, const HostPoint& host, const Vector3d& whole) {
  const Vector3d impulse = d.keptByDrag * whole;
  if (host.count == 0)
    setVector(d.nodes.velocity, node, vectorAt(d.nodes.velocity, node) + d.nodes.inverseMass[node] * impulse);
  for (int k = 0; k < host.count; ++k)
    addImpulse(d, host.spheres[k], host.force[k] * impulse, host.torque[k] * impulse);
}

// Not less than the square of a matrix' largest stretch, at most 1.08 times it: the eighth root of A^8's norm, A = M^T
// M. Sums of rows and columns may be three times it and hang on the axes: what a skin gave to a tool hung on how it was
// turned.
double stretchBound(const Eigen::Matrix3d& m) {
  Eigen::Matrix3d power = m.transpose() * m;
  const double size = power.trace();
  if (size == 0) return 0;
  power /= size;
  for (int k = 0; k < 3; ++k) power = (power * power).eval();
  return size * std::sqrt(std::sqrt(std::sqrt(power.norm())));
}

// 1/kg: velocity per impulse at the node; exact on masses, an upper bound on skin, where it only steers convergence.
double mobility(const WorldData& d, int node, const HostPoint& host) {
  if (host.count == 0) return d.nodes.inverseMass[node];
  double sum = 0;
  for (int k = 0; k < host.count; ++k) {
    const SphereGroup& g = d.spheres.groups[host.spheres[k] / 4];
    const int l = host.spheres[k] % 4;
    const double turning = g.inverseInertia[0][l] + g.inverseInertia[1][l] + g.inverseInertia[2][l];
    sum += g.inverseMass[l] * stretchBound(host.force[k]) + g.freeToTurn[l] * turning * stretchBound(host.torque[k]);
  }
  return sum;
}

// What nodes share of masses adds up by squares; on skin the roots add, since nodes may hang on the same spheres.
void prepare(const WorldData& d, const PointSpring& p, SettlingSpring& out) {
  out.spring = p;
  out.place = Vector3d::Zero();
  double ofMasses = 0, rootOfSkin = 0;
  for (int i = 0; i < p.count; ++i) {
    const double w = p.weights[i];
    out.hosts[i] = hostPoint(d, p.nodes[i]);
    out.place += w * nodePosition(d, p.nodes[i]);
    const double m = mobility(d, p.nodes[i], out.hosts[i]);
    if (out.hosts[i].count > 0)
      rootOfSkin += std::abs(w) * std::sqrt(m);
    else
      ofMasses += w * w * m;
  }
  out.mobility = d.keptByDrag * (ofMasses + rootOfSkin * rootOfSkin);
}

void addImpulse(WorldData& d, const SettlingSpring& s, const Vector3d& impulse) {
  for (int i = 0; i < s.spring.count; ++i)
    addNodeImpulse(d, s.spring.nodes[i], s.hosts[i], s.spring.weights[i] * impulse);
}

// Across `outward`, by no more than friction carries: the spring's `pull`, or, where it slides, what makes velocities
// equal. `force` is what has acted so far.
Vector3d dragOf(const SettlingSpring& s, const Vector3d& velocity, const Vector3d& force, const Vector3d& pull,
                double push, double substep) {
  constexpr double kLeastMobility = 1e-9;  // 1/kg: what is held
  const Vector3d& n = *s.spring.outward;
  const auto across = [&n](const Vector3d& a) { return Vector3d(a - a.dot(n) * n); };
  const Vector3d equal =
      force + (s.spring.anchorVelocity - velocity) / (substep * std::max(kLeastMobility, s.mobility));
  const Vector3d sticking = across(s.spring.slides ? equal : pull);
  const double size = sticking.norm(), most = push > 0 ? s.spring.friction * push : 0;
  return size > most ? Vector3d(most / size * sticking) : sticking;
}

// One pass of Gauss-Seidel at one load: its force goes to what the spring asks for now. Returns the change's size.
double settle(WorldData& d, const SettlingSpring& s, Vector3d& force) {
  const PointSpring& p = s.spring;
  const double h = d.substep, gain = p.stiffness * h * h + p.damping * h;
  Vector3d v = Vector3d::Zero();
  for (int i = 0; i < p.count; ++i) v += p.weights[i] * nodeVelocity(d, p.nodes[i], s.hosts[i]);
  const Vector3d wanted = p.stiffness * (p.anchor - s.place - h * v) + p.damping * (p.slackVelocity - v);
  Vector3d next = force + (wanted - force) / (1 + gain * s.mobility);
  if (p.outward != nullptr) {
    const Vector3d& n = *p.outward;
    const double along = next.dot(n), push = std::max(0.0, -along);
    next = dragOf(s, v, force, next, push, h) - push * n;
  }
  // Exact for one load alone: what the limit takes away changes the velocity, and so `wanted`, along the same line.
  if (const double size = next.norm(); size > p.forceMax) next *= p.forceMax / size;
  const Vector3d change = next - force;
  addImpulse(d, s, h * change);
  force = next;
  return change.norm();
}

}  // namespace

PointSpring pointSpring(const WorldData& d, const Loads& loads, std::size_t k, double remaining) {
  PointSpring p{};
  if (k < loads.toolSprings.size()) {
    const ToolSpring& t = loads.toolSprings[k];
    p.count = 3;
    p.tool = t.tool;
    for (int i = 0; i < 3; ++i) p.nodes[i] = d.ranges[t.body].node[t.nodes[i]];
    p.weights = t.weights;
    p.anchor = t.anchor - remaining * t.anchorVelocity;
    p.anchorVelocity = t.anchorVelocity;
    p.slackVelocity = t.anchorVelocity + t.drift;
    p.outward = &t.outward;
    p.stiffness = t.stiffness;
    p.damping = t.damping;
    p.slides = t.slides;
    p.friction = t.friction;
    p.forceMax = t.forceMax;
  } else {
    const HeldNode& held = loads.heldNodes[k - loads.toolSprings.size()];
    p.count = 1;
    p.tool = held.tool;
    p.nodes[0] = d.ranges[held.body].node[held.node];
    p.weights[0] = 1;
    p.anchor = held.anchor - remaining * held.anchorVelocity;
    p.anchorVelocity = p.slackVelocity = held.anchorVelocity;
    p.stiffness = held.stiffness;
    p.damping = held.damping;
    p.forceMax = held.forceMax;
  }
  return p;
}

// A tool that stays where it is goes on with the force that it had: on a skin that lies on something, whose contacts
// answer a substep late, it would take several substeps to come to it again.
void carryLoadForces(WorldData& d, const Loads& loads) {
  std::vector<Vector3d>& before = d.loadForcesBefore;
  std::swap(before, d.loadForces);
  if (before.empty()) std::fill(d.contact.change.begin(), d.contact.change.end(), MomentumChange{});
  d.loadForces.assign(loads.toolSprings.size() + loads.heldNodes.size(), Vector3d::Zero());
  auto next = d.settling.begin();  // behind the last one that was found: nearly always the one that is asked for
  for (std::size_t k = 0; k < d.loadForces.size(); ++k) {
    const PointSpring now = pointSpring(d, loads, k, 0);
    const auto isSame = [&](const SettlingSpring& s) {
      return s.spring.tool == now.tool && s.spring.count == now.count && s.spring.nodes == now.nodes;
    };
    const bool follows = next != d.settling.end() && isSame(*next);
    const auto same = follows ? next : std::find_if(d.settling.begin(), d.settling.end(), isSame);
    if (same == d.settling.end()) continue;
    const auto j = static_cast<std::size_t>(same - d.settling.begin());
    if (j < before.size()) d.loadForces[k] = before[j];
    next = same + 1;
  }
}

void applyLoads(WorldData& d, const Loads& loads, double remaining, std::vector<Vector3d>& toolImpulse) {
  // Loads on different masses settle in one pass; loads that share a node or a sphere converge by a factor of 2 or
  // better per pass, and the rest is taken up in the next substep.
  constexpr int kPasses = 20;
  constexpr double kUnchanged = 1e-12;  // of the largest force
  const std::size_t count = loads.toolSprings.size() + loads.heldNodes.size();
  assert(d.loadForces.size() == count);
  d.settling.resize(count);
  // From the forces of the substep before: in a body at rest they are the answer already, and what few passes leave
  // open settles over the substeps.
  for (std::size_t k = 0; k < count; ++k) {
    prepare(d, pointSpring(d, loads, k, remaining), d.settling[k]);
    addImpulse(d, d.settling[k], d.substep * d.loadForces[k]);
  }
  for (int pass = 0; pass < kPasses; ++pass) {
    double change = 0, largest = 0;
    for (std::size_t k = 0; k < count; ++k) {
      change = std::max(change, settle(d, d.settling[k], d.loadForces[k]));
      largest = std::max(largest, d.loadForces[k].norm());
    }
    if (!(change > kUnchanged * largest)) break;
  }
  for (std::size_t k = 0; k < count; ++k) toolImpulse[d.settling[k].spring.tool] += d.substep * d.loadForces[k];
}

}  // namespace medulla
