#include "physics/dynamics/layout.h"

#include <algorithm>
#include <cstddef>
#include <tuple>
#include <utility>

#include "physics/dynamics/identified_layout.h"
#include "physics/dynamics/stages.h"
#include "physics/model/mesh_topology.h"

namespace medulla {

namespace {

using Eigen::Vector3d;

// Forces of a link divide by no less than this share of its rest length: two spheres pushed into one point stay finite.
constexpr double kSmallestLength = 0.05;

void addSpheres(WorldData& d, int b, const BodyMechanics& mechanics) {
  Spheres& s = d.spheres;
  const BodyDescription& body = d.bodies[b];
  const Eigen::Quaterniond q = Eigen::Quaterniond(body.worldFromModel.rotation()).normalized();
  for (std::size_t i = 0; i < body.model->spheres.size(); ++i) {
    const int k = s.count++;
    if (k % 4 == 0) {
      SphereGroup empty{};
      s.groups.push_back(empty);
      for (std::vector<Quad>* a :
           {&s.position, &s.velocity, &s.angularMomentum, &s.angularVelocity, &s.force, &s.torque})
        a->resize(k + 4);
      s.orientation.resize(k + 4, Quad{{0, 0, 0, 1}});
      s.bodyOf.resize(k + 4, 0);
    }
    s.bodyOf[k] = b;
    s.position[k] = quadOf(body.worldFromModel * body.model->spheres[i].restFrame);
    s.orientation[k] = {{q.x(), q.y(), q.z(), q.w()}};
    SphereGroup& g = s.groups[k / 4];
    const int l = k % 4;
    g.mass[l] = mechanics.sphereMass[i];
    g.inverseMass[l] = mechanics.moves[i] ? 1 / mechanics.sphereMass[i] : 0;
    g.freeToTurn[l] = mechanics.turns[i] ? 1 : 0;
    setSymmetric(g.inverseInertia, l, mechanics.sphereInertia[i].inverse());
  }
}

void addLinks(WorldData& d, const BodyDescription& body, const BodyMechanics& mechanics, int firstSphere) {
  const SoftBodyModel& m = *body.model;
  std::vector<double> widest(m.links.size(), 0);
  for (const Attachment& a : mechanics.attachments)
    if (a.onLink) widest[a.host] = std::max(widest[a.host], a.restOffset.norm());
  for (std::size_t i = 0; i < m.links.size(); ++i) {
    const int k = d.links.count++, lane = k % 4;
    if (lane == 0) d.links.groups.push_back(LinkGroup{});
    LinkGroup& g = d.links.groups.back();
    const ElasticLink& link = m.links[i];
    const LinkSpan& span = mechanics.spans[i];
    const Vector3d line = span.end1 - span.end0;
    const Vector3d arm0 = span.end0 - m.spheres[link.sphere0].restFrame,
                   arm1 = span.end1 - m.spheres[link.sphere1].restFrame;
    const LinkStiffness& stiffness = mechanics.links[i];
    const bool beam = body.links == LinkModel::beam;
    g.hasBeams = g.hasBeams || beam;
    g.hasArms = g.hasArms || !arm0.isZero(0) || !arm1.isZero(0);
    const double length = line.norm();
    const Vector3d t = line / length, u = stiffness.restU;
    g.elongation[lane] = stiffness.elongation;
    g.flexionU0[lane] = stiffness.flexionU.end0;
    g.flexionV0[lane] = stiffness.flexionV.end0;
    g.flexionU1[lane] = stiffness.flexionU.end1;
    g.flexionV1[lane] = stiffness.flexionV.end1;
    g.torsion[lane] = stiffness.torsion;
    g.coupleU[lane] = stiffness.flexionU.couple;
    g.coupleV[lane] = stiffness.flexionV.couple;
    // The rest of the group becomes copies without stiffness, overwritten by the links that follow.
    for (int l = lane; l < 4; ++l) {
      g.sphere0[l] = static_cast<std::uint32_t>(firstSphere + link.sphere0);
      g.sphere1[l] = static_cast<std::uint32_t>(firstSphere + link.sphere1);
      setLane(g.restT, l, t);
      setLane(g.restU, l, u);
      g.restLength[l] = length;
      g.inverseRestLength[l] = 1 / length;
      g.smallestLength[l] = kSmallestLength * length;
      setLane(g.restArm0, l, arm0);
      setLane(g.restArm1, l, arm1);
      g.beam[l] = beam ? 1 : 0;
      g.thinning[l] = beam ? 2 * body.tissue.poisson : 0;
      g.curving[l] = beam ? body.tissue.poisson / (2 * length) : 0;
      g.widest[l] = 2 * widest[i];
      g.relaxation[l] = mechanics.linkRelaxation;
    }
  }
}

struct NodeOrder {  // one entry per padded place: which node of which body, -1 on pads
  std::vector<int> body, node;
};

// Appends the nodes of `b` that hang on links (or spheres) in the order of their hosts, each host's range padded to
// four; those with as many edges side by side, because a group has as many springs as the node of it that has most.
void appendNodes(NodeOrder& order, WorldData& d, const BodyMechanics& mechanics, int b, bool onLink,
                 std::vector<HostRange>& ranges) {
  const SoftBodyModel& m = *d.bodies[b].model;
  const int firstHost = onLink ? d.ranges[b].firstLink : d.ranges[b].firstSphere;
  std::vector<int> edges(m.restNodes.size(), 0);
  for (const auto& e : m.edges) ++edges[e[0]], ++edges[e[1]];
  std::vector<int> sorted;
  for (std::size_t i = 0; i < mechanics.attachments.size(); ++i)
    if (mechanics.attachments[i].onLink == onLink) sorted.push_back(static_cast<int>(i));
  // On frames what is held hangs on its patch, and stands apart.
  const bool onFrames = d.bodies[b].links == LinkModel::identified;
  const auto hostOf = [&](int i) {
    return std::pair(mechanics.attachments[i].host, onFrames && !mechanics.nodeMoves[i]);
  };
  // Where nodes have the choice to move, those that are fixed come first: theirs is none.
  const bool choose = d.bodies[b].surface == SurfaceMode::contact;
  const auto placeOf = [&](int i) { return std::tuple(hostOf(i), choose && mechanics.nodeMoves[i], -edges[i]); };
  std::stable_sort(sorted.begin(), sorted.end(), [&](int i, int j) { return placeOf(i) < placeOf(j); });
  for (std::size_t k = 0; k < sorted.size();) {
    const auto [host, held] = hostOf(sorted[k]);
    if (onFrames) {
      const auto end =
          std::find_if(sorted.begin() + k, sorted.end(), [&](int i) { return hostOf(i) != hostOf(sorted[k]); });
      groupByFrames(mechanics, edges, {sorted.begin() + k, end});
    }
    HostRange range{firstHost + host,
                    static_cast<int>(order.node.size()) / 4,
                    0,
                    mechanics.surfaceRelaxation,
                    b,
                    (onLink ? mechanics.linkBulk : mechanics.sphereBulk)[host],
                    mechanics.largestPressure,
                    -1,
                    onFrames,
                    d.ranges[mechanics.firstLike].firstNodeGroup - d.ranges[b].firstNodeGroup};
    for (; k < sorted.size() && hostOf(sorted[k]) == std::pair(host, held); ++k) {
      order.body.push_back(b);
      order.node.push_back(sorted[k]);
    }
    while (order.node.size() % 4 != 0) {
      order.body.push_back(b);
      order.node.push_back(-1);
    }
    range.endGroup = static_cast<int>(order.node.size()) / 4;
    d.nodes.groupHosts.resize(range.endGroup, {range.host, onLink, b});
    ranges.push_back(range);
  }
}

NodeOrder orderNodes(WorldData& d, const std::vector<BodyMechanics>& mechanics) {
  NodeOrder order;
  // Body after body: what a batch's stages leave lies together.
  const auto append = [&](bool skin, std::vector<HostRange>& onLinks, std::vector<HostRange>& onSpheres) {
    for (std::size_t b = 0; b < d.bodies.size(); ++b) {
      if ((d.bodies[b].surface == SurfaceMode::skin) != skin) continue;
      d.ranges[b].firstNodeGroup = static_cast<int>(order.node.size()) / 4;
      appendNodes(order, d, mechanics[b], static_cast<int>(b), true, onLinks);
      appendNodes(order, d, mechanics[b], static_cast<int>(b), false, onSpheres);
    }
  };
  append(false, d.nodes.onLinks, d.nodes.onSpheres);
  d.nodes.dynamicEnd = static_cast<int>(order.node.size());
  for (std::vector<HostRange>* ranges : {&d.nodes.onLinks, &d.nodes.onSpheres}) {
    for (HostRange& range : *ranges) {
      range.part = static_cast<int>(d.nodes.swollen.size());
      d.nodes.swollen.push_back(0);
    }
  }
  append(true, d.nodes.skinOnLinks, d.nodes.skinOnSpheres);
  return order;
}

void addNodes(WorldData& d, const std::vector<BodyMechanics>& mechanics) {
  const NodeOrder order = orderNodes(d, mechanics);
  Nodes& n = d.nodes;
  n.count = static_cast<int>(order.node.size());
  n.displaced.resize(n.count);
  for (std::vector<Lanes3>* a : {&n.position, &n.velocity}) a->resize(n.count / 4, zeroVectors());
  for (StageArray<Lanes3>* a : {&n.force, &n.offset, &n.area}) a->resize(n.count / 4);
  n.mass.resize(n.count, 0);
  n.inverseMass.resize(n.count, 0);
  n.groups.resize(n.count / 4, NodeGroup{});
  for (int i = 0; i < n.count; ++i) {
    if (order.node[i] < 0) continue;
    const int b = order.body[i], k = order.node[i], lane = i % 4;
    const BodyDescription& body = d.bodies[b];
    const Attachment& a = mechanics[b].attachments[k];
    d.ranges[b].node[k] = i;
    setVector(n.position, i, body.worldFromModel * body.model->restNodes[k]);
    n.mass[i] = mechanics[b].nodeMass[k];
    n.inverseMass[i] = n.mass[i] > 0 && mechanics[b].nodeMoves[k] ? 1 / n.mass[i] : 0;
    NodeGroup& g = n.groups[i / 4];
    g.stiffness[lane] = mechanics[b].attachmentStiffness[k];
    const Vector3d area = a.area * mechanics[b].normal[k];
    setVector(n.area, i, body.worldFromModel.linear() * area);
    if (!a.onLink) {
      setLane(g.restOffset, lane, a.restOffset);
      setLane(g.restArea, lane, area);
      continue;
    }
    const int link = d.ranges[b].firstLink + a.host, l = link % 4;
    const Vector3d t = vectorOf(d.links.groups[link / 4].restT, l), u = vectorOf(d.links.groups[link / 4].restU, l);
    g.along[lane] = a.along;
    g.twistShare[lane] = mechanics[b].twistShare[k];
    setLane(g.restOffset, lane, {0, a.restOffset.dot(u), a.restOffset.dot(t.cross(u))});
    setLane(g.restArea, lane, {area.dot(t), area.dot(u), area.dot(t.cross(u))});
  }
}

struct SpringEnd {
  int other;
  double stiffness;
};

void addSprings(WorldData& d, const std::vector<BodyMechanics>& mechanics) {
  Springs& s = d.springs;
  std::vector<std::vector<SpringEnd>> ends(d.nodes.dynamicEnd);
  for (std::size_t b = 0; b < d.bodies.size(); ++b) {
    const SoftBodyModel& m = *d.bodies[b].model;
    if (d.bodies[b].surface == SurfaceMode::skin) continue;
    for (std::size_t e = 0; e < m.edges.size(); ++e) {
      const int node0 = d.ranges[b].node[m.edges[e][0]], node1 = d.ranges[b].node[m.edges[e][1]];
      ends[node0].push_back({node1, mechanics[b].edgeStiffness[e]});
      ends[node1].push_back({node0, mechanics[b].edgeStiffness[e]});
      ++s.count;
    }
  }
  s.first.push_back(0);
  for (int i = 0; i < d.nodes.dynamicEnd; i += 4) {
    std::size_t most = 0;
    for (int l = 0; l < 4; ++l) most = std::max(most, ends[i + l].size());
    for (std::size_t k = 0; k < most; ++k) {
      SpringGroup& g = s.groups.emplace_back();
      for (int l = 0; l < 4; ++l) {
        const SpringEnd end = k < ends[i + l].size() ? ends[i + l][k] : SpringEnd{i + l, 0};
        g.other[l] = static_cast<std::uint32_t>(end.other * sizeof(Quad));
        g.stiffness[l] = static_cast<float>(end.stiffness);
        d.nodes.groups[i / 4].edges[l] += g.stiffness[l];
      }
    }
    s.first.push_back(static_cast<int>(s.groups.size()));
  }
}

void addDrives(WorldData& d, int body) {
  for (const DrivenSphere& driven : d.bodies[body].driven) {
    SphereDrive drive;
    drive.body = body;
    drive.sphere = d.ranges[body].firstSphere + driven.sphere;
    drive.rest = d.spheres.position[drive.sphere];
    drive.velocity = quadOf(driven.velocity);
    drive.swing = quadOf(driven.amplitude * driven.axis.normalized());
    drive.frequency = driven.frequency;
    drive.phase = driven.phase;
    d.drives.push_back(drive);
  }
}

void listSlots(WorldData& d) {
  std::vector<std::vector<int>> slots(d.spheres.count);
  for (const BodyRange& r : d.ranges) {
    for (int k = r.firstLink; k < r.firstLink + r.linkCount; ++k) {
      slots[d.links.groups[k / 4].sphere0[k % 4]].push_back(2 * k);
      slots[d.links.groups[k / 4].sphere1[k % 4]].push_back(2 * k + 1);
    }
  }
  d.spheres.firstSlot.push_back(0);
  for (const std::vector<int>& of : slots) {
    d.spheres.slot.insert(d.spheres.slot.end(), of.begin(), of.end());
    d.spheres.firstSlot.push_back(static_cast<int>(d.spheres.slot.size()));
  }
}

// Batches are of whole bodies, a larger body is one of its own. On caches of 2 MB, 10 000 spheres without contacts take
// a sixth less time so than in one batch; four times as large ones do as well there. The implicit step knows no
// batches, nor pads between bodies.
constexpr std::size_t kBatchBytes = 1 << 18;

std::size_t bytesOf(const BodyDescription& body) {
  const SoftBodyModel& m = *body.model;
  constexpr std::size_t kPerSphere = 7 * sizeof(Quad) + sizeof(SphereGroup) / 4,
                        kPerLink = (sizeof(LinkGroup) + sizeof(LinkFrame)) / 4 + sizeof(LinkLoads) + 2 * sizeof(Slot),
                        kPerNode = (5 * sizeof(Lanes3) + sizeof(NodeGroup)) / 4 + sizeof(Quad) + 2 * sizeof(double),
                        kPerEdge = 2 * sizeof(SpringGroup) / 4, kPerNodeOnFrames = 7 * sizeof(SkinShare) / 4;
  const std::size_t perNode = kPerNode + (body.links == LinkModel::identified ? kPerNodeOnFrames : 0);
  return kPerSphere * m.spheres.size() + kPerLink * m.links.size() + perNode * m.restNodes.size() +
         kPerEdge * m.edges.size();
}

// Starts another batch where the one before would grow too large with `body`. Returns the body's batch.
class Batches {
 public:
  int add(WorldData& d, const BodyDescription& body) {
    const std::size_t bytes = bytesOf(body);
    if (bytes_ > 0 && bytes_ + bytes > kBatchBytes && d.settings.integrator != Integrator::implicit) {
      d.spheres.count = roundUp(d.spheres.count);
      d.links.count = roundUp(d.links.count);
      bytes_ = 0;
      ++batch_;
    }
    bytes_ += bytes;
    return batch_;
  }

