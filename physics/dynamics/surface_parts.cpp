#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/dynamics/edge_springs.h"
#include "physics/dynamics/node_motion.h"
#include "physics/dynamics/stages.h"
#include "physics/dynamics/still_nodes.h"
#include "physics/dynamics/whole_motion.h"
#include "physics/model/symmetric_eigen.h"
#include "physics/sort_unique.h"

// SurfaceMode::contact: a host's nodes move by themselves only where something acts on them or what acts has spread to
// them. The others are carried: they hang still from their anchors, and their mass is their spheres'. Parts join and
// leave between frames. Fixed nodes pull at hosts that move, and stay; with them, in the same groups of four, up to
// three others.
namespace medulla {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A carried part starts to move when its edges would shift a node by more than this share of the body's mean radius,
// plus the node's sag under its weight.
constexpr double kUnrest = 0.002;
constexpr double kQuiet = 0.5;        // of that: nodes nearer are at rest
constexpr double kQuietFor = 1. / 3;  // s: several periods of a node on its attachment

const HostRange& rangeOf(const WorldData& d, std::size_t part) {
  const std::size_t onLinks = d.nodes.onLinks.size();
  return part < onLinks ? d.nodes.onLinks[part] : d.nodes.onSpheres[part - onLinks];
}

void layOutGive(WorldData& d) {
  SurfaceParts& s = d.surface;
  s.give.resize(d.nodes.dynamicEnd / 4);
  for (int g = 0; g < d.nodes.dynamicEnd / 4; ++g) {
    const Lanes moves = isLess(splat(0), loadFour(d.nodes.inverseMass, 4 * g));
    const Lanes give = masked(moves, splat(1) / select(moves, d.nodes.groups[g].stiffness, splat(1)));
    s.give[g] = {give, give * loadFour(d.nodes.mass, 4 * g)};
  }
}

double deepestSag(const WorldData& d, const HostRange& range) {
  const Lanes3 gravity = splat(d.gravity);
  Lanes squared = splat(0);
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const Lanes3 sag = sagOf(d, gravity, g);
    squared = larger(squared, dot(sag, sag));
  }
  return std::sqrt(largestOfLanes(squared));
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
  sortUnique(part.neighbours);
}

// N/m5: pressure per volume where the nodes from `firstGroup` on hang still under it.
double bulkThatGives(const WorldData& d, const HostRange& range, int firstGroup) {
  return range.bulk / (1 + range.bulk * swellingOf(d, firstGroup, range.endGroup));
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
  part.heldBulk = bulkThatGives(d, range, part.firstChoice);
}

// What hangs on a link moves with both ends: its mass goes to the two spheres by where it lies along their line, with
// the inertia that it has about that point. So a body's centre stays but for what lies unevenly about the line, and no
// sphere turns more easily than it does alone, which the step was chosen for. Whole at the sphere whose cell it lies
// in, first moments along the line are lost as well.
void shareOut(const SoftBodyModel& m, const ElasticLink& link, const Vector3d& node, double mass,
              std::vector<std::pair<int, BareSphere>>& to) {
  const Vector3d from = m.spheres[link.sphere0].restFrame, line = m.spheres[link.sphere1].restFrame - from;
  const double along = std::clamp((node - from).dot(line) / line.squaredNorm(), 0.0, 1.0);
  const Matrix3d about = inertiaAt(node - from - along * line);
  to.push_back({link.sphere0, {(1 - along) * mass, (1 - along) * mass * about}});
  to.push_back({link.sphere1, {along * mass, along * mass * about}});
}

