#include <cstddef>

#include "physics/dynamics/anchor.h"
#include "physics/dynamics/identified_stages.h"
#include "physics/dynamics/implicit_stages.h"
#include "physics/dynamics/stages.h"
#include "physics/dynamics/still_nodes.h"

// Nodes that do not move by themselves: those of a skin, without mass, and those that SurfaceMode::contact carries,
// whose mass is their spheres' but whose weight acts where they hang.
namespace medulla {

namespace {

// N, of the four nodes of group g under `felt` (m/s2).
MEDULLA_INLINE Lanes3 weightOf(const WorldData& d, const Lanes3& felt, int g) {
  return loadFour(d.nodes.mass, 4 * g) * felt;
}

MEDULLA_INLINE void place(WorldData& d, const Anchor& anchor, int g) {
  put(positionOf(anchor) + gatherFour(d.nodes.displaced, 4 * g), d.nodes.position[g]);
  put(velocityAt(anchor, anchor.offset), d.nodes.velocity[g]);
  put(anchor.offset, d.nodes.offset[g]);
  put(anchor.area, d.nodes.area[g]);
}

// `weigh(host)` is asked once the range's nodes are placed.
template <class Weigh>
void placeOnLink(WorldData& d, const HostRange& range, const Weigh& weigh) {
  const LinkHost host = linkHost(d, range.host);
  for (int g = range.firstGroup; g < range.endGroup; ++g) place(d, anchorOnLink(host, d.nodes.groups[g]), g);
  weigh(host);
}

void placeOnSphere(WorldData& d, const HostRange& range) {
  const SphereHost host = sphereHost(d, range.host);
  for (int g = range.firstGroup; g < range.endGroup; ++g) place(d, anchorOnSphere(host, d.nodes.groups[g]), g);
}

void weighOnLink(WorldData& d, const HostRange& range, const LinkHost& host) {
  const Lanes3 felt = splat(d.surface.felt[range.body]);
  AnchorLoads sum = noLoads();
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const Lanes3 weight = weightOf(d, felt, g), &offset = d.nodes.offset[g];
    addLoads(host, d.nodes.groups[g], offset, weight, cross(offset, weight), sum);
  }
  setLoads(host, sum, d.surface.weightOnLinks[range.host]);
}

void weighOnSphere(WorldData& d, const HostRange& range) {
  const Lanes3 felt = splat(d.surface.felt[range.body]);
  Lanes3 sum = zeroVectors(), moment = sum;
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const Lanes3 weight = weightOf(d, felt, g);
    sum = sum + weight;
    moment = moment + cross(d.nodes.offset[g], weight);
  }
  addTo(d.surface.weight[2 * range.host], sumOfLanes(sum));
  addTo(d.surface.weight[2 * range.host + 1], sumOfLanes(moment));
}

void weighOnFrames(WorldData& d, const HostRange& range) {
  const Lanes3 felt = splat(d.surface.felt[range.body]);
  FrameReturn back(d, range);
  for (int g = range.firstGroup; g < range.endGroup; ++g) back.add(g, weightOf(d, felt, g), zeroVectors());
  back.finish();
}

// To where its nodes hang still from the anchors that place() has left them at, as they hung before.
void hang(WorldData& d, const HostRange& range) {
  const double pressure = stillPressure(d, range.firstGroup, range.endGroup, d.surface.parts[range.part].heldBulk);
  const HostRange moving = movingRange(d, range.part);
  if (moving.firstGroup == moving.endGroup) d.nodes.swollen[range.part] = range.bulk > 0 ? pressure / range.bulk : 0;
  const Lanes3 gravity = splat(d.gravity);
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const Lanes3 displaced = hangingAt(d, gravity, splat(pressure), g) + gatherFour(d.surface.shift, 4 * g);
    put(d.nodes.position[g] + (displaced - gatherFour(d.nodes.displaced, 4 * g)), d.nodes.position[g]);
    storeFour(displaced, d.nodes.displaced, 4 * g);
  }
}

// Sleepers keep theirs until they wake.
void clearWeight(WorldData& d) {
  SurfaceParts& s = d.surface;
  s.weight.resize(2 * d.spheres.position.size());
  for (const Batch& batch : d.awake.batches)
    for (const int i : batch.spheres) s.weight[2 * i] = s.weight[2 * i + 1] = {};
  s.weightOnLinks.assign(d.links.loads.size(), LinkLoads{});
  for (FrameLoad& load : d.identified.loads) load = {};
}

// What weighs at carried nodes already weighs at their spheres, where their mass is.
void takeWeightOffSpheres(WorldData& d) {
  SurfaceParts& s = d.surface;
  for (const Batch& batch : d.awake.batches) {
    for (const int b : batch.bodies) {
      const BodyRange& r = d.ranges[b];
      const Lanes felt = load(s.felt[b]);
      for (const int i : spheresOf(r)) {
        const double carried = d.spheres.groups[i / 4].mass[i % 4] - s.spheres[i].mass;
        store(s.weight[2 * i], fnma(splat(carried), felt, load(s.weight[2 * i])));
      }
    }
  }
}

}  // namespace

void placeCarriedNodes(WorldData& d) {
  SurfaceParts& s = d.surface;
  for (const HostRange& range : d.awake.skinOnLinks) placeOnLink(d, range, [](const LinkHost&) {});
  for (const HostRange& range : d.awake.skinOnSpheres)
    range.onFrames ? placeOnFrames(d, range) : placeOnSphere(d, range);
  const bool weigh = !s.felt.empty();
  if (weigh) clearWeight(d);
  for (const HostRange& range : d.awake.carriedOnLinks) {
    placeOnLink(d, range, [&](const LinkHost& host) {
      if (weigh) weighOnLink(d, range, host);
    });
    hang(d, range);
  }
  for (const HostRange& range : d.awake.carriedOnSpheres) {
    if (range.onFrames) {
      placeOnFrames(d, range);
      if (weigh) weighOnFrames(d, range);
    } else {
      placeOnSphere(d, range);
      if (weigh) weighOnSphere(d, range);
    }
    hang(d, range);
  }
  if (!weigh) return;
  returnLinkLoads(d, s.weightOnLinks, s.weight);
  returnFrameImpulses(d, s.weight);
  takeWeightOffSpheres(d);
}

// Less what the body falls by on the whole: one that falls freely would begin to turn. The w of each sum is the mass
// that it goes over.
void feelGravity(WorldData& d) {
  SurfaceParts& s = d.surface;
  const Lanes gravity = load(d.gravity);
  if (s.nodes.empty() || dotProduct(gravity, gravity) == 0) return;
  if (!s.velocityBefore.empty()) {
    s.felt.resize(d.bodies.size());
    for (std::size_t b = 0; b < d.bodies.size(); ++b) {
      const BodyRange& r = d.ranges[b];
      Lanes sum = splat(0);
      for (const int i : spheresOf(r)) {
        Lanes gained = load(d.spheres.velocity[i]) - load(s.velocityBefore[i]);
        gained[3] = 1;
        sum = fma(splat(d.spheres.groups[i / 4].mass[i % 4] - s.spheres[i].mass), gained, sum);
      }
      const double perFrame = sum[3] > 0 ? 1 / (sum[3] * d.settings.frameDuration) : 0;
      sum[3] = 0;
      store(s.felt[b], fnma(splat(perFrame), sum, gravity));
    }
  }
  s.velocityBefore = d.spheres.velocity;
}

}  // namespace medulla
