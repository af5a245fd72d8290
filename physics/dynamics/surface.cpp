#include <cstddef>

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

constexpr double kSmallestSquaredLength = 1e-30;  // m2; a spring whose ends coincide has no direction and pulls nowhere

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

// Pull of the anchors on the four nodes of group g; it begins the sum of their forces. The spring
// pulls along the stretch, so that its moment is the same whether it acts on the host at the anchor or at the node. The
// damper does not: it acts between the node and the point of the carrying frame where the node *is*, or the pair would
// exert a couple on a free body.
MEDULLA_INLINE void pullNodes(Nodes& n, Lanes relaxation, const NodeGroup& group, const Anchor& anchor, int g,
                              Lanes3& force, Lanes3& moment) {
  const Lanes3 lever = gatherNodes(n.position, 4 * g) - anchor.base;
  const Lanes3 rate = velocityAt(anchor, lever) - gatherNodes(n.velocity, 4 * g);
  force = group.stiffness * fma(relaxation, rate, anchor.offset - lever);
  storeNodes(force, n.force, 4 * g);
  moment = cross(lever, force);
}

void evaluateOnLink(WorldData& d, const HostRange& range) {
  const LinkHost host = linkHost(d, range.host);
  const Lanes zero = splat(0), relaxation = splat(range.relaxation);
  Lanes3 sum{zero, zero, zero}, along = sum, moment = sum;
  Lanes twist = zero;
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const NodeGroup& group = d.nodes.groups[g];
    Lanes3 pull, turn;
    pullNodes(d.nodes, relaxation, group, anchorOnLink(host, group), g, pull, turn);
    sum = sum + pull;
    along = fma(group.along, pull, along);
    moment = moment + turn;
    twist = fma(group.along, dot(host.n, turn), twist);
  }
  LinkFrame& f = d.links.frames[range.host / 4];
  const int lane = range.host % 4;
  const Lanes total = sumOfLanes(sum, twist), totalAlong = sumOfLanes(along, zero),
              totalMoment = sumOfLanes(moment, zero);
  const auto put = [lane](Lanes3& to, Lanes from) {
    to.x[lane] = from[0];
    to.y[lane] = from[1];
    to.z[lane] = from[2];
  };
  put(f.loadSum, total);
  put(f.loadAlong, totalAlong);
  put(f.loadMoment, totalMoment);
  f.loadTwist[lane] = total[3];
}

void evaluateOnSphere(WorldData& d, const HostRange& range) {
  const SphereHost host = sphereHost(d, range.host);
  const Lanes zero = splat(0), relaxation = splat(range.relaxation);
  Lanes3 sum{zero, zero, zero}, moment = sum;
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const NodeGroup& group = d.nodes.groups[g];
    Lanes3 pull, turn;
    pullNodes(d.nodes, relaxation, group, anchorOnSphere(host, group), g, pull, turn);
    sum = sum + pull;
    moment = moment + turn;
  }
  store(d.spheres.force[range.host], zero - sumOfLanes(sum, zero));
  store(d.spheres.torque[range.host], zero - sumOfLanes(moment, zero));
}

}  // namespace

void evaluateAttachments(WorldData& d) {
  const Lanes zero = splat(0);
  for (std::size_t i = 0; i < d.spheres.force.size(); ++i) {
    store(d.spheres.force[i], zero);
    store(d.spheres.torque[i], zero);
  }
  for (const HostRange& range : d.nodes.onLinks) evaluateOnLink(d, range);
  for (const HostRange& range : d.nodes.onSpheres) evaluateOnSphere(d, range);
}

