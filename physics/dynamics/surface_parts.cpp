#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/dynamics/edge_springs.h"
#include "physics/dynamics/implicit_stages.h"
#include "physics/dynamics/node_motion.h"
#include "physics/dynamics/stages.h"

// SurfaceMode::contact: a host's nodes move by themselves only where something acts on them or what acts has spread to
// them. The others are carried: they hang still from their anchors, and their mass is their spheres'. Parts join and
// leave between frames. Fixed nodes pull at hosts that move, and stay; with them, in the same groups of four, up to
// three others.
namespace medulla {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Of the body's mean radius, besides what weight sinks nodes by, which edges share out: a part whose nodes edges would
// shift by more joins.
constexpr double kUnrest = 0.002;
constexpr double kQuiet = 0.5;    // of that: nodes nearer are at rest
constexpr int kQuietFrames = 10;  // a fifth of a second at 50 Hz: several periods of a node on its attachment

const HostRange& rangeOf(const WorldData& d, std::size_t part) {
  const std::size_t onLinks = d.nodes.onLinks.size();
  return part < onLinks ? d.nodes.onLinks[part] : d.nodes.onSpheres[part - onLinks];
}

// Where a host's nodes hang still from their anchors: k x = m g - p a, and p = bulk sum a.x is the host's pressure.
// Their mean weight alone would not do: a host's patch of surface is open, so that nodes which all sink alike press.
// Fixed nodes, and pads, stay where they are. Identified attachments have more than k along the node's normal.
class StillNodes {
 public:
  StillNodes(const WorldData& d, const HostRange& range) : d_(&d), gravity_(splat(d.gravity)) {
    Lanes sunk = splat(0), give = sunk;
    for (int g = range.firstGroup; g < range.endGroup; ++g) {
      const Lanes3 area = d.nodes.area[g];
      sunk = sunk + dot(area, sag(g));
      give = fma(dot(area, area), giveAcross(g), give);
    }
    const double volume = sumOfLanes(sunk);
    pressure_ = range.bulk * volume / (1 + range.bulk * sumOfLanes(give));
    swollen_ = range.bulk > 0 ? pressure_ / range.bulk : 0;
  }
  Lanes3 displaced(int g) const {  // m, of the nodes of group g
    return fnma(splat(pressure_) * giveAcross(g), d_->nodes.area[g], sag(g));
  }
  Lanes3 sag(int g) const {  // m, without pressure
    const Lanes3 even = d_->surface.give[g].perGravity * gravity_, area = d_->nodes.area[g];
    if (d_->identified.ofNodeGroup[g] < 0) return even;
    return fnma(excess(g) * dot(area, even) * giveAcross(g), area, even);
  }
  double swollen() const { return swollen_; }  // m3

 private:
  Lanes excess(int g) const {  // N/m5, of identified nodes
    return d_->identified.skin[d_->identified.ofNodeGroup[g]].normalExcess;
  }
  Lanes giveAcross(int g) const {  // m/N, along the normal
    const Lanes give = d_->surface.give[g].perForce;
    if (d_->identified.ofNodeGroup[g] < 0) return give;
    const Lanes3 area = d_->nodes.area[g];
    return give / fma(excess(g) * give, dot(area, area), splat(1));
  }

  const WorldData* d_;
  Lanes3 gravity_;
  double pressure_, swollen_;
};

void layOutGive(WorldData& d) {
  SurfaceParts& s = d.surface;
  s.give.resize(d.nodes.dynamicEnd / 4);
  for (int g = 0; g < d.nodes.dynamicEnd / 4; ++g) {
    const Lanes moves = isLess(splat(0), _mm256_loadu_pd(&d.nodes.inverseMass[4 * g]));
    const Lanes give = _mm256_and_pd(moves, splat(1) / select(moves, d.nodes.groups[g].stiffness, splat(1)));
    s.give[g] = {give, give * _mm256_loadu_pd(&d.nodes.mass[4 * g])};
  }
}

double longest(Lanes squared) {
  return std::sqrt(std::max(std::max(squared[0], squared[1]), std::max(squared[2], squared[3])));
}

double deepestSag(const WorldData& d, const HostRange& range) {
  const StillNodes still(d, range);
  Lanes squared = splat(0);
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const Lanes3 sag = still.sag(g);
    squared = larger(squared, dot(sag, sag));
  }
  return longest(squared);
}

