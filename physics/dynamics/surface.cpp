#include <algorithm>
#include <cstddef>
#include <vector>

#include "physics/dynamics/anchor.h"
#include "physics/dynamics/stages.h"

// The surface (paper 2.3): point masses on the nodes, damped springs on the edges, elastic attachments to the skeleton.
namespace medulla {

namespace {

const Quad& at(const Quad* quads, std::uint32_t byteOffset) {
  return *reinterpret_cast<const Quad*>(reinterpret_cast<const char*>(quads) + byteOffset);
}
Quad& at(Quad* quads, std::uint32_t byteOffset) {
  return *reinterpret_cast<Quad*>(reinterpret_cast<char*>(quads) + byteOffset);
}

Lanes3 gatherNodes(const std::vector<Quad>& q, int i) {
  return gather(q[i], q[i + 1], q[i + 2], q[i + 3]);
}

void storeNodes(const Lanes3& v, std::vector<Quad>& q, int i) {
  Lanes a = v.x, b = v.y, c = v.z, d = splat(0);
  transpose(a, b, c, d);
  store(q[i], a);
  store(q[i + 1], b);
  store(q[i + 2], c);
  store(q[i + 3], d);
}

// Pull of the anchors on the four nodes of group g: the springs' along the stretch, the dampers' against the point of
// the carrying frame where the node *is*; against the anchor the pair would exert a couple on a free body. The host
// bears all forces on its nodes at the anchors (returnNodeForces()); `moment` is what the dampers' lever adds to that.
// `swollen` grows by the volume between anchors and nodes.
MEDULLA_INLINE Lanes3 pullNodes(Nodes& n, Lanes relaxation, const NodeGroup& group, const Anchor& anchor, int g,
                                Lanes& swollen) {
  const Lanes3 lever = gatherNodes(n.position, 4 * g) - anchor.base;
  const Lanes3 rate = velocityAt(anchor, lever) - gatherNodes(n.velocity, 4 * g);
  const Lanes3 displaced = lever - anchor.offset, damper = (group.stiffness * relaxation) * rate;
  swollen = fma(group.area, dot(anchor.normal, displaced), swollen);
  storeNodes(fnma(group.stiffness, displaced, damper), n.force, 4 * g);
  storeNodes(displaced, n.displaced, 4 * g);
  n.offset[g] = anchor.offset;
  n.normal[g] = anchor.normal;
  return cross(displaced, damper);
}

// Adds sums over a link's nodes to its frame.
void addLoads(LinkFrame& f, int lane, Lanes sumAndTwist, Lanes alongAndThickness, Lanes moment) {
  const auto add = [lane](Lanes3& to, Lanes from) {
    to.x[lane] += from[0];
    to.y[lane] += from[1];
    to.z[lane] += from[2];
  };
  add(f.loadSum, sumAndTwist);
  add(f.loadAlong, alongAndThickness);
  add(f.loadMoment, moment);
  f.loadTwist[lane] += sumAndTwist[3];
  f.loadThickness[lane] += alongAndThickness[3];
}

void pullOnLink(WorldData& d, const HostRange& range) {
  const LinkHost host = linkHost(d, range.host);
  const Lanes zero = splat(0), relaxation = splat(range.relaxation);
  Lanes3 moment{zero, zero, zero};
  Lanes twist = zero, swollen = zero;
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const NodeGroup& group = d.nodes.groups[g];
    const Lanes3 turn = pullNodes(d.nodes, relaxation, group, anchorOnLink(host, group), g, swollen);
    moment = moment + turn;
    twist = fma(group.twistShare, dot(host.n, turn), twist);
  }
  d.ranges[range.body].swollen += sumOfLanes(swollen);
  const Lanes total = sumOfLanes(moment, twist);
  addLoads(d.links.frames[range.host / 4], range.host % 4, Lanes{0, 0, 0, total[3]}, zero, total);
}

void pullOnSphere(WorldData& d, const HostRange& range) {
  const SphereHost host = sphereHost(d, range.host);
  const Lanes zero = splat(0), relaxation = splat(range.relaxation);
  Lanes3 moment{zero, zero, zero};
  Lanes swollen = zero;
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const NodeGroup& group = d.nodes.groups[g];
    moment = moment + pullNodes(d.nodes, relaxation, group, anchorOnSphere(host, group), g, swollen);
  }
  d.ranges[range.body].swollen += sumOfLanes(swollen);
  store(d.spheres.torque[range.host], zero - sumOfLanes(moment, zero));
}

