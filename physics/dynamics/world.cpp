#include "physics/dynamics/world.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "physics/content_hash.h"
#include "physics/dynamics/contact_stages.h"
#include "physics/dynamics/identified_stages.h"
#include "physics/dynamics/implicit_stages.h"
#include "physics/dynamics/layout.h"
#include "physics/dynamics/node_give.h"
#include "physics/dynamics/node_motion.h"
#include "physics/dynamics/rest_modes.h"
#include "physics/dynamics/stages.h"

namespace medulla {

namespace {

// The estimate is of the body at rest; bending, folding and compression stiffen it. The step is this share of it: at
// 0.7 and 0.85 no more bodies come through torture (equations/step.md).
constexpr double kStepSafety = 0.8;
// Less than this ratio takes nothing of what a mode gains as it stiffens and softens with the swings of others: a free
// body with all its modes shaken was not finite after 9 s at 0.6; at 0.4 it keeps its energy to 2 %.
constexpr double kUndampedSafety = 0.4, kLeastDamping = 0.005;
// s: what an implicit substep is unless the scene says otherwise; a bending mode of 5 Hz is damped by 8 % then.
constexpr double kImplicitStep = 0.005;
// s: an explicit one at most. How rigid bodies turn sets no limit of its own: where nothing gave, in substeps of 20 ms,
// one that spun by 16 rad/s turned over to its axis of least inertia and had four times its energy; at 10 ms it keeps
// it to 1 %.
constexpr double kExplicitStep = 0.01;

void checkSettings(const WorldSettings& s) {
  if (!(s.frameDuration > 0) || !std::isfinite(s.frameDuration))
    throw std::runtime_error(fmt::format("the dynamics frame lasts {} s: expected more than 0", s.frameDuration));
  if (s.substeps < 0) throw std::runtime_error(fmt::format("{} substeps: expected 0 (automatic) or more", s.substeps));
  if (s.order != 1 && s.order != 2) throw std::runtime_error(fmt::format("order {}: expected 1 or 2", s.order));
  if (s.settleFrames < 0)
    throw std::runtime_error(fmt::format("{} settling frames: expected 0 or more", s.settleFrames));
  if (!(s.sleepAfter >= 0))
    throw std::runtime_error(fmt::format("bodies sleep after {} s: expected 0 or more", s.sleepAfter));
  if (!s.gravity.allFinite()) throw std::runtime_error("gravity is not finite");
  if (!(s.ambientDrag >= 0) || !std::isfinite(s.ambientDrag))
    throw std::runtime_error(fmt::format("the ambient drag is {} /s: expected 0 or more", s.ambientDrag));
}

void checkLoads(const WorldData& d, const Loads& loads) {
  visitLoadedNodes(loads, [&](const auto& load, int node) {
    assert(load.body >= 0 && load.body < static_cast<int>(d.ranges.size()));
    assert(node >= 0 && node < static_cast<int>(d.ranges[load.body].node.size()));
    (void)load, (void)node, (void)d;
  });
}

// What a body does by itself.
void applyForces(WorldData& d, const Batch& batch) {
  shareStageArrays(d, batch);
  evaluateForces(d, batch);
  dampBodies(d, batch);
  stepVelocities(d, batch);
  dragVelocities(d, batch);
  useWholeStageArrays(d, batch);
}

// Of the k-th substep of the present frame, from 1.
StepTime timeOfSubstep(const WorldData& d, int k) {
  const double remaining = (d.substeps - k) * d.substep;
  return {static_cast<double>(d.frame + 1) * d.settings.frameDuration - remaining, remaining};
}

// What joins bodies to tools and to each other.
void applyLoadsAndContacts(WorldData& d, const Loads& loads, const StepTime& time,
                           std::vector<Eigen::Vector3d>& toolImpulse) {
  applyDeadLoads(d, time.end);
  driveSpheres(d, time.end, d.substep);
  applyLoads(d, loads, time.remaining, toolImpulse);
  resolveContacts(d);
}

void stepFrameExplicitly(WorldData& d, const Loads& loads, std::vector<Eigen::Vector3d>& toolImpulse) {
  for (int k = 1; k <= d.substeps && d.awake.bodies > 0; ++k) {
    // Positions at the substep's end together with the next one's forces, while what a batch reads is in the cache.
    runStage(
        d, k == 1 ? applyForces : [](WorldData& world, const Batch& batch) {
          stepPositions(world, batch);
          applyForces(world, batch);
        });
    applyLoadsAndContacts(d, loads, timeOfSubstep(d, k), toolImpulse);
    runStage(d, feelGravity);
  }
  runStage(d, stepPositions);
}

void stepFrameImplicitly(WorldData& d, const Loads& loads, std::vector<Eigen::Vector3d>& toolImpulse) {
  for (int k = 1; k <= d.substeps && d.awake.bodies > 0; ++k) {
    if (d.frame < 0) {  // later, the links' own damping is all that they need
      runStage(d, dampBodies);
      refreshAngularVelocities(d);
    }
    stepImplicitly(d, loads, timeOfSubstep(d, k), toolImpulse);
  }
}

// Beyond 1e4 (m, m/s) counts as infinite: a step that diverges passes there within one frame, and nothing downstream
// is made for such numbers. 0, or not a number.
Lanes zeroIfFinite(Lanes a) {
  constexpr double kOverflow = 1.8e304;
  return splat(0) * (splat(kOverflow) * a);
}

bool areSpheresFinite(const WorldData& d, const BodyRange& r) {
  Lanes sum = splat(0);
  for (const int i : spheresOf(r)) {
    sum = sum + zeroIfFinite(load(d.spheres.position[i])) + zeroIfFinite(load(d.spheres.velocity[i]));
    // Of any size: heavy bodies have large ones.
    sum = sum + splat(0) * (load(d.spheres.orientation[i]) + load(d.spheres.angularMomentum[i]));
  }
  return sumOfLanes(sum) == 0;
}

Lanes zeroIfFinite(const Lanes3& v) {
  return zeroIfFinite(v.x) + zeroIfFinite(v.y) + zeroIfFinite(v.z);
}

// Of all bodies, as they lie in memory: in the order of a body's mesh it takes ten times as long.
bool areNodesFinite(const WorldData& d) {
  Lanes sum = splat(0);
  for (std::size_t g = 0; g < d.nodes.position.size(); ++g)
    sum = sum + zeroIfFinite(d.nodes.position[g]) + zeroIfFinite(d.nodes.velocity[g]);
  return sumOfLanes(sum) == 0;
}

bool areNodesFinite(const WorldData& d, const BodyRange& r) {
  Lanes sum = splat(0);
  for (const int i : r.node)
    for (const std::vector<Lanes3>* all : {&d.nodes.position, &d.nodes.velocity})
      sum = sum + zeroIfFinite(load(quadOf(vectorAt(*all, i))));
  return sumOfLanes(sum) == 0;
}

void requireFinite(const WorldData& d, double time) {
  const bool allNodes = areNodesFinite(d);
  for (std::size_t b = 0; b < d.ranges.size(); ++b) {
    const BodyRange& r = d.ranges[b];
    if (d.rest[b].asleep || (areSpheresFinite(d, r) && (allNodes || areNodesFinite(d, r)))) continue;
    const std::string cause =
        d.settings.integrator == Integrator::explicitEuler && d.substep > d.stableSubstep
            ? fmt::format(
                  "the substep of {:.3g} s is above the stable {:.3g} s: use more substeps, or lower Young's "
                  "modulus or the damping ratio",
                  d.substep, d.stableSubstep)
            : fmt::format(
                  "it was deformed beyond what substeps of {:.3g} s follow: use more substeps, or a stiffer tissue, or "
                  "lower what acts on it: gravity, loads, the tools' speed, stiffness or damping",
                  d.substep);
    throw NotFinite(fmt::format("body '{}' is not finite at {:.6g} s: {}", d.bodies[b].name, time, cause));
  }
}

// Whether two bodies have the same BodyMechanics, wherever they lie and whatever loads them.
bool alike(const BodyDescription& a, const BodyDescription& b) {
  return a.model == b.model && a.tissue == b.tissue && a.steered == b.steered && a.surface == b.surface &&
         a.links == b.links && a.fixed == b.fixed && a.fixedNodes == b.fixedNodes && a.driven.empty() &&
         b.driven.empty();
}

// s: substeps that are stable by the estimate, and by their share of it that is safe, for all bodies.
struct StepLimits {
  double stable = std::numeric_limits<double>::infinity(), safe = stable;
};

// Substeps that its tissue allows.
StepLimits stepLimits(const BodyDescription& body, BodyMechanics& mechanics, const WorldSettings& settings) {
  // Below this a second of simulation takes over an hour: a wrong unit rather than a stiff tissue.
  constexpr double kLeastSubstep = 1e-8;
  const double stable = dampBody(body, mechanics, settings.integrator);
  const double safe = (body.tissue.damping < kLeastDamping ? kUndampedSafety : kStepSafety) * stable;
  if (settings.integrator == Integrator::explicitEuler && settings.substeps == 0 && safe < kLeastSubstep)
    throw std::runtime_error(
        fmt::format("its stable substep is {:.3g} s: expected at least {:.0e} s; lower Young's modulus or raise the "
                    "density",
                    safe, kLeastSubstep));
  return {stable, safe};
}

// Per body, and of all together. The modes at rest cost more than a hundred
// substeps: a heap of like bodies has them once.
std::vector<BodyMechanics> mechanicsOf(const std::vector<BodyDescription>& bodies, const WorldSettings& settings,
                                       StepLimits& limits) {
  std::vector<BodyMechanics> mechanics;
  for (const BodyDescription& body : bodies) {
    const auto same = std::find_if(bodies.begin(), bodies.begin() + static_cast<std::ptrdiff_t>(mechanics.size()),
                                   [&](const BodyDescription& earlier) { return alike(earlier, body); });
    const auto found = static_cast<std::size_t>(same - bodies.begin());
    if (found < mechanics.size()) {
      mechanics.push_back(BodyMechanics(mechanics[found]));
      continue;
    }
    const auto refusal = [&body](const std::runtime_error& e) {
      return fmt::format("body '{}' cannot be simulated: {}", body.name, e.what());
    };
    try {
      mechanics.push_back(bodyMechanics(body));
    } catch (const std::runtime_error& e) {
      throw std::runtime_error(refusal(e));
    }
    mechanics.back().firstLike = static_cast<int>(found);
    try {
      const StepLimits own = stepLimits(body, mechanics.back(), settings);
      limits = {std::min(limits.stable, own.stable), std::min(limits.safe, own.safe)};
    } catch (const std::runtime_error& e) {
      throw TissueRefused(static_cast<int>(found), refusal(e));
    }
  }
  return mechanics;
}

}  // namespace

// Per dynamics frame. Steps that are stable may still miss what drives a body: of 5 ms, all that swings at 200 Hz.
static int chosenSubsteps(const WorldSettings& settings, const std::vector<BodyDescription>& bodies, double safe) {
  constexpr double kPerSwing = 16, kShortest = 1e-6;  // s; nobody waits for what swings faster
  double longest = settings.integrator == Integrator::implicit ? kImplicitStep : std::min(safe, kExplicitStep);
  for (const BodyDescription& body : bodies)
    for (const DrivenSphere& driven : body.driven)
      if (driven.amplitude > 0) longest = std::min(longest, std::max(kShortest, 1 / (kPerSwing * driven.frequency)));
  return std::max(1, static_cast<int>(std::ceil(settings.frameDuration / longest)));
}

World::World(const WorldSettings& settings, std::vector<BodyDescription> bodies,
             const std::vector<StaticShape>& statics) {
  checkSettings(settings);
  StepLimits limits;
  std::vector<BodyMechanics> mechanics = mechanicsOf(bodies, settings, limits);
  data_ = layOut(settings, std::move(bodies), mechanics);
  data_->stableSubstep = limits.stable;
  data_->substeps = settings.substeps > 0 ? settings.substeps : chosenSubsteps(settings, data_->bodies, limits.safe);
  data_->substep = settings.frameDuration / data_->substeps;
  for (BodyRange& r : data_->ranges) r.settlingDamping = std::min(r.settlingDamping, 1 / data_->substep);
  data_->keptByDrag = 1 / (1 + data_->substep * settings.ambientDrag);
  for (std::size_t b = 0; b < mechanics.size(); ++b) {  // of like bodies the first one's say all
    const int like = mechanics[b].firstLike;
    if (like == static_cast<int>(b)) continue;
    mechanics[b] = {};
    mechanics[b].firstLike = like;
  }
  data_->mechanics = std::move(mechanics);
  layOutDeadLoads(*data_);
  layOutContact(*data_, statics);
}

World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

const std::vector<BodyDescription>& World::bodies() const {
  return data_->bodies;
}
int World::substepsPerFrame() const {
  return data_->substeps;
}
double World::substep() const {
  return data_->substep;
}
double World::stableSubstep() const {
  return data_->stableSubstep;
}
double World::time() const {
  return static_cast<double>(data_->frame) * data_->settings.frameDuration;
}

std::vector<Eigen::Vector3d> World::advance(const Loads& loads) {
  WorldData& d = *data_;
  checkLoads(d, loads);
  int tools = 0;
  visitLoadedNodes(loads, [&tools](const auto& load, int) { tools = std::max(tools, load.tool + 1); });
  std::vector<Eigen::Vector3d> toolImpulse(tools, Eigen::Vector3d::Zero());
  carryLoadForces(d, loads);
  dropCostlyTurns(d);
  wakeLoaded(d, loads);
  moveLoadedParts(d, loads);
  frameLoadedSkins(d, loads);
  rememberFalling(d);
  const bool implicit = d.settings.integrator == Integrator::implicit;
  (implicit ? stepFrameImplicitly : stepFrameExplicitly)(d, loads, toolImpulse);
  ++d.frame;
  startDrivenBodies(d);
  hangByFelt(d);
  chooseSurfaceParts(d, loads);
  fallAsleep(d, loads);
  // The frames that readers hang nodes on are those of the state at the end.
  runStage(d, evaluateHostLinks);
  placeCarriedNodes(d);
  requireFinite(d, time());
  return toolImpulse;
}

void World::readFrame(DynamicsFrame& out) const {
  const WorldData& d = *data_;
  out.time = time();
  out.bodies.resize(d.ranges.size());
  for (std::size_t b = 0; b < d.ranges.size(); ++b) {
    const BodyRange& r = d.ranges[b];
    BodyFrame& f = out.bodies[b];
    f.nodes.resize(r.node.size());
    f.spheres.resize(r.sphereCount);
    for (std::size_t i = 0; i < r.node.size(); ++i) f.nodes[i] = vectorAt(d.nodes.position, r.node[i]);
    for (int i = 0; i < r.sphereCount; ++i) {
      f.spheres[i].position = vectorOf(d.spheres.position[r.firstSphere + i]);
      f.spheres[i].worldFromSphere = quaternionOf(d.spheres.orientation[r.firstSphere + i]);
    }
  }
}

Energies World::energies() const {
  runStage(*data_, evaluateAttachments);
  const WorldData& d = *data_;
  Energies e;
  e.elastic = elasticEnergy(d);
  const Eigen::Vector3d g = vectorOf(d.gravity);
  for (int i = 0; i < d.spheres.count; ++i) {
    const double mass = d.spheres.groups[i / 4].mass[i % 4];
    e.kinetic += 0.5 * mass * vectorOf(d.spheres.velocity[i]).squaredNorm() +
                 0.5 * vectorOf(d.spheres.angularVelocity[i]).dot(vectorOf(d.spheres.angularMomentum[i]));
    e.gravity -= d.surface.spheres[i].mass * g.dot(vectorOf(d.spheres.position[i]));
  }
  for (int i = 0; i < d.nodes.dynamicEnd; ++i) {
    e.gravity -= d.nodes.mass[i] * g.dot(vectorAt(d.nodes.position, i));
    if (isCarried(d.surface, i / 4)) continue;  // its mass is its spheres', though it weighs where it hangs
    e.kinetic += 0.5 * d.nodes.mass[i] * vectorAt(d.nodes.velocity, i).squaredNorm();
  }
  return e;
}

double World::volumeRatio(int body) const {
  const BodyRange& r = data_->ranges.at(body);
  thread_local std::vector<Quad> nodes;  // kept: asked in every frame
  nodes.resize(r.node.size());
  if (nodes.empty()) return 1;
  for (std::size_t i = 0; i < r.node.size(); ++i) nodes[i] = quadOf(vectorAt(data_->nodes.position, r.node[i]));
  // About the first node, as in enclosedVolume().
  const Lanes origin = load(nodes[0]);
  Lanes volume = splat(0);
  for (const auto& t : data_->bodies[body].model->triangles) {
    const Lanes a = load(nodes[t[0]]), b = load(nodes[t[1]]), c = load(nodes[t[2]]);
    volume = fma(a - origin, crossProduct(b - a, c - a), volume);
  }
  return sumOfLanes(volume) / (6 * r.restVolume);
}

double World::lowestFrequency(int body) const {
  return data_->ranges.at(body).lowestFrequency;
}

std::vector<std::vector<NodeGive>> World::nodeGive() const {
  const WorldData& d = *data_;
  std::vector<std::vector<NodeGive>> out;
  for (std::size_t b = 0; b < d.mechanics.size(); ++b) {
    const auto like = static_cast<std::size_t>(d.mechanics[b].firstLike);
    out.push_back(like < b ? std::vector<NodeGive>(out[like])
                           : medulla::nodeGive(d.bodies[b], d.mechanics[b], {d.substeps, d.substep}));
  }
  return out;
}

int World::dynamicNodes(int body) const {
  const WorldData& d = *data_;
  if (d.rest[body].asleep) return 0;
  int count = 0;
  for (const int i : d.ranges[body].node) count += !isSkin(d, i) && !isCarried(d.surface, i / 4);
  return count;
}

PenetrationReport World::penetration() const {
  return data_->contact.penetration;
}
const std::vector<BodyOverlap>& World::startOverlaps() const {
  return data_->contact.startOverlaps;
}

const CreepReport& World::creep() const {
  return data_->creep;
}

bool World::hasTurnedOver(int body) const {
  return data_->identified.bodies.at(body).turnedOver;
}

std::uint64_t World::stateHash() const {
  const WorldData& d = *data_;
  NumberHash hash;
  const auto add = [&](const Quad& q, int count) {
    for (int k = 0; k < count; ++k) hash.add(q.v[k]);
  };
  hash.add(time());
  for (const BodyRange& r : d.ranges) {
    for (const int i : spheresOf(r)) {
      add(d.spheres.position[i], 3);
      add(d.spheres.velocity[i], 3);
      add(d.spheres.orientation[i], 4);
      add(d.spheres.angularMomentum[i], 3);
    }
    for (int k = r.firstLink; k < r.firstLink + r.linkCount; ++k) hash.add(d.links.unwoundTwist[k / 4].v[k % 4]);
    for (int i : r.node) {
      add(quadOf(vectorAt(d.nodes.position, i)), 3);
      add(quadOf(vectorAt(d.nodes.velocity, i)), 3);
    }
  }
  for (const Eigen::Vector3d& force : d.loadForces) add(quadOf(force), 3);
  for (const MomentumChange& change : d.contact.change) {
    if (d.loadForces.empty()) break;  // nothing starts from it
    add(change.velocity, 3);
    add(change.angularMomentum, 3);
  }
  for (const std::vector<CarriedImpulse>* impulses : {&d.contact.carried, &d.contact.resting}) {
    for (const CarriedImpulse& c : *impulses) {
      hash.add(c.key);
      add(c.impulse, 3);
    }
  }
  for (const HeldFriction& held : d.contact.held) {
    hash.add(held.key);
    add(held.force, 3);
    hash.add(held.energy);
  }
  for (const SurfacePart& p : d.surface.parts)
    if (!p.always) hash.add(p.moves ? p.quietFrames : -1.0);
  for (const Quad& q : d.surface.felt) add(q, 3);
  for (const CarriedWeight& w : d.surface.carriedWeight)
    for (const auto* columns : {&w.force, &w.moment})
      for (const Lanes3& column : *columns)
        for (int lane = 0; lane < 4; ++lane) add(quadOf(vectorOf(column, lane)), 3);
  if (d.settings.integrator == Integrator::implicit)
    for (const EnergyLedger& l : d.ledger)
      for (const double energy : {l.most, l.due, l.mostDue}) hash.add(energy);
  for (const Rest& r : d.rest) hash.add(r.asleep ? -1.0 : r.stillFrames);
  for (const StillPlace& place : d.stillPlace) {
    add(place.position, 3);
    add(place.orientation, 4);
  }
  return hash.value();
}

}  // namespace medulla