// Nothing turns or moves what the part hangs on, so that nodes which hold it have nothing to hold.
bool isHeld(const WorldData& d, const BodyMechanics& mechanics, std::size_t part) {
  const HostRange& range = rangeOf(d, part);
  if (range.onFrames) return true;  // fixed nodes hang on what is held, and the spheres by links of their own
  const auto held = [&](int sphere) {
    const int own = sphere - d.ranges[range.body].firstSphere;
    return !mechanics.moves[own] && !mechanics.turns[own];
  };
  if (part >= d.nodes.onLinks.size()) return held(range.host);
  const LinkGroup& g = d.links.groups[range.host / 4];
  return held(static_cast<int>(g.sphere0[range.host % 4])) && held(static_cast<int>(g.sphere1[range.host % 4]));
}

void listNeighbours(const WorldData& d, const std::vector<int>& ofGroup, const HostRange& range, SurfacePart& part) {
  for (int e = d.springs.first[range.firstGroup]; e < d.springs.first[range.endGroup]; ++e)
    for (int k = 0; k < 4; ++k)
      if (d.springs.groups[e].stiffness[k] > 0)
        part.neighbours.push_back(ofGroup[d.springs.groups[e].other[k] / sizeof(Quad) / 4]);
  std::sort(part.neighbours.begin(), part.neighbours.end());
  part.neighbours.erase(std::unique(part.neighbours.begin(), part.neighbours.end()), part.neighbours.end());
}

void layOutPart(const WorldData& d, const BodyMechanics& mechanics, std::size_t k, SurfacePart& part) {
  const HostRange& range = rangeOf(d, k);
  part.always = d.bodies[range.body].surface != SurfaceMode::contact || d.settings.integrator == Integrator::implicit;
  part.firstChoice = part.always ? range.endGroup : range.firstGroup;
  if (part.always) return;
  listNeighbours(d, d.surface.ofGroup, range, part);
  part.unrest = kUnrest * meanRadius(*d.bodies[range.body].model) + deepestSag(d, range);
  const bool held = isHeld(d, mechanics, k);
  for (int i = 4 * range.firstGroup; i < 4 * range.endGroup; ++i)
    if (d.nodes.mass[i] > 0 && d.nodes.inverseMass[i] == 0 && !held) part.firstChoice = i / 4 + 1;
  part.always = part.firstChoice == range.endGroup;
  part.moves = part.always;
  double give = 0;  // m5/N
  for (int g = part.firstChoice; g < range.endGroup; ++g)
    give += sumOfLanes(dot(d.nodes.area[g], d.nodes.area[g]) * d.surface.give[g].perForce);
  part.heldBulk = range.bulk / (1 + range.bulk * give);
}

void listCarriedNodes(WorldData& d, const std::vector<BodyMechanics>& mechanics) {
  for (std::size_t b = 0; b < d.bodies.size(); ++b) {
    if (d.bodies[b].surface != SurfaceMode::contact) continue;
    const SoftBodyModel& m = *d.bodies[b].model;
    for (std::size_t k = 0; k < mechanics[b].attachments.size(); ++k) {
      const int group = d.ranges[b].node[k] / 4, part = d.surface.ofGroup[group],
                sphere = mechanics[b].attachments[k].massSphere;
      const Vector3d r = m.restNodes[k] - m.spheres[sphere].restFrame;
      const double mass = mechanics[b].nodeMass[k];
      const Matrix3d inertia = mass * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose());
      if (group >= d.surface.parts[part].firstChoice)
        d.surface.nodes.push_back({part, d.ranges[b].firstSphere + sphere, {mass, inertia}});
    }
  }
  std::stable_sort(d.surface.nodes.begin(), d.surface.nodes.end(),
                   [](const CarriedNode& a, const CarriedNode& b) { return a.sphere < b.sphere; });
}

