#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/dynamics/node_motion.h"
#include "physics/dynamics/stages.h"

// SurfaceMode::contact: a host's nodes move by themselves only where something acts on them or what acts has spread to
// them. The others are carried: they hang still from their anchors, and their mass is their spheres'. Parts join and
// leave between frames.
namespace medulla {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kUnrest =
    0.002;                        // of the body's mean radius, besides what weight sinks nodes by: edges share that out
constexpr double kQuiet = 0.5;    // of that: nodes nearer are at rest
constexpr int kQuietFrames = 10;  // a fifth of a second at 50 Hz: several periods of a node on its attachment

const HostRange& rangeOf(const WorldData& d, std::size_t part) {
  const std::size_t onLinks = d.nodes.onLinks.size();
  return part < onLinks ? d.nodes.onLinks[part] : d.nodes.onSpheres[part - onLinks];
}

// An attachment's stiffness, N/m, along the surface and, what identified ones are more, along the node's normal.
double stiffnessAlong(const WorldData& d, int node) {
  return d.nodes.groups[node / 4].stiffness[node % 4];
}
double normalExcess(const WorldData& d, int node) {  // N/m5, times the node's area squared
  const int skin = d.identified.ofNodeGroup[node / 4];
  return skin < 0 ? 0 : d.identified.skin[skin].normalExcess[node % 4];
}
double stiffnessAcross(const WorldData& d, int node) {
  return stiffnessAlong(d, node) + normalExcess(d, node) * vectorAt(d.nodes.area, node).squaredNorm();
}

Vector3d sagOf(const WorldData& d, int node) {  // m, without pressure
  if (d.nodes.inverseMass[node] == 0) return Vector3d::Zero();
  const Vector3d even = d.nodes.mass[node] / stiffnessAlong(d, node) * vectorOf(d.gravity);
  const Vector3d area = vectorAt(d.nodes.area, node);
  return even - normalExcess(d, node) * area.dot(even) / stiffnessAcross(d, node) * area;
}

double deepestSag(const WorldData& d, const HostRange& range) {
  double most = 0;
  for (int i = 4 * range.firstGroup; i < 4 * range.endGroup; ++i) most = std::max(most, sagOf(d, i).norm());
  return most;
}

// Where a host's nodes hang still from their anchors: k x = m g - p a, and p = bulk sum a.x is the host's pressure.
// Their mean weight alone would not do: a host's patch of surface is open, so that nodes which all sink alike press.
class StillNodes {
 public:
  StillNodes(const WorldData& d, const HostRange& range) : d_(&d) {
    double sunk = 0, give = 0;
    for (int i = 4 * range.firstGroup; i < 4 * range.endGroup; ++i) {
      if (d.nodes.inverseMass[i] == 0) continue;
      const Vector3d area = vectorAt(d.nodes.area, i);
      sunk += area.dot(sagOf(d, i));
      give += area.squaredNorm() / stiffnessAcross(d, i);
    }
    pressure_ = range.bulk * sunk / (1 + range.bulk * give);
    swollen_ = range.bulk > 0 ? pressure_ / range.bulk : 0;
  }
  Vector3d displaced(int node) const {  // m
    if (d_->nodes.inverseMass[node] == 0) return Vector3d::Zero();
    return sagOf(*d_, node) - pressure_ / stiffnessAcross(*d_, node) * vectorAt(d_->nodes.area, node);
  }
  double swollen() const { return swollen_; }  // m3

 private:
  const WorldData* d_;
  double pressure_, swollen_;
};

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
  if (part.always) return;
  listNeighbours(d, d.surface.ofGroup, range, part);
  part.unrest = kUnrest * meanRadius(*d.bodies[range.body].model) + deepestSag(d, range);
  const bool held = isHeld(d, mechanics, k);
  for (int i = 4 * range.firstGroup; i < 4 * range.endGroup; ++i) {
    if (d.nodes.mass[i] == 0) continue;
    part.always = part.always || (d.nodes.inverseMass[i] == 0 && !held);
  }
  part.moves = part.always;
}