// Linear in the volume between anchors and nodes, up to a tenth of the body's: inside out it would be any number.
double pressureOf(const BodyRange& r, double swollen) {
  constexpr double kMost = 0.1;
  return r.bulk * std::clamp(swollen, -kMost * r.restVolume, kMost * r.restVolume);
}

// The energy bulk / 2 (sum area normal . displaced)^2 presses the nodes along the normals, which the hosts carry: the
// moment that turns a normal is what the force's lever from anchor to node lacks. Adds it to `moment` and the pressure
// to the nodes' forces; returns these whole.
MEDULLA_INLINE Lanes3 pressNodes(Nodes& n, Lanes pressure, int g, Lanes3& moment) {
  const Lanes3 push = (pressure * n.groups[g].area) * n.normal[g];
  const Lanes3 force = gatherNodes(n.force, 4 * g) - push;
  storeNodes(force, n.force, 4 * g);
  moment = moment - cross(gatherNodes(n.displaced, 4 * g), push);
  return force;
}

void returnToLink(WorldData& d, const HostRange& range) {
  LinkFrame& f = d.links.frames[range.host / 4];
  const int lane = range.host % 4;
  const Lanes3 n = splatLane(f.n, lane);
  const Lanes zero = splat(0);
  Lanes3 sum{zero, zero, zero}, along = sum, moment = sum;
  Lanes twist = zero, thickness = zero;
  const Lanes pressure = splat(pressureOf(d.ranges[range.body], d.ranges[range.body].swollen));
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const Lanes s = d.nodes.groups[g].along;
    const Lanes3& offset = d.nodes.offset[g];
    Lanes3 turn{zero, zero, zero};
    const Lanes3 force = pressNodes(d.nodes, pressure, g, turn);
    turn = turn + cross(offset, force);
    sum = sum + force;
    along = fma(s, force, along);
    moment = moment + turn;
    twist = fma(d.nodes.groups[g].twistShare, dot(n, turn), twist);
    thickness = thickness + dot(offset, force);
  }
  addLoads(f, lane, sumOfLanes(sum, twist), sumOfLanes(along, thickness), sumOfLanes(moment, zero));
}

void returnToSphere(WorldData& d, const HostRange& range) {
  const Lanes zero = splat(0);
  Lanes3 sum{zero, zero, zero}, moment = sum;
  const Lanes pressure = splat(pressureOf(d.ranges[range.body], d.ranges[range.body].swollen));
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const Lanes3 force = pressNodes(d.nodes, pressure, g, moment);
    sum = sum + force;
    moment = moment + cross(d.nodes.offset[g], force);
  }
  Quad& torque = d.spheres.torque[range.host];
  store(d.spheres.force[range.host], zero - sumOfLanes(sum, zero));
  store(torque, load(torque) - sumOfLanes(moment, zero));
}

}  // namespace

void evaluateAttachments(WorldData& d) {
  const Lanes zero = splat(0);
  for (std::size_t i = 0; i < d.spheres.force.size(); ++i) {
    store(d.spheres.force[i], zero);
    store(d.spheres.torque[i], zero);
  }
  for (BodyRange& r : d.ranges) r.swollen = 0;
  for (const HostRange& range : d.nodes.onLinks) pullOnLink(d, range);
  for (const HostRange& range : d.nodes.onSpheres) pullOnSphere(d, range);
}