void setMass(WorldData& d, int sphere, const BareSphere& mass) {
  SphereGroup& g = d.spheres.groups[sphere / 4];
  const int l = sphere % 4;
  d.surface.ownShare[sphere] = d.surface.spheres[sphere].mass / mass.mass;
  g.mass[l] = mass.mass;
  if (g.inverseMass[l] > 0) g.inverseMass[l] = 1 / mass.mass;
  setSymmetric(g.inverseInertia, l, mass.inertia.inverse());
  const Matrix3d r = quaternionOf(d.spheres.orientation[sphere]).toRotationMatrix();
  d.spheres.angularMomentum[sphere] =
      quadOf(r * mass.inertia * r.transpose() * vectorOf(d.spheres.angularVelocity[sphere]));
}

// Velocities stay: what leaves or joins a sphere has moved with it.
void shareOutMasses(WorldData& d) {
  const std::vector<CarriedNode>& nodes = d.surface.nodes;
  for (std::size_t k = 0; k < nodes.size();) {
    const int sphere = nodes[k].sphere;
    BareSphere sum = d.surface.spheres[sphere];
    for (; k < nodes.size() && nodes[k].sphere == sphere; ++k) {
      if (d.surface.parts[nodes[k].part].moves) continue;
      sum.mass += nodes[k].mass.mass;
      sum.inertia += nodes[k].mass.inertia;
    }
    setMass(d, sphere, sum);
  }
}

// All that follows from which parts move.
void partsChanged(WorldData& d) {
  SurfaceParts& s = d.surface;
  shareOutMasses(d);
  s.carried.clear();
  for (std::size_t k = 0; k < s.parts.size(); ++k) {
    if (k == d.nodes.onLinks.size()) s.firstOnSphere = s.carried.size();
    if (s.parts[k].moves) continue;
    s.carried.push_back(rangeOf(d, k));
    s.carried.back().firstGroup = s.parts[k].firstChoice;
  }
  if (s.parts.size() == d.nodes.onLinks.size()) s.firstOnSphere = s.carried.size();
  listAwake(d);
}

// Parts that loads act on, and those beside them.
std::vector<char> loadedParts(const WorldData& d, const Loads& loads) {
  std::vector<char> loaded(d.surface.parts.size(), 0);
  const auto add = [&](int body, int node) {
    const int index = d.ranges[body].node[node];
    if (isSkin(d, index)) return;
    const int part = d.surface.ofGroup[index / 4];
    loaded[part] = 1;
    for (const int beside : d.surface.parts[part].neighbours) loaded[beside] = 1;
  };
  for (const ToolSpring& t : loads.toolSprings)
    for (const int node : t.nodes) add(t.body, node);
  for (const HeldNode& held : loads.heldNodes) add(held.body, held.node);
  for (std::size_t b = 0; b < d.bodies.size(); ++b)
    for (const DeadLoad& load : d.bodies[b].deadLoads) add(static_cast<int>(b), load.node);
  return loaded;
}

// m: how far the part's nodes that move are from where they hang at rest, into `unrest`, per node. Returns the most of
// those that have the choice.
double unrestOf(const WorldData& d, std::size_t part, std::vector<Quad>& unrest) {
  const HostRange range = movingRange(d, part);
  const StillNodes still(d, range);
  Lanes squared = splat(0);
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const Lanes3 off = gatherFour(d.nodes.displaced, 4 * g) - still.displaced(g);
    const Lanes isNode = isLess(splat(0), _mm256_loadu_pd(&d.nodes.mass[4 * g]));  // pads drift
    storeFour(off, unrest, 4 * g);
    if (g >= d.surface.parts[part].firstChoice) squared = larger(squared, _mm256_and_pd(isNode, dot(off, off)));
  }
  return longest(squared);
}

