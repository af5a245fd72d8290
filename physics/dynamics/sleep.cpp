#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include "physics/dynamics/contact_stages.h"
#include "physics/dynamics/stages.h"
#include "physics/model/disjoint_sets.h"

// Bodies that have come to rest are left alone, together with all that touches them (islands, as in Box2D): what lies
// still needs no model. Stillness is one of place, not of speed: contacts that bear a heap chatter by micrometres at
// millimetres per second.
namespace medulla {

namespace {

constexpr double kStill = 0.01;  // of the body's mean radius, which no sphere's surface may have moved by

// Whether every sphere is where it was at the first of the frames counted so far.
bool keepsStill(const WorldData& d, std::size_t body) {
  const BodyRange& r = d.ranges[body];
  const double within = kStill * meanRadius(*d.bodies[body].model);
  for (int i = 0; i < r.sphereCount; ++i) {
    const StillPlace& from = d.stillPlace[r.firstSphere + i];
    const Lanes moved = load(d.spheres.position[r.firstSphere + i]) - load(from.position);
    const double cosine = dotProduct(load(d.spheres.orientation[r.firstSphere + i]), load(from.orientation));
    const double turned = 2 * std::sqrt(std::max(0.0, 1 - cosine * cosine)) * d.bodies[body].model->spheres[i].radius;
    if (dotProduct(moved, moved) + turned * turned > within * within) return false;
  }
  return true;
}

void countStillFrames(WorldData& d, const std::vector<char>& busy) {
  for (std::size_t b = 0; b < d.rest.size(); ++b) {
    Rest& rest = d.rest[b];
    if (rest.asleep) continue;
    if (!busy[b] && rest.stillFrames > 0 && keepsStill(d, b)) {
      ++rest.stillFrames;
      continue;
    }
    rest.stillFrames = busy[b] ? 0 : 1;
    const BodyRange& r = d.ranges[b];
    for (const int i : spheresOf(r)) d.stillPlace[i] = {d.spheres.position[i], d.spheres.orientation[i]};
  }
}

// Bodies that tools or dead loads act on.
std::vector<char> loadedBodies(const WorldData& d, const Loads& loads) {
  std::vector<char> loaded(d.bodies.size(), 0);
  for (std::size_t b = 0; b < loaded.size(); ++b) loaded[b] = !d.bodies[b].deadLoads.empty();
  visitLoadedNodes(loads, [&loaded](const auto& load, int) { loaded[load.body] = 1; });
  return loaded;
}

// Per body, the first body of its island: those that contacts join.
std::vector<int> islandsOf(const WorldData& d, const std::vector<CarriedImpulse>& impulses) {
  DisjointSets islands(d.bodies.size());
  for (const CarriedImpulse& c : impulses) {
    const auto [a, b] = bodiesOf(d, c.key);
    if (b >= 0) islands.join(a, b);
  }
  std::vector<int> first(d.bodies.size());
  for (std::size_t b = 0; b < first.size(); ++b) first[b] = islands.of(static_cast<int>(b));
  return first;
}

void stop(WorldData& d, const BodyRange& r) {
  for (const int i : spheresOf(r))
    d.spheres.velocity[i] = d.spheres.angularMomentum[i] = d.spheres.angularVelocity[i] = {};
  for (const int i : r.node) setVector(d.nodes.velocity, i, Eigen::Vector3d::Zero());
}

// Moves the impulses of contacts of bodies that are `asleep`, or are not. Both lists ascend in key and go on to.
void moveImpulses(const WorldData& d, bool asleep, std::vector<CarriedImpulse>& from, std::vector<CarriedImpulse>& to) {
  std::vector<CarriedImpulse> moved, all;
  std::erase_if(from, [&](const CarriedImpulse& c) {
    if (d.rest[bodiesOf(d, c.key)[0]].asleep != asleep) return false;
    moved.push_back(c);
    return true;
  });
  std::merge(to.begin(), to.end(), moved.begin(), moved.end(), std::back_inserter(all),
             [](const CarriedImpulse& a, const CarriedImpulse& b) { return a.key < b.key; });
  to = std::move(all);
}

// Links' frames are for nodes that move by themselves and for skins that loads act on, at a frame's end for all nodes.
void shareOutLinkGroups(WorldData& d) {
  std::vector<char> framed(d.links.groups.size(), 0), hosts = framed;
  for (const std::vector<HostRange>* ranges : {&d.nodes.onLinks, &d.nodes.skinOnLinks})
    for (const HostRange& range : *ranges) hosts[range.host / 4] = 1;
  for (std::size_t b = 0; b < d.awake.loadedSkins.size(); ++b) {
    if (!d.awake.loadedSkins[b]) continue;
    for (int k = 0; k < d.ranges[b].linkCount; ++k) framed[(d.ranges[b].firstLink + k) / 4] = 1;
  }
  for (Batch& batch : d.awake.batches) {
    for (const HostRange& range : batch.onLinks) framed[range.host / 4] = 1;
    for (const int g : batch.linkGroups) {
      (framed[g] ? batch.framedLinkGroups : batch.bareLinkGroups).push_back(g);
      if (hosts[g]) batch.hostLinkGroups.push_back(g);
    }
  }
}

// Skins, and what of each host's nodes is carried.
void listStillNodes(WorldData& d) {
  Awake& a = d.awake;
  const auto isAwake = [&](const HostRange& range) { return !d.rest[range.body].asleep; };
  const auto listSkins = [&](const std::vector<HostRange>& from, std::vector<HostRange>& to) {
    to.clear();
    std::copy_if(from.begin(), from.end(), std::back_inserter(to), isAwake);
  };
  listSkins(d.nodes.skinOnLinks, a.skinOnLinks);
  listSkins(d.nodes.skinOnSpheres, a.skinOnSpheres);
  std::size_t part = 0;
  const auto listCarried = [&](const std::vector<HostRange>& from, std::vector<HostRange>& to) {
    to.clear();
    for (HostRange range : from) {
      const SurfacePart& p = d.surface.parts[part++];
      range.firstGroup = p.firstChoice;
      if (!p.moves && isAwake(range)) to.push_back(range);
    }
  };
  listCarried(d.nodes.onLinks, a.carriedOnLinks);
  listCarried(d.nodes.onSpheres, a.carriedOnSpheres);
}

// `visit(array, groups, perGroup)` of all that lies in such arrays: the batch's groups, and places for each of them.
template <class Visit>
void visitStageArrays(WorldData& d, const Batch& batch, const Visit& visit) {
  for (StageArray<Lanes3>* of : {&d.nodes.force, &d.nodes.offset, &d.nodes.area}) visit(*of, batch.nodeGroups, 1);
  visit(d.nodes.displaced, batch.nodeGroups, 4);
  visit(d.links.frames, batch.linkGroups, 1);
  visit(d.links.slots, batch.linkGroups, 8);
}

// A surface that moves as a whole needs what its stages leave within its batch alone; contact mode weighs it at the
// frame's end, and loads on skins between the stages. A world of one batch has nothing to share with.
void shareStages(WorldData& d) {
  const Awake& a = d.awake;
  const auto keepsNothing = [&](int b) {
    const SurfaceMode surface = d.bodies[b].surface;
    return surface == SurfaceMode::full ||
           (surface == SurfaceMode::skin && (a.loadedSkins.empty() || !a.loadedSkins[b]));
  };
  for (Batch& batch : d.awake.batches) {
    batch.sharesStages = a.batches.size() > 1 && std::all_of(batch.bodies.begin(), batch.bodies.end(), keepsNothing);
    if (!batch.sharesStages) continue;
    visitStageArrays(d, batch, [](auto& array, const std::vector<int>& groups, std::size_t perGroup) {
      if (!groups.empty()) array.reserveShared(perGroup * static_cast<std::size_t>(groups.back() - groups.front() + 1));
    });
  }
}

}  // namespace

void shareStageArrays(WorldData& d, const Batch& batch) {
  if (!batch.sharesStages) return;
  visitStageArrays(d, batch, [](auto& array, const std::vector<int>& groups, std::size_t perGroup) {
    if (!groups.empty()) array.useShared(perGroup * static_cast<std::size_t>(groups.front()));
  });
}

void useWholeStageArrays(WorldData& d, const Batch& batch) {
  visitStageArrays(d, batch, [](auto& array, const std::vector<int>&, std::size_t) { array.useWhole(); });
}

void listAwake(WorldData& d) {
  Awake& a = d.awake;
  a.bodies = 0;
  a.batches.assign(d.ranges.empty() ? 0 : d.ranges.back().batch + 1, {});
  const auto addGroup = [](std::vector<int>& groups, int index) {
    if (groups.empty() || groups.back() != index / 4) groups.push_back(index / 4);
  };
  for (std::size_t b = 0; b < d.ranges.size(); ++b) {
    const BodyRange& r = d.ranges[b];
    if (d.rest[b].asleep) continue;
    ++a.bodies;
    Batch& batch = a.batches[r.batch];
    batch.bodies.push_back(static_cast<int>(b));
    for (const int i : spheresOf(r)) {
      batch.spheres.push_back(i);
      addGroup(batch.sphereGroups, i);
    }
    for (int k = r.firstLink; k < r.firstLink + r.linkCount; ++k) addGroup(batch.linkGroups, k);
  }
  std::size_t part = 0;
  const auto list = [&](const std::vector<HostRange>& from, std::vector<HostRange> Batch::*to) {
    for (std::size_t k = 0; k < from.size(); ++k) {
      const HostRange range = movingRange(d, part++);
      if (range.firstGroup == range.endGroup || d.rest[range.body].asleep) continue;
      Batch& batch = a.batches[d.ranges[range.body].batch];
      (batch.*to).push_back(range);
      for (int g = range.firstGroup; g < range.endGroup; ++g) batch.nodeGroups.push_back(g);
    }
  };
  list(d.nodes.onLinks, &Batch::onLinks);
  list(d.nodes.onSpheres, &Batch::onSpheres);
  for (Batch& batch : a.batches) std::sort(batch.nodeGroups.begin(), batch.nodeGroups.end());
  listStillNodes(d);
  shareOutLinkGroups(d);
  shareStages(d);
}

void frameLoadedSkins(WorldData& d, const Loads& loads) {
  std::vector<char> loaded = loadedBodies(d, loads);
  for (std::size_t b = 0; b < loaded.size(); ++b)
    if (d.bodies[b].surface != SurfaceMode::skin) loaded[b] = 0;
  if (loaded == d.awake.loadedSkins) return;
  d.awake.loadedSkins = std::move(loaded);
  listAwake(d);
}

void layOutRest(WorldData& d) {
  d.rest.resize(d.bodies.size());
  d.stillPlace.resize(d.spheres.position.size());
}

void fallAsleep(WorldData& d, const Loads& loads) {
  if (d.settings.integrator == Integrator::implicit || d.settings.sleepAfter == 0 || d.awake.bodies == 0) return;
  std::vector<char> busy = loadedBodies(d, loads);
  for (std::size_t b = 0; b < busy.size(); ++b)
    if (!d.bodies[b].driven.empty()) busy[b] = 1;
  countStillFrames(d, busy);
  const double enough = d.settings.sleepAfter / d.settings.frameDuration;
  // Through a swing of its slowest mode at least: at a turning point, or creeping, what is slow seems still for long.
  const auto isTired = [&](std::size_t b) {
    const double lowest = d.ranges[b].lowestFrequency;
    const double swing = lowest > 0 ? 2 * std::numbers::pi / (lowest * d.settings.frameDuration) : 0;
    // The first frame has nothing to be compared with.
    return !d.rest[b].asleep && d.rest[b].stillFrames > std::max({1.0, enough, swing});
  };
  bool isAny = false;
  for (std::size_t b = 0; b < d.rest.size() && !isAny; ++b) isAny = isTired(b);
  if (!isAny) return;
  const std::vector<int> island = islandsOf(d, d.contact.carried);
  std::vector<char> sleeps(d.bodies.size(), 1);  // by the island's first body
  for (std::size_t b = 0; b < island.size(); ++b)
    if (!isTired(b)) sleeps[island[b]] = 0;
  bool any = false;
  for (std::size_t b = 0; b < island.size(); ++b) {
    if (!sleeps[island[b]]) continue;
    any = d.rest[b].asleep = true;
    stop(d, d.ranges[b]);
  }
  if (!any) return;
  moveImpulses(d, true, d.contact.carried, d.contact.resting);
  runStage(d, evaluateHostLinks);  // once more, for the nodes that hang on them: without speed
  runStage(d, evaluateAttachments);
  placeCarriedNodes(d);
  listAwake(d);
  d.contact.listsAreOld = true;
}

void wake(WorldData& d, int body) {
  if (!d.rest[body].asleep) return;
  const std::vector<int> island = islandsOf(d, d.contact.resting);
  for (std::size_t b = 0; b < island.size(); ++b)
    if (island[b] == island[body]) d.rest[b] = {};
  moveImpulses(d, false, d.contact.resting, d.contact.carried);
  listAwake(d);
  d.contact.listsAreOld = true;
}

void wakeLoaded(WorldData& d, const Loads& loads) {
  visitLoadedNodes(loads, [&d](const auto& load, int) { wake(d, load.body); });
}

void wakeTouched(WorldData& d) {
  if (d.awake.bodies == static_cast<int>(d.bodies.size())) return;
  std::vector<int> touched;
  for (const CarriedImpulse& c : d.contact.carried)
    for (const int body : bodiesOf(d, c.key))
      if (body >= 0 && d.rest[body].asleep) touched.push_back(body);
  for (const int body : touched) wake(d, body);
}

}  // namespace medulla