void listCarriedNodes(WorldData& d, const std::vector<BodyMechanics>& mechanics) {
  std::vector<std::pair<int, BareSphere>> shares;
  for (std::size_t b = 0; b < d.bodies.size(); ++b) {
    if (d.bodies[b].surface != SurfaceMode::contact) continue;
    const SoftBodyModel& m = *d.bodies[b].model;
    for (std::size_t k = 0; k < mechanics[b].attachments.size(); ++k) {
      const int group = d.ranges[b].node[k] / 4, part = d.surface.ofGroup[group];
      if (group < d.surface.parts[part].firstChoice) continue;
      const Attachment& a = mechanics[b].attachments[k];
      const double mass = mechanics[b].nodeMass[k];
      shares.clear();
      if (a.onLink) {
        shareOut(m, m.links[a.host], m.restNodes[k], mass, shares);
      } else {
        const Vector3d r = m.restNodes[k] - m.spheres[a.massSphere].restFrame;
        shares.push_back({a.massSphere, {mass, mass * inertiaAt(r)}});
      }
      for (const auto& [sphere, share] : shares)
        d.surface.nodes.push_back({part, d.ranges[b].firstSphere + sphere, share});
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
  d.surface.partsAreNew = true;
  shareOutMasses(d);
  listAwake(d);
}

// Changing which parts move loses momentum: a node does not move exactly like its share of a turning sphere, and the
// momentum that edges gave a node vanishes when it is carried again. A body that turns gets the difference back as one
// rigid motion of the whole; at the hosts alone it would be a jolt. What is kept about is the pivot, or the body's own
// centre: that of its masses jumps by what nodes' shares lie off them, and about a fixed point a body that travels
// would begin to spin.
void changeParts(WorldData& d) {
  std::vector<WholeMotion> before, now;
  wholeMotions(d, before);
  partsChanged(d);
  wholeMotions(d, now);
  for (std::size_t b = 0; b < now.size(); ++b) {
    if (d.bodies[b].surface != SurfaceMode::contact || !canTurn(d.ranges[b])) continue;
    if (before[b].mass == 0 || now[b].mass == 0) continue;  // asleep
    const Pivot pivot = pivotOf(d, static_cast<int>(b));
    const Vector3d about = isFree(d.ranges[b]) ? Vector3d(now[b].moment / now[b].mass) : pivot.point;
    const Vector3d linear = before[b].linear - now[b].linear;
    const Vector3d spin = spinMomentum(before[b], pivot) - spinMomentum(now[b], pivot);
    addMomenta(d, static_cast<int>(b), now[b], linear, spin + about.cross(linear));
  }
}

// Wanted are the parts that loads act on, and those beside them.
void wantLoadedParts(WorldData& d, const Loads& loads) {
  for (SurfacePart& part : d.surface.parts) part.isWanted = false;
  const auto add = [&](int body, int node) {
    const int index = d.ranges[body].node[node];
    if (isSkin(d, index)) return;
    SurfacePart& part = d.surface.parts[d.surface.ofGroup[index / 4]];
    part.isWanted = true;
    for (const int beside : part.neighbours) d.surface.parts[beside].isWanted = true;
  };
  visitLoadedNodes(loads, [&add](const auto& load, int node) { add(load.body, node); });
  for (std::size_t b = 0; b < d.bodies.size(); ++b)
    for (const DeadLoad& load : d.bodies[b].deadLoads) add(static_cast<int>(b), load.node);
}

// Shifts of the part's nodes that move. Returns the largest of those that have the choice, m.
double measureShifts(WorldData& d, std::size_t part) {
  const HostRange range = movingRange(d, part);
  const double bulk = bulkThatGives(d, range, range.firstGroup);
  const Lanes3 gravity = hangingGravity(d, range.body);
  const double pressure = stillPressure(d, gravity, range.firstGroup, range.endGroup, bulk);
  Lanes squared = splat(0);
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const Lanes3 off = gatherFour(d.nodes.displaced, 4 * g) - hangingAt(d, gravity, splat(pressure), g);
    const Lanes isNode = isLess(splat(0), loadFour(d.nodes.mass, 4 * g));  // pads drift
    storeFour(off, d.surface.shift, 4 * g);
    if (g >= d.surface.parts[part].firstChoice) squared = larger(squared, masked(isNode, dot(off, off)));
  }
  return std::sqrt(largestOfLanes(squared));
}

// Shifts of the nodes of a part that is carried: to where edges and attachments hold them against their neighbours as
// these are, one step of Jacobi's iteration per frame. The neighbours so feel what they would of nodes that move.
// Returns the largest, m.
double balanceShifts(WorldData& d, std::size_t part) {
  SurfaceParts& s = d.surface;
  const Lanes zero = splat(0);
  Lanes squared = zero;
  for (int g = s.parts[part].firstChoice; g < rangeOf(d, part).endGroup; ++g) {
    const NodeGroup& group = d.nodes.groups[g];
    const Lanes3 alone = gatherFour(d.nodes.displaced, 4 * g) - gatherFour(s.shift, 4 * g);
    const Lanes3 pull = pullOfEdges(d.springs, d.nodes.groups.data(), d.nodes.displaced.data(), alone, g);
    const Lanes moves = isLess(zero, loadFour(d.nodes.inverseMass, 4 * g));
    const Lanes perForce = masked(moves, splat(1) / (group.stiffness + group.edges));
    const Lanes3 shift = yielding(d, g, perForce, perForce * pull);
    storeFour(shift, s.shift, 4 * g);
    squared = larger(squared, dot(shift, shift));
  }
  s.parts[part].isShifted = true;
  return std::sqrt(largestOfLanes(squared));
}

void clearShifts(WorldData& d, std::size_t part) {
  SurfacePart& p = d.surface.parts[part];
  if (!p.isShifted) return;
  p.isShifted = false;
  const auto nodes = d.surface.shift.begin();
  std::fill(nodes + 4 * p.firstChoice, nodes + 4 * rangeOf(d, part).endGroup, Quad{});
}

// A link's frame is asked for its nodes' loads; where none moves there are none.
void releaseLink(WorldData& d, std::size_t part) {
  if (part < d.nodes.onLinks.size() && rangeOf(d, part).firstGroup == d.surface.parts[part].firstChoice)
    d.links.loads[rangeOf(d, part).host] = {};
}

void carry(WorldData& d, std::size_t part) {
  d.surface.parts[part].moves = false;
  d.surface.parts[part].isShifted = true;
  releaseLink(d, part);
}

bool isAsleep(const WorldData& d, std::size_t part) {
  return d.rest[rangeOf(d, part).body].asleep;
}

bool hasChoice(const SurfaceParts& s) {
  return !s.nodes.empty();
}

}  // namespace