// m: how far edges would shift the nodes of a part that is carried, at most, did they not hang still.
double shiftOf(const WorldData& d, std::size_t part, const std::vector<Quad>& unrest) {
  const Lanes zero = splat(0);
  Lanes squared = zero;
  for (int g = d.surface.parts[part].firstChoice; g < rangeOf(d, part).endGroup; ++g) {
    const NodeGroup& group = d.nodes.groups[g];
    const Lanes3 pull = pullOfEdges(d.springs, d.nodes.groups.data(), unrest.data(), {zero, zero, zero}, g);
    const Lanes moves = isLess(zero, _mm256_loadu_pd(&d.nodes.inverseMass[4 * g]));
    const Lanes give = _mm256_and_pd(moves, splat(1) / (group.stiffness + group.edges));
    squared = larger(squared, (give * give) * dot(pull, pull));
  }
  return longest(squared);
}

// The nodes of a part that does not move are where they hang still.
void hang(WorldData& d, std::size_t part) {
  HostRange range = rangeOf(d, part);
  const bool whole = range.firstGroup == d.surface.parts[part].firstChoice;
  range.firstGroup = d.surface.parts[part].firstChoice;
  const StillNodes still(d, range);
  if (whole) d.nodes.swollen[range.part] = still.swollen();
  for (int g = range.firstGroup; g < range.endGroup; ++g) storeFour(still.displaced(g), d.nodes.displaced, 4 * g);
}

// A link's frame is asked for its nodes' loads; where none moves there are none.
void releaseLink(WorldData& d, std::size_t part) {
  if (part < d.nodes.onLinks.size() && rangeOf(d, part).firstGroup == d.surface.parts[part].firstChoice)
    d.links.loads[rangeOf(d, part).host] = {};
}

void carry(WorldData& d, std::size_t part) {
  d.surface.parts[part].moves = false;
  releaseLink(d, part);
  hang(d, part);
}

// SurfaceParts::felt. The w of each sum is the mass that it goes over.
void feelGravity(WorldData& d) {
  SurfaceParts& s = d.surface;
  s.felt.assign(d.bodies.size(), Quad{});
  for (const HostRange& range : s.carried) {
    Lanes sum = load(s.felt[range.body]);
    for (int i = 4 * range.firstGroup; i < 4 * range.endGroup; ++i) {
      Lanes gained = load(s.nodeWeight[i]);
      gained[3] = 1;
      sum = fma(splat(d.nodes.mass[i]), gained, sum);
    }
    store(s.felt[range.body], sum);
  }
  for (Quad& felt : s.felt) {
    const double perFrame = felt.v[3] > 0 ? 1 / (felt.v[3] * d.settings.frameDuration) : 0;
    felt.v[3] = 0;
    store(felt, fnma(splat(perFrame), load(felt), load(d.gravity)));
  }
}

bool hasChoice(const SurfaceParts& s) {
  return !s.nodes.empty();
}

}  // namespace

void layOutSurfaceParts(WorldData& d, const std::vector<BodyMechanics>& mechanics) {
  SurfaceParts& s = d.surface;
  layOutGive(d);
  s.unrest.resize(d.nodes.dynamicEnd);
  s.parts.resize(d.nodes.onLinks.size() + d.nodes.onSpheres.size());
  s.ofGroup.resize(d.nodes.dynamicEnd / 4);
  for (std::size_t k = 0; k < s.parts.size(); ++k)
    for (int g = rangeOf(d, k).firstGroup; g < rangeOf(d, k).endGroup; ++g) s.ofGroup[g] = static_cast<int>(k);
  for (std::size_t k = 0; k < s.parts.size(); ++k) layOutPart(d, mechanics[rangeOf(d, k).body], k, s.parts[k]);
  s.spheres.resize(d.spheres.position.size());
  s.ownShare.resize(d.spheres.position.size(), 1);
  for (std::size_t b = 0; b < mechanics.size(); ++b)
    for (std::size_t i = 0; i < mechanics[b].sphereMass.size(); ++i)
      s.spheres[d.ranges[b].firstSphere + i] = {mechanics[b].sphereMass[i], mechanics[b].sphereInertia[i]};
  listCarriedNodes(d, mechanics);
  for (std::size_t k = 0; k < s.parts.size(); ++k)
    if (!s.parts[k].moves) carry(d, k);
  partsChanged(d);
}