namespace {

// Lines of a group's springs, and their tensions over length.
MEDULLA_INLINE Lanes pullOfSprings(const SpringGroup& s, Lanes relaxation, const Quad* x, const Quad* v,
                                   Lanes (&line)[4]) {
  Lanes rate[4];
  for (int k = 0; k < 4; ++k) {
    line[k] = load(at(x, s.node1[k])) - load(at(x, s.node0[k]));
    rate[k] = (load(at(v, s.node1[k])) - load(at(v, s.node0[k]))) * line[k];
  }
  const Lanes squared = larger(dotOfFour(line[0] * line[0], line[1] * line[1], line[2] * line[2], line[3] * line[3]),
                               splat(kSmallestSquaredLength));
  const Lanes lengthRate = dotOfFour(rate[0], rate[1], rate[2], rate[3]);  // times length
  const Lanes length = squareRoot(squared);
  const Lanes scale = s.stiffness / squared;  // does not wait for the root
  return scale * fma(length - s.restLength, length, relaxation * lengthRate);
}

MEDULLA_INLINE void pullEnds(const SpringGroup& s, Lanes pull, const Lanes (&line)[4], Quad* force) {
  std::uint32_t node0[4], node1[4];  // copies: the stores below could change the group's for all the compiler knows
  for (int k = 0; k < 4; ++k) {
    node0[k] = s.node0[k];
    node1[k] = s.node1[k];
  }
  const auto apply = [&](int k, Lanes pullOfOne) {
    Quad &end0 = at(force, node0[k]), &end1 = at(force, node1[k]);
    store(end0, fma(pullOfOne, line[k], load(end0)));
    store(end1, fnma(pullOfOne, line[k], load(end1)));
  };
  apply(0, splatLane<0>(pull));
  apply(1, splatLane<1>(pull));
  apply(2, splatLane<2>(pull));
  apply(3, splatLane<3>(pull));
}

}  // namespace

// One pass over the springs, each added to its two nodes while its direction is in registers. Rejected: one number per
// spring first and a sum per node after, which reads every position again and costs half as many instructions more.
// Two groups at a time: from ends to pull is one long chain, in which a single group leaves the processor waiting.
void addEdgeSprings(WorldData& d) {
  const Quad* x = d.nodes.position.data();
  const Quad* v = d.nodes.velocity.data();
  Quad* force = d.nodes.force.data();
  for (const SpringRange& range : d.springs.ranges) {
    const Lanes relaxation = splat(range.relaxation);
    for (int g = range.firstGroup; g < range.endGroup; g += 2) {
      const SpringGroup& s0 = d.springs.groups[g];
      const SpringGroup& s1 = d.springs.groups[g + 1];
      Lanes line0[4], line1[4];
      const Lanes pull0 = pullOfSprings(s0, relaxation, x, v, line0),
                  pull1 = pullOfSprings(s1, relaxation, x, v, line1);
      pullEnds(s0, pull0, line0, force);
      pullEnds(s1, pull1, line1, force);
    }
  }
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
  for (const SpringGroup& s : d.springs.groups) {
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector3d line =
          vectorOf(at(d.nodes.position.data(), s.node1[k])) - vectorOf(at(d.nodes.position.data(), s.node0[k]));
      const double stretch = line.norm() - s.restLength[k];
      sum += 0.5 * s.stiffness[k] * stretch * stretch;
    }
  }
  const auto add = [&](const Anchor& anchor, int g) {
    const Lanes3 stretch = positionOf(anchor) - gatherNodes(d.nodes.position, 4 * g);
    sum += 0.5 * sumOfLanes(d.nodes.groups[g].stiffness * dot(stretch, stretch));
  };
  for (const HostRange& range : d.nodes.onLinks) {
    const LinkHost host = linkHost(d, range.host);
    for (int g = range.firstGroup; g < range.endGroup; ++g) add(anchorOnLink(host, d.nodes.groups[g]), g);
  }
  for (const HostRange& range : d.nodes.onSpheres) {
    const SphereHost host = sphereHost(d, range.host);
    for (int g = range.firstGroup; g < range.endGroup; ++g) add(anchorOnSphere(host, d.nodes.groups[g]), g);
  }
  return sum;
}

}  // namespace medulla
