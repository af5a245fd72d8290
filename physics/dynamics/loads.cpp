#include "physics/dynamics/loads.h"

#include <fmt/format.h>

#include <cassert>
#include <cmath>
#include <cstddef>
#include <stdexcept>

#include "physics/dynamics/anchor.h"
#include "physics/dynamics/node_motion.h"
#include "physics/dynamics/point_spring.h"
#include "physics/dynamics/stages.h"

// Springs between tools and surface nodes. A node weighs tens of milligrams and a virtual coupling has hundreds of N/m
// and up to 1 N s/m: explicitly that needs substeps of 0.05 ms. Each load therefore solves
//   f = k (a - x - h v) + c (a' - v)
// with the velocity v that all other forces *and f itself* leave at the substep's end. Rejected: raising the number of
// substeps while a tool touches (6 times the cost, and a step that depends on the tool).
namespace medulla {

namespace {

using Eigen::Vector3d;

void add(Quad& q, const Vector3d& a) {
  for (int k = 0; k < 3; ++k) q.v[k] += a[k];
}

// Angular velocity after stepVelocities: new momentum, orientation of the substep's beginning.
Vector3d angularVelocity(const WorldData& d, int sphere) {
  const Eigen::Matrix3d r = quaternionOf(d.spheres.orientation[sphere]).toRotationMatrix();
  return r * (inverseInertiaOf(d.spheres.groups[sphere / 4], sphere % 4) *
              (r.transpose() * vectorOf(d.spheres.angularMomentum[sphere])));
}

void addImpulse(WorldData& d, int sphere, const Vector3d& linear, const Vector3d& angular) {
  const SphereGroup& g = d.spheres.groups[sphere / 4];
  add(d.spheres.velocity[sphere], g.inverseMass[sphere % 4] * linear);
  add(d.spheres.angularMomentum[sphere], g.freeToTurn[sphere % 4] * angular);
}

SphereMotion motionOf(const WorldData& d, int sphere) {
  return {vectorOf(d.spheres.velocity[sphere]), angularVelocity(d, sphere)};
}

Vector3d nodeVelocity(const WorldData& d, int node) {
  if (!isSkin(d, node)) return vectorAt(d.nodes.velocity, node);
  const GroupHost host = d.nodes.groupHosts[node / 4];
  if (host.onLink) {
    const LinkPoint p = linkPoint(d, host.host, node);
    return velocityOf(p, motionOf(d, p.sphere0), motionOf(d, p.sphere1));
  }
  return vectorOf(d.spheres.velocity[host.host]) +
         angularVelocity(d, host.host).cross(sphereOffset(d, host.host, node));
}

void addNodeImpulse(WorldData& d, int node, const Vector3d& impulse) {
  if (!isSkin(d, node)) {
    setVector(d.nodes.velocity, node, vectorAt(d.nodes.velocity, node) + d.nodes.inverseMass[node] * impulse);
    return;
  }
  const GroupHost host = d.nodes.groupHosts[node / 4];
  if (host.onLink) {
    const LinkPoint p = linkPoint(d, host.host, node);
    const auto [at0, at1] = loadsOf(p, impulse);
    addImpulse(d, p.sphere0, at0.linear, at0.angular);
    addImpulse(d, p.sphere1, at1.linear, at1.angular);
  } else {
    addImpulse(d, host.host, impulse, sphereOffset(d, host.host, node).cross(impulse));
  }
}

// The square of a matrix' largest stretch is not more than its largest row's sum times its largest column's.
double stretchBound(const Eigen::Matrix3d& m) {
  return m.cwiseAbs().rowwise().sum().maxCoeff() * m.cwiseAbs().colwise().sum().maxCoeff();
}

// 1/kg: velocity per impulse at the node; exact on masses, an upper bound on skin, where it only steers convergence.
double mobility(const WorldData& d, int node) {
  if (!isSkin(d, node)) return d.nodes.inverseMass[node];
  const GroupHost host = d.nodes.groupHosts[node / 4];
  const auto ofSphere = [&](int sphere, double linear, double angular) {
    const SphereGroup& g = d.spheres.groups[sphere / 4];
    const int l = sphere % 4;
    const double turning = g.inverseInertia[0][l] + g.inverseInertia[1][l] + g.inverseInertia[2][l];
    return g.inverseMass[l] * linear + g.freeToTurn[l] * turning * angular;
  };
  if (!host.onLink) return ofSphere(host.host, 1, sphereOffset(d, host.host, node).squaredNorm());
  const LinkPoint p = linkPoint(d, host.host, node);
  const auto bound = [&p](int row) { return stretchBound(p.loads.middleRows<3>(row)); };
  return ofSphere(p.sphere0, bound(0), bound(3)) + ofSphere(p.sphere1, bound(6), bound(9));
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
    p.outward = &t.outward;
    p.stiffness = t.stiffness;
    p.damping = t.damping;
  } else {
    const HeldNode& held = loads.heldNodes[k - loads.toolSprings.size()];
    p.count = 1;
    p.tool = held.tool;
    p.nodes[0] = d.ranges[held.body].node[held.node];
    p.weights[0] = 1;
    p.anchor = held.anchor - remaining * held.anchorVelocity;
    p.anchorVelocity = held.anchorVelocity;
    p.stiffness = held.stiffness;
    p.damping = held.damping;
  }
  return p;
}

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
  const std::size_t count = loads.toolSprings.size() + loads.heldNodes.size();
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
    toolImpulse[pointSpring(d, loads, k, remaining).tool] += d.substep * d.loadForces[k];
}

}  // namespace medulla
