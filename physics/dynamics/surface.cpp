#include <algorithm>
#include <cstddef>

#include "physics/dynamics/anchor.h"
#include "physics/dynamics/edge_springs.h"
#include "physics/dynamics/identified_stages.h"
#include "physics/dynamics/stages.h"

// The surface (paper 2.3): point masses on the nodes, springs on the edges, damped attachments to the skeleton.
namespace medulla {

namespace {

// Pull of the anchors on the four nodes of group g: the springs' along the stretch, the dampers' against the point of
// the carrying frame where the node *is*; against the anchor the pair would exert a couple on a free body. `volume`
// grows by what lies between anchors and nodes.
MEDULLA_INLINE void pullNodes(Nodes& n, Lanes relaxation, const NodeGroup& group, const Anchor& anchor, int g,
                              Lanes& volume) {
  const Lanes3 lever = n.position[g] - anchor.base;
  const Lanes3 rate = velocityAt(anchor, lever) - n.velocity[g];
  const Lanes3 displaced = lever - anchor.offset, damper = (group.stiffness * relaxation) * rate;
  volume = fma(displaced.x, anchor.area.x, fma(displaced.y, anchor.area.y, fma(displaced.z, anchor.area.z, volume)));
  put(fnma(group.stiffness, displaced, damper), n.force[g]);
  put(anchor.offset, n.offset[g]);
  put(anchor.area, n.area[g]);
  storeFour(displaced, n.displaced, 4 * g);
}

// `visit` with the link, written once for beams and once for springs: which it is, no loop then asks.
template <class Visit>
MEDULLA_INLINE void visitLink(const WorldData& d, int link, const Visit& visit) {
  LinkHost host = linkHost(d, link);
  if (host.isBeam) {
    host.isBeam = true;  // tells the compiler that it is constant here: the inlined loop does not test it
    visit(host);
  } else {
    host.isBeam = false;
    visit(host);
  }
}

void pullOnLink(WorldData& d, const HostRange& range) {
  visitLink(
      d, range.host, [&](const LinkHost& host) __attribute__((always_inline)) {
        const NodeGroup* constants = constantsOf(d.nodes, range);
        const Lanes relaxation = splat(range.relaxation);
        Lanes volume = splat(0);
        for (int g = range.firstGroup; g < range.endGroup; ++g)
          pullNodes(d.nodes, relaxation, constants[g], anchorOnLink(host, constants[g]), g, volume);
        d.nodes.swollen[range.part] = sumOfLanes(volume);
      });
}

void pullOnSphere(WorldData& d, const HostRange& range) {
  const SphereHost host = sphereHost(d, range.host);
  const NodeGroup* constants = constantsOf(d.nodes, range);
  const Lanes relaxation = splat(range.relaxation);
  Lanes volume = splat(0);
  for (int g = range.firstGroup; g < range.endGroup; ++g)
    pullNodes(d.nodes, relaxation, constants[g], anchorOnSphere(host, constants[g]), g, volume);
  d.nodes.swollen[range.part] = sumOfLanes(volume);
}

double pressureOf(const WorldData& d, const HostRange& r) {
  return std::clamp(r.bulk * d.nodes.swollen[r.part], -r.largestPressure, r.largestPressure);
}

struct NodeForces {
  Lanes3 force;  // N, on the nodes
  Lanes3 turn;   // N m, their moment about the anchors' bases as the host feels it
};

// Finishes the forces on the nodes of group g. The edges' springs answer to what their two nodes are displaced from
// their anchors one against the other, in all directions. Springs on the edges' lengths have no stiffness of first
// order across a flat surface, so that a dent would end at the touched nodes, and they would stiffen the whole body: a
// bar of 10 mm radius by a fifth. The host's pressure presses nodes along areas: energy bulk / 2 (sum area .
// displaced)^2. The host bears all forces at the anchors, and where it turns: springs pull along the lever from anchor
// to node and turn nothing, dampers act at the node, and so do the areas, which turn with the host; edges act at the
// anchors.
MEDULLA_INLINE NodeForces finishForces(WorldData& d, const EdgePull& edgePull, Lanes pressure, int g) {
  Nodes& n = d.nodes;
  const Lanes3 displaced = gatherFour(n.displaced, 4 * g);
  const Lanes3 edges = edgePull.at(g, displaced);
  NodeForces out;
  out.force = fnma(pressure, n.area[g], n.force[g] + edges);
  out.turn = cross(n.offset[g] + displaced, out.force) - cross(displaced, edges);
  put(out.force, n.force[g]);
  return out;
}

void returnToLink(WorldData& d, const HostRange& range) {
  visitLink(
      d, range.host, [&](const LinkHost& host) __attribute__((always_inline)) {
        AnchorLoads sum = noLoads();
        const Lanes pressure = splat(pressureOf(d, range));
        const NodeGroup* constants = constantsOf(d.nodes, range);
        const EdgePull edgePull(d, range);
        for (int g = range.firstGroup; g < range.endGroup; ++g) {
          const NodeForces on = finishForces(d, edgePull, pressure, g);
          addLoads(host, constants[g], d.nodes.offset[g], on.force, on.turn, sum);
        }
        setLoads(host, sum, d.links.loads[range.host]);
      });
}

void returnToSphere(WorldData& d, const HostRange& range) {
  Lanes3 sum = zeroVectors(), moment = sum;
  const Lanes pressure = splat(pressureOf(d, range));
  const EdgePull edgePull(d, range);
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const NodeForces on = finishForces(d, edgePull, pressure, g);
    sum = sum + on.force;
    moment = moment + on.turn;
  }
  Quad &force = d.spheres.force[range.host], &torque = d.spheres.torque[range.host];
  store(force, load(force) - sumOfLanes(sum));
  store(torque, load(torque) - sumOfLanes(moment));
}

}  // namespace