 private:
  static int roundUp(int count) { return (count + 3) / 4 * 4; }

  std::size_t bytes_ = 0;
  int batch_ = 0;
};

}  // namespace

std::unique_ptr<WorldData> layOut(const WorldSettings& settings, std::vector<BodyDescription> bodies,
                                  const std::vector<BodyMechanics>& mechanics) {
  auto out = std::make_unique<WorldData>();
  WorldData& d = *out;
  d.settings = settings;
  d.frame = -settings.settleFrames;
  d.gravity = quadOf(settings.gravity);
  d.bodies = std::move(bodies);
  Batches batches;
  for (std::size_t b = 0; b < d.bodies.size(); ++b) {
    const SoftBodyModel& m = *d.bodies[b].model;
    BodyRange r;
    r.batch = batches.add(d, d.bodies[b]);
    r.firstSphere = d.spheres.count;
    r.sphereCount = static_cast<int>(m.spheres.size());
    r.firstLink = d.links.count;
    r.linkCount = d.bodies[b].links == LinkModel::identified ? 0 : static_cast<int>(m.links.size());
    r.node.resize(m.restNodes.size());
    r.restVolume = enclosedVolume({m.restNodes, m.triangles});
    r.massDamping = mechanics[b].massDamping;
    r.settlingDamping = mechanics[b].settlingDamping;
    r.lowestFrequency = mechanics[b].lowestFrequency;
    r.support = rigidSupport(d.bodies[b]);
    d.ranges.push_back(r);
    addSpheres(d, static_cast<int>(b), mechanics[b]);
    if (r.linkCount > 0) addLinks(d, d.bodies[b], mechanics[b], r.firstSphere);
  }
  d.links.frames.resize(d.links.groups.size());
  d.links.loads.resize(4 * d.links.groups.size());
  d.links.unwoundTwist.resize(d.links.groups.size());
  d.links.slots.resize(8 * d.links.groups.size());
  addNodes(d, mechanics);
  layOutIdentified(d, mechanics);
  addSprings(d, mechanics);
  for (std::size_t b = 0; b < d.bodies.size(); ++b) addDrives(d, static_cast<int>(b));
  d.ledger.resize(d.bodies.size());
  startDrivenBodies(d);
  listSlots(d);
  d.creep.bodies.resize(d.bodies.size(), false);
  layOutRest(d);
  layOutSurfaceParts(d, mechanics);
  refreshAngularVelocities(d);
  runStage(d, evaluateLinks);
  placeCarriedNodes(d);
  return out;
}

}  // namespace medulla
