#include "physics/dynamics/loads.h"

#include <fmt/format.h>

#include <cassert>
#include <cmath>
#include <cstddef>
#include <stdexcept>

#include "physics/dynamics/anchor.h"
#include "physics/dynamics/stages.h"

// Springs between tools and surface nodes. A node weighs tens of milligrams and a virtual coupling has hundreds of N/m
// and up to 1 N s/m: explicitly that needs substeps of 0.05 ms. Each load therefore solves
//   f = k (a - x - h v) + c (a' - v)
// with the velocity v that all other forces *and f itself* leave at the substep's end. Rejected: raising the number of
// substeps while a tool touches (6 times the cost, and a step that depends on the tool).
namespace medulla {

namespace {

using Eigen::Vector3d;

Vector3d lane(const Lanes3& a, int l) {
  return vectorOf(a, l);
}
void add(Quad& q, const Vector3d& a) {
  for (int k = 0; k < 3; ++k) q.v[k] += a[k];
}

// Angular velocity after stepVelocities: new momentum, orientation of the substep's beginning.
Vector3d angularVelocity(const WorldData& d, int sphere) {
  const Quad& q = d.spheres.orientation[sphere];
  const Eigen::Matrix3d r = Eigen::Quaterniond(q.v[3], q.v[0], q.v[1], q.v[2]).toRotationMatrix();
  const Lanes* i = d.spheres.groups[sphere / 4].inverseInertia;
  const int l = sphere % 4;
  Eigen::Matrix3d inverse;
  inverse << i[0][l], i[3][l], i[4][l], i[3][l], i[1][l], i[5][l], i[4][l], i[5][l], i[2][l];
  return r * (inverse * (r.transpose() * vectorOf(d.spheres.angularMomentum[sphere])));
}

void addImpulse(WorldData& d, int sphere, const Vector3d& linear, const Vector3d& angular) {
  const SphereGroup& g = d.spheres.groups[sphere / 4];
  add(d.spheres.velocity[sphere], g.inverseMass[sphere % 4] * linear);
  add(d.spheres.angularMomentum[sphere], g.freeToTurn[sphere % 4] * angular);
}

// A skin node on a link: the anchor's velocity as a linear map of the two spheres' velocities, and its transpose.
struct LinkPoint {
  int sphere0, sphere1;
  double s, inverseLength;
  double thicknessSlope;
  Vector3d offset, n, axis0, axis1, lever0, lever1, arm0, arm1;
};

LinkPoint linkPoint(const WorldData& d, int link, int node) {
  const LinkFrame& f = d.links.frames[link / 4];
  const LinkGroup& g = d.links.groups[link / 4];
  const NodeGroup& group = d.nodes.groups[node / 4];
  const int l = link % 4;
  LinkPoint p;
  p.sphere0 = static_cast<int>(g.sphere0[l]);
  p.sphere1 = static_cast<int>(g.sphere1[l]);
  p.s = group.along[node % 4];
  p.inverseLength = f.inverseLength[l];
  p.offset = lane(anchorOnLink(linkHost(d, link), group).offset, node % 4);
  p.n = lane(f.n, l);
  p.axis0 = lane(f.spinAxis0, l);
  p.axis1 = lane(f.spinAxis1, l);
  p.lever0 = lane(f.spinLever0, l);
  p.lever1 = lane(f.spinLever1, l);
  p.thicknessSlope = f.thicknessSlope[l];
  p.arm0 = lane(f.arm0, l);
  p.arm1 = lane(f.arm1, l);
  return p;
}

Vector3d velocityOf(const WorldData& d, const LinkPoint& p) {
  const Vector3d omega0 = angularVelocity(d, p.sphere0), omega1 = angularVelocity(d, p.sphere1);
  const Vector3d v0 = vectorOf(d.spheres.velocity[p.sphere0]) + omega0.cross(p.arm0);
  const Vector3d line = vectorOf(d.spheres.velocity[p.sphere1]) + omega1.cross(p.arm1) - v0;
  const Vector3d nRate = p.inverseLength * (line - p.n * p.n.dot(line));
  const double spin0 = p.axis0.dot(omega0) - p.lever0.dot(nRate);
  const double spin1 = p.axis1.dot(omega1) - p.lever1.dot(nRate);
  const Vector3d omega = p.n.cross(nRate) + ((1 - p.s) * spin0 + p.s * spin1) * p.n;
  return v0 + p.s * line + omega.cross(p.offset) + p.thicknessSlope * p.n.dot(line) * p.offset;
}

void addImpulse(WorldData& d, const LinkPoint& p, const Vector3d& impulse) {
  const Vector3d moment = p.offset.cross(impulse);
  const double twist0 = (1 - p.s) * p.n.dot(moment), twist1 = p.s * p.n.dot(moment);
  const Vector3d along = p.thicknessSlope * p.offset.dot(impulse) * p.n;
  const Vector3d swing = p.inverseLength * (moment.cross(p.n) - twist0 * p.lever0 - twist1 * p.lever1) + along;
  const Vector3d at0 = (1 - p.s) * impulse - swing, at1 = p.s * impulse + swing;
  addImpulse(d, p.sphere0, at0, twist0 * p.axis0 + p.arm0.cross(at0));
  addImpulse(d, p.sphere1, at1, twist1 * p.axis1 + p.arm1.cross(at1));
}

bool isSkin(const WorldData& d, int node) {
  return node >= d.nodes.dynamicEnd;
}

Vector3d sphereOffset(const WorldData& d, int sphere, int node) {
  return lane(anchorOnSphere(sphereHost(d, sphere), d.nodes.groups[node / 4]).offset, node % 4);
}

Vector3d nodeVelocity(const WorldData& d, int node) {
  if (!isSkin(d, node)) return vectorOf(d.nodes.velocity[node]);
  const GroupHost host = d.nodes.groupHosts[node / 4];
  if (host.onLink) return velocityOf(d, linkPoint(d, host.host, node));
  return vectorOf(d.spheres.velocity[host.host]) +
         angularVelocity(d, host.host).cross(sphereOffset(d, host.host, node));
}

Vector3d nodePosition(const WorldData& d, int node) {
  if (!isSkin(d, node)) return vectorOf(d.nodes.position[node]);
  const GroupHost host = d.nodes.groupHosts[node / 4];
  const NodeGroup& group = d.nodes.groups[node / 4];
  const Anchor anchor =
      host.onLink ? anchorOnLink(linkHost(d, host.host), group) : anchorOnSphere(sphereHost(d, host.host), group);
  return lane(positionOf(anchor), node % 4);
}

void addNodeImpulse(WorldData& d, int node, const Vector3d& impulse) {
  if (!isSkin(d, node)) {
    add(d.nodes.velocity[node], d.nodes.inverseMass[node] * impulse);
    return;
  }
  const GroupHost host = d.nodes.groupHosts[node / 4];
  if (host.onLink) {
    addImpulse(d, linkPoint(d, host.host, node), impulse);
  } else {
    addImpulse(d, host.host, impulse, sphereOffset(d, host.host, node).cross(impulse));
  }
}

// 1/kg: velocity per impulse at the node; exact on masses, an upper bound on skin, where it only steers convergence.
double mobility(const WorldData& d, int node) {
  if (!isSkin(d, node)) return d.nodes.inverseMass[node];
  const GroupHost host = d.nodes.groupHosts[node / 4];
  const auto ofSphere = [&](int sphere, double lever2) {
    const SphereGroup& g = d.spheres.groups[sphere / 4];
    const int l = sphere % 4;
    const double turning = g.inverseInertia[0][l] + g.inverseInertia[1][l] + g.inverseInertia[2][l];
    return g.inverseMass[l] + g.freeToTurn[l] * turning * lever2;
  };
  if (!host.onLink) return ofSphere(host.host, sphereOffset(d, host.host, node).squaredNorm());
  const LinkPoint p = linkPoint(d, host.host, node);
  const double lever2 = (p.offset.norm() + std::max(p.arm0.norm(), p.arm1.norm())) *
                        (p.offset.norm() + std::max(p.arm0.norm(), p.arm1.norm()));
  const double lean = 1 + lever2 * p.inverseLength * p.inverseLength;
  return lean * (ofSphere(p.sphere0, lever2) + ofSphere(p.sphere1, lever2));
}

// The common form of both kinds of load.
struct PointSpring {
  int count;
  std::array<int, 3> nodes;  // indices in Nodes
  std::array<double, 3> weights;
  Vector3d anchor, anchorVelocity;  // at the substep's end
  const Vector3d* outward;          // null: pulls and pushes
  double stiffness, damping;
};

PointSpring pointSpring(const WorldData& d, const Loads& loads, std::size_t k, double remaining) {
  PointSpring p{};
  if (k < loads.toolSprings.size()) {
    const ToolSpring& t = loads.toolSprings[k];
    p.count = 3;
    for (int i = 0; i < 3; ++i) p.nodes[i] = d.ranges[t.body].node[t.nodes[i]];
    p.weights = t.weights;
    p.anchor = t.anchor - remaining * t.anchorVelocity;
    p.anchorVelocity = t.anchorVelocity;
    p.outward = &t.outward;
    p.stiffness = t.stiffness;
    p.damping = t.damping;
  } else {
    const HeldNode& held = loads.heldNodes[k - loads.toolSprings.size()];
    p.count = 1;
    p.nodes[0] = d.ranges[held.body].node[held.node];
    p.weights[0] = 1;
    p.anchor = held.anchor - remaining * held.anchorVelocity;
    p.anchorVelocity = held.anchorVelocity;
    p.stiffness = held.stiffness;
    p.damping = held.damping;
  }
  return p;
}

// One pass of Gauss-Seidel at one load: its force goes to what the spring asks for now. Returns the change's size.
double settle(WorldData& d, const PointSpring& p, Vector3d& force) {
  const double h = d.substep;
  Vector3d x = Vector3d::Zero(), v = Vector3d::Zero();
  double ofMasses = 0, rootOfSkin = 0;
  for (int i = 0; i < p.count; ++i) {
    const double w = p.weights[i];
    x += w * nodePosition(d, p.nodes[i]);
    v += w * nodeVelocity(d, p.nodes[i]);
    const double m = mobility(d, p.nodes[i]);
    if (isSkin(d, p.nodes[i])) {
      rootOfSkin += std::abs(w) * std::sqrt(m);
    } else {
      ofMasses += w * w * m;
    }
  }
  const double gain = p.stiffness * h * h + p.damping * h;
  const Vector3d wanted = p.stiffness * (p.anchor - x - h * v) + p.damping * (p.anchorVelocity - v);
  Vector3d next = force + (wanted - force) / (1 + gain * (ofMasses + rootOfSkin * rootOfSkin));
  if (p.outward != nullptr) next -= std::max(0.0, next.dot(*p.outward)) * *p.outward;
  const Vector3d change = next - force;
  for (int i = 0; i < p.count; ++i) addNodeImpulse(d, p.nodes[i], h * p.weights[i] * change);
  force = next;
  return change.norm();
}

}  // namespace

std::vector<DeadLoad> spreadLoad(const SoftBodyModel& model, const std::vector<int>& nodes, const DeadLoad& whole) {
  double area = 0;
  for (const int node : nodes) area += model.attachments[node].area;
  std::vector<DeadLoad> out;
  for (const int node : nodes) {
    out.push_back(whole);
    out.back().node = node;
    out.back().force *= model.attachments[node].area / area;
  }
  return out;
}

void layOutDeadLoads(WorldData& d) {
  for (std::size_t b = 0; b < d.bodies.size(); ++b) {
    const std::vector<int>& node = d.ranges[b].node;
    for (const DeadLoad& load : d.bodies[b].deadLoads) {
      const auto require = [&](bool condition, const std::string& message) {
        if (!condition)
          throw std::runtime_error(fmt::format("body '{}' cannot be simulated: {}", d.bodies[b].name, message));
      };
      require(load.node >= 0 && load.node < static_cast<int>(node.size()),
              fmt::format("it loads node {}: expected 0 to {}", load.node, node.size() - 1));
      require(load.force.allFinite(), fmt::format("the load on its node {} is not finite", load.node));
      require(std::isfinite(load.from) && std::isfinite(load.to) && load.from <= load.to,
              fmt::format("the load on its node {} grows from {} s to {} s: expected the earlier time first", load.node,
                          load.from, load.to));
      d.deadLoads.push_back({node[load.node], load.force, load.from, load.to});
    }
  }
}

// A constant force bounds no step: explicit, and by the same way to the hosts of a skin as the tools' forces.
void applyDeadLoads(WorldData& d, double time) {
  for (const NodeForce& load : d.deadLoads) {
    if (time < load.from) continue;
    const double share = time < load.to ? (time - load.from) / (load.to - load.from) : 1;
    addNodeImpulse(d, load.node, d.substep * share * load.force);
  }
}

void applyLoads(WorldData& d, const Loads& loads, double remaining, std::vector<Vector3d>& toolImpulse) {
  // Loads on different masses settle in one pass; loads that share a node or a sphere converge by a factor of 2 or
  // better per pass, and the rest is taken up in the next substep.
  constexpr int kPasses = 20;
  constexpr double kSettled = 1e-12;  // of the largest force
  const std::size_t springs = loads.toolSprings.size(), count = springs + loads.heldNodes.size();
  assert(d.loadForces.size() == count);
  // From the forces of the substep before: in a body at rest they are the answer already, and what few passes leave
  // open settles over the substeps.
  for (std::size_t k = 0; k < count; ++k) {
    const PointSpring p = pointSpring(d, loads, k, remaining);
    for (int i = 0; i < p.count; ++i) addNodeImpulse(d, p.nodes[i], d.substep * p.weights[i] * d.loadForces[k]);
  }
  for (int pass = 0; pass < kPasses; ++pass) {
    double change = 0, largest = 0;
    for (std::size_t k = 0; k < count; ++k) {
      change = std::max(change, settle(d, pointSpring(d, loads, k, remaining), d.loadForces[k]));
      largest = std::max(largest, d.loadForces[k].norm());
    }
    if (!(change > kSettled * largest)) break;
  }
  for (std::size_t k = 0; k < count; ++k)
    toolImpulse[k < springs ? loads.toolSprings[k].tool : loads.heldNodes[k - springs].tool] +=
        d.substep * d.loadForces[k];
}

}  // namespace medulla