void evaluateAttachments(WorldData& d, const Batch& batch) {
  startSphereForces(d, batch);
  for (const HostRange& range : batch.onLinks) pullOnLink(d, range);
  for (const HostRange& range : batch.onSpheres) range.onFrames ? pullOnFrames(d, range) : pullOnSphere(d, range);
}

void finishNodeForces(WorldData& d, const Batch& batch) {
  for (const HostRange& range : batch.onLinks) returnToLink(d, range);
  for (const HostRange& range : batch.onSpheres)
    range.onFrames ? returnToFrames(d, range, splat(pressureOf(d, range))) : returnToSphere(d, range);
}

double surfaceEnergy(const WorldData& d, std::vector<double>* ofBodies) {
  double sum = 0;
  const auto add = [&](double energy, int body) {
    sum += energy;
    if (ofBodies != nullptr) (*ofBodies)[body] += energy;
  };
  for (int i = 0; i < d.nodes.dynamicEnd; ++i) {
    const Eigen::Vector3d own = vectorOf(d.nodes.displaced[i]);
    const int body = d.nodes.groupHosts[i / 4].body;
    add(0.5 * d.nodes.groups[i / 4].stiffness[i % 4] * own.squaredNorm() + normalEnergy(d, i), body);
    for (int e = d.springs.first[i / 4]; e < d.springs.first[i / 4 + 1]; ++e) {
      const SpringGroup& s = d.springs.groups[e];  // half of each spring here, half at its other node
      const Eigen::Vector3d other = vectorOf(d.nodes.displaced[s.other[i % 4] / sizeof(Quad)]);
      add(0.25 * s.stiffness[i % 4] * (other - own).squaredNorm(), body);
    }
  }
  for (std::size_t k = 0; k < d.surface.parts.size(); ++k) {
    const HostRange r = movingRange(d, k);
    const double pressure = pressureOf(d, r);
    if (pressure != 0) add(pressure * d.nodes.swollen[r.part] - 0.5 * pressure * pressure / r.bulk, r.body);
  }
  return sum;
}

}  // namespace medulla