// The edges' springs answer to what their two nodes are displaced from their anchors one against the other, in all
// directions. Springs on the edges' lengths have no stiffness of first order across a flat surface, so that a dent
// would end at the touched nodes, and they would stiffen the whole body: a bar of 10 mm radius by a fifth.
void addEdgeSprings(WorldData& d) {
  const Quad* displaced = d.nodes.displaced.data();
  Quad* force = d.nodes.force.data();
  for (const SpringGroup& s : d.springs.groups) {
    for (int k = 0; k < 4; ++k) {
      const std::uint32_t node0 = s.node0[k], node1 = s.node1[k];
      const Lanes pull = splat(s.stiffness[k]) * (load(at(displaced, node1)) - load(at(displaced, node0)));
      Quad &end0 = at(force, node0), &end1 = at(force, node1);
      store(end0, load(end0) + pull);
      store(end1, load(end1) - pull);
    }
  }
}

void returnNodeForces(WorldData& d) {
  for (const HostRange& range : d.nodes.onLinks) returnToLink(d, range);
  for (const HostRange& range : d.nodes.onSpheres) returnToSphere(d, range);
}

void placeSkin(WorldData& d) {
  const auto place = [&d](const Anchor& anchor, int g) {
    storeNodes(positionOf(anchor), d.nodes.position, 4 * g);
    storeNodes(velocityAt(anchor, anchor.offset), d.nodes.velocity, 4 * g);
  };
  for (const HostRange& range : d.nodes.skinOnLinks) {
    const LinkHost host = linkHost(d, range.host);
    for (int g = range.firstGroup; g < range.endGroup; ++g) place(anchorOnLink(host, d.nodes.groups[g]), g);
  }
  for (const HostRange& range : d.nodes.skinOnSpheres) {
    const SphereHost host = sphereHost(d, range.host);
    for (int g = range.firstGroup; g < range.endGroup; ++g) place(anchorOnSphere(host, d.nodes.groups[g]), g);
  }
}

double surfaceEnergy(const WorldData& d) {
  double sum = 0;
  std::vector<double> swollen(d.ranges.size(), 0);
  std::vector<Eigen::Vector3d> displaced(d.nodes.position.size());
  const auto add = [&](const Anchor& anchor, int g, int body) {
    const NodeGroup& group = d.nodes.groups[g];
    const Lanes3 stretch = gatherNodes(d.nodes.position, 4 * g) - positionOf(anchor);
    sum += 0.5 * sumOfLanes(group.stiffness * dot(stretch, stretch));
    swollen[body] += sumOfLanes(group.area * dot(anchor.normal, stretch));
    for (int k = 0; k < 4; ++k) displaced[4 * g + k] = vectorOf(stretch, k);
  };
  for (const HostRange& range : d.nodes.onLinks) {
    const LinkHost host = linkHost(d, range.host);
    for (int g = range.firstGroup; g < range.endGroup; ++g) add(anchorOnLink(host, d.nodes.groups[g]), g, range.body);
  }
  for (const HostRange& range : d.nodes.onSpheres) {
    const SphereHost host = sphereHost(d, range.host);
    for (int g = range.firstGroup; g < range.endGroup; ++g) add(anchorOnSphere(host, d.nodes.groups[g]), g, range.body);
  }
  for (std::size_t b = 0; b < swollen.size(); ++b) {
    const double pressure = pressureOf(d.ranges[b], swollen[b]);
    if (pressure != 0) sum += pressure * swollen[b] - 0.5 * pressure * pressure / d.ranges[b].bulk;
  }
  for (const SpringGroup& s : d.springs.groups)
    for (int k = 0; k < 4; ++k)
      sum += 0.5 * s.stiffness[k] *
             (displaced[s.node1[k] / sizeof(Quad)] - displaced[s.node0[k] / sizeof(Quad)]).squaredNorm();
  return sum;
}

}  // namespace medulla