void moveLoadedParts(WorldData& d, const Loads& loads) {
  if (!hasChoice(d.surface)) return;
  const std::vector<char> loaded = loadedParts(d, loads);
  bool changed = false;
  for (std::size_t k = 0; k < loaded.size(); ++k) {
    SurfacePart& part = d.surface.parts[k];
    if (!loaded[k] || part.moves) continue;
    part.moves = changed = true;
    part.quietFrames = 0;
  }
  if (changed) partsChanged(d);
}

HostRange movingRange(const WorldData& d, std::size_t part) {
  HostRange range = rangeOf(d, part);
  const SurfacePart& p = d.surface.parts[part];
  if (p.moves) return range;
  if (p.firstChoice > range.firstGroup) range.bulk = p.heldBulk;
  range.endGroup = p.firstChoice;
  return range;
}

// Less what the body falls by on the whole: one that falls freely would begin to turn.
void weighCarriedNodes(WorldData& d) {
  SurfaceParts& s = d.surface;
  const Lanes gravity = load(d.gravity);
  if (!hasChoice(s) || dotProduct(gravity, gravity) == 0) return;
  if (s.nodeWeight.empty()) {  // gains are noted from now on
    s.nodeWeight.resize(d.nodes.dynamicEnd);
    return;
  }
  feelGravity(d);
  s.weight.assign(2 * d.spheres.position.size(), Quad{});
  for (std::size_t k = 0; k < s.ofGroup.size(); ++k) {
    const Lanes of = load(s.felt[rangeOf(d, s.ofGroup[k]).body]);
    const Lanes weight = isCarried(s, static_cast<int>(k)) ? of : splat(0);
    for (std::size_t i = 4 * k; i < 4 * k + 4; ++i) store(s.nodeWeight[i], splat(d.nodes.mass[i]) * weight);
  }
  returnImpulses(d, s.nodeWeight, s.weight);
  for (const CarriedNode& node : s.nodes) {
    if (s.parts[node.part].moves) continue;
    Quad& on = s.weight[2 * node.sphere];
    store(on, fnma(splat(node.mass.mass), load(s.felt[rangeOf(d, node.part).body]), load(on)));
  }
  for (std::size_t k = 0; k < s.parts.size(); ++k)
    if (!s.parts[k].moves) releaseLink(d, k);
}

void chooseSurfaceParts(WorldData& d, const Loads& loads) {
  if (!hasChoice(d.surface)) return;
  std::vector<SurfacePart>& parts = d.surface.parts;
  std::vector<char> wanted = loadedParts(d, loads), beside(parts.size(), 0);
  std::vector<double> unrest(parts.size(), 0);
  std::vector<Quad>& ofNodes = d.surface.unrest;
  const auto isMeasured = [&](std::size_t k) {
    const bool moves = parts[k].moves || parts[k].firstChoice > rangeOf(d, k).firstGroup;
    return moves && !parts[k].neighbours.empty();
  };
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (!isMeasured(k)) continue;
    unrest[k] = unrestOf(d, k, ofNodes);
    for (const int other : parts[k].neighbours) beside[other] = 1;
  }
  for (std::size_t k = 0; k < parts.size(); ++k)
    if (!parts[k].moves && beside[k] && shiftOf(d, k, ofNodes) > parts[k].unrest) wanted[k] = 1;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (!isMeasured(k)) continue;
    const HostRange range = movingRange(d, k);
    std::fill(ofNodes.begin() + 4 * range.firstGroup, ofNodes.begin() + 4 * range.endGroup, Quad{});
  }
  bool changed = false;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    SurfacePart& part = parts[k];
    if (part.always) continue;
    if (!part.moves) hang(d, k);
    const bool quiet = !wanted[k] && unrest[k] < kQuiet * part.unrest;
    part.quietFrames = quiet ? part.quietFrames + 1 : 0;
    if (!part.moves && wanted[k]) {
      part.moves = changed = true;
    } else if (part.moves && part.quietFrames > kQuietFrames) {
      carry(d, k);
      changed = true;
    }
  }
  if (changed) partsChanged(d);
}

}  // namespace medulla