void listCarriedNodes(WorldData& d, const std::vector<BodyMechanics>& mechanics) {
  for (std::size_t b = 0; b < d.bodies.size(); ++b) {
    if (d.bodies[b].surface != SurfaceMode::contact) continue;
    const SoftBodyModel& m = *d.bodies[b].model;
    for (std::size_t k = 0; k < mechanics[b].attachments.size(); ++k) {
      const int part = d.surface.ofGroup[d.ranges[b].node[k] / 4], sphere = mechanics[b].attachments[k].massSphere;
      const Vector3d r = m.restNodes[k] - m.spheres[sphere].restFrame;
      const double mass = mechanics[b].nodeMass[k];
      const Matrix3d inertia = mass * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose());
      if (!d.surface.parts[part].always)
        d.surface.nodes.push_back({part, d.ranges[b].firstSphere + sphere, {mass, inertia}});
    }
  }
  std::stable_sort(d.surface.nodes.begin(), d.surface.nodes.end(),
                   [](const CarriedNode& a, const CarriedNode& b) { return a.sphere < b.sphere; });
}

void setMass(WorldData& d, int sphere, const BareSphere& mass) {
  SphereGroup& g = d.spheres.groups[sphere / 4];
  const int l = sphere % 4;
  g.mass[l] = mass.mass;
  if (g.inverseMass[l] > 0) g.inverseMass[l] = 1 / mass.mass;
  setInverseInertia(g, l, mass.inertia.inverse());
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

// m: how far the part's nodes are from where they hang at rest, at most.
double unrestOf(const WorldData& d, std::size_t part) {
  const HostRange& range = rangeOf(d, part);
  const StillNodes still(d, range);
  double squared = 0;
  for (int i = 4 * range.firstGroup; i < 4 * range.endGroup; ++i)
    if (d.nodes.mass[i] > 0)
      squared = std::max(squared, (vectorOf(d.nodes.displaced[i]) - still.displaced(i)).squaredNorm());
  return std::sqrt(squared);
}

// The nodes of a part that does not move are where they hang still.
void hang(WorldData& d, std::size_t part) {
  const HostRange& range = rangeOf(d, part);
  const StillNodes still(d, range);
  d.nodes.swollen[range.part] = still.swollen();
  for (int i = 4 * range.firstGroup; i < 4 * range.endGroup; ++i)
    if (d.nodes.mass[i] > 0) d.nodes.displaced[i] = quadOf(still.displaced(i));
}

void carry(WorldData& d, std::size_t part) {
  d.surface.parts[part].moves = false;
  if (part < d.nodes.onLinks.size()) d.links.loads[rangeOf(d, part).host] = {};
  hang(d, part);
}

bool hasChoice(const SurfaceParts& s) {
  return !s.nodes.empty();
}

}  // namespace

void layOutSurfaceParts(WorldData& d, const std::vector<BodyMechanics>& mechanics) {
  SurfaceParts& s = d.surface;
  s.parts.resize(d.nodes.onLinks.size() + d.nodes.onSpheres.size());
  s.ofGroup.resize(d.nodes.dynamicEnd / 4);
  for (std::size_t k = 0; k < s.parts.size(); ++k)
    for (int g = rangeOf(d, k).firstGroup; g < rangeOf(d, k).endGroup; ++g) s.ofGroup[g] = static_cast<int>(k);
  for (std::size_t k = 0; k < s.parts.size(); ++k) layOutPart(d, mechanics[rangeOf(d, k).body], k, s.parts[k]);
  s.spheres.resize(d.spheres.position.size());
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

void chooseSurfaceParts(WorldData& d, const Loads& loads) {
  if (!hasChoice(d.surface)) return;
  std::vector<SurfacePart>& parts = d.surface.parts;
  std::vector<char> wanted = loadedParts(d, loads);
  std::vector<double> unrest(parts.size(), 0);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (!parts[k].moves || parts[k].neighbours.empty()) continue;
    unrest[k] = unrestOf(d, k);
    if (unrest[k] > parts[k].unrest)
      for (const int beside : parts[k].neighbours) wanted[beside] = 1;
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