void layOutSurfaceParts(WorldData& d, const std::vector<BodyMechanics>& mechanics) {
  SurfaceParts& s = d.surface;
  layOutGive(d);
  s.shift.resize(d.nodes.dynamicEnd);
  s.parts.resize(d.nodes.onLinks.size() + d.nodes.onSpheres.size());
  s.ofGroup.resize(d.nodes.dynamicEnd / 4);
  for (std::size_t k = 0; k < s.parts.size(); ++k)
    for (int g = rangeOf(d, k).firstGroup; g < rangeOf(d, k).endGroup; ++g) s.ofGroup[g] = static_cast<int>(k);
  for (std::size_t k = 0; k < s.parts.size(); ++k) layOutPart(d, mechanics[rangeOf(d, k).body], k, s.parts[k]);
  s.spheres.resize(d.spheres.position.size());
  s.ownShare.resize(d.spheres.position.size(), 1);
  s.ownMoment.resize(d.spheres.position.size(), 0);
  for (std::size_t b = 0; b < mechanics.size(); ++b) {
    for (std::size_t i = 0; i < mechanics[b].sphereMass.size(); ++i) {
      const std::size_t k = d.ranges[b].firstSphere + i;
      s.spheres[k] = {mechanics[b].sphereMass[i], mechanics[b].sphereInertia[i]};
      if (mechanics[b].turns[i]) s.ownMoment[k] = symmetricEigen(mechanics[b].sphereInertia[i]).values[0];
    }
  }
  listCarriedNodes(d, mechanics);
  layOutCarriedWeight(d);
  for (std::size_t k = 0; k < s.parts.size(); ++k)
    if (!s.parts[k].moves) carry(d, k);
  partsChanged(d);
}

void moveLoadedParts(WorldData& d, const Loads& loads) {
  if (!hasChoice(d.surface)) return;
  wantLoadedParts(d, loads);
  bool changed = false;
  for (SurfacePart& part : d.surface.parts) {
    if (!part.isWanted || part.moves) continue;
    part.moves = changed = true;
    part.quietFrames = 0;
  }
  if (!changed) return;
  changeParts(d);
  placeCarriedNodes(d);  // what joins weighs by itself from now on, not on its hosts besides
}

HostRange movingRange(const WorldData& d, std::size_t part) {
  HostRange range = rangeOf(d, part);
  const SurfacePart& p = d.surface.parts[part];
  if (p.moves) return range;
  if (p.firstChoice > range.firstGroup) range.bulk = p.heldBulk;
  range.endGroup = p.firstChoice;
  return range;
}

void chooseSurfaceParts(WorldData& d, const Loads& loads) {
  if (!hasChoice(d.surface)) return;
  std::vector<SurfacePart>& parts = d.surface.parts;
  wantLoadedParts(d, loads);
  for (SurfacePart& part : parts) {
    part.isBeside = false;
    part.shifted = 0;
  }
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const bool moves = parts[k].moves || parts[k].firstChoice > rangeOf(d, k).firstGroup;
    if (!moves || parts[k].neighbours.empty() || isAsleep(d, k)) continue;
    parts[k].shifted = measureShifts(d, k);
    for (const int other : parts[k].neighbours) parts[other].isBeside = true;
  }
  for (std::size_t k = 0; k < parts.size(); ++k) {
    SurfacePart& part = parts[k];
    if (part.moves || isAsleep(d, k)) continue;
    if (!part.isBeside) clearShifts(d, k);
    if (part.isBeside && balanceShifts(d, k) > part.unrest) part.isWanted = true;
  }
  bool changed = false;
  const long enough = std::lround(kQuietFor / d.settings.frameDuration);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    SurfacePart& part = parts[k];
    if (part.always || isAsleep(d, k)) continue;
    const bool quiet = !part.isWanted && part.shifted < kQuiet * part.unrest;
    part.quietFrames = quiet ? part.quietFrames + 1 : 0;
    if (!part.moves && part.isWanted) {
      part.moves = changed = true;
    } else if (part.moves && part.quietFrames > enough) {
      carry(d, k);
      changed = true;
    }
  }
  if (!changed) return;
  runStage(d, evaluateHostLinks);
  placeCarriedNodes(d);  // what joins sets out from where its hosts are now, not from where they were a frame ago
  changeParts(d);
}

}  // namespace medulla
