#include "physics/dynamics/anchor.h"
#include "physics/dynamics/identified_stages.h"
#include "physics/dynamics/implicit_stages.h"
#include "physics/dynamics/stages.h"
#include "physics/dynamics/still_nodes.h"

// Nodes that do not move by themselves: those of a skin, without mass, and those that SurfaceMode::contact carries,
// whose mass is their spheres' but whose weight acts where they hang.
namespace medulla {

namespace {

MEDULLA_INLINE void place(WorldData& d, const Anchor& anchor, int g) {
  put(positionOf(anchor) + gatherFour(d.nodes.displaced, 4 * g), d.nodes.position[g]);
  put(velocityAt(anchor, anchor.offset), d.nodes.velocity[g]);
  put(anchor.offset, d.nodes.offset[g]);
  put(anchor.area, d.nodes.area[g]);
}

void placeOnLink(WorldData& d, const HostRange& range) {
  const LinkHost host = linkHost(d, range.host);
  for (int g = range.firstGroup; g < range.endGroup; ++g) place(d, anchorOnLink(host, d.nodes.groups[g]), g);
}

void placeOnSphere(WorldData& d, const HostRange& range) {
  const SphereHost host = sphereHost(d, range.host);
  for (int g = range.firstGroup; g < range.endGroup; ++g) place(d, anchorOnSphere(host, d.nodes.groups[g]), g);
}

// Nodes without mass: where they are is all that is asked.
void placeSkinOnLink(WorldData& d, const HostRange& range) {
  const LinkHost host = linkHost(d, range.host);
  for (int g = range.firstGroup; g < range.endGroup; ++g)
    put(positionOf(anchorOnLink(host, d.nodes.groups[g])), d.nodes.position[g]);
}

void placeSkinOnSphere(WorldData& d, const HostRange& range) {
  const SphereHost host = sphereHost(d, range.host);
  for (int g = range.firstGroup; g < range.endGroup; ++g)
    put(positionOf(anchorOnSphere(host, d.nodes.groups[g])), d.nodes.position[g]);
}

// To where its nodes hang still from the anchors that place() has left them at, as they hung before.
void hang(WorldData& d, const HostRange& range) {
  const Lanes3 gravity = hangingGravity(d, range.body);
  const double pressure =
      stillPressure(d, gravity, range.firstGroup, range.endGroup, d.surface.parts[range.part].heldBulk);
  const HostRange moving = movingRange(d, range.part);
  if (moving.firstGroup == moving.endGroup) d.nodes.swollen[range.part] = range.bulk > 0 ? pressure / range.bulk : 0;
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const Lanes3 displaced = hangingAt(d, gravity, splat(pressure), g) + gatherFour(d.surface.shift, 4 * g);
    put(d.nodes.position[g] + (displaced - gatherFour(d.nodes.displaced, 4 * g)), d.nodes.position[g]);
    storeFour(displaced, d.nodes.displaced, 4 * g);
  }
}

}  // namespace

void placeCarriedNodes(WorldData& d) {
  for (const HostRange& range : d.awake.skinOnLinks) placeSkinOnLink(d, range);
  for (const HostRange& range : d.awake.skinOnSpheres)
    range.onFrames ? placeSkinOnFrames(d, range) : placeSkinOnSphere(d, range);
  for (const HostRange& range : d.awake.carriedOnLinks) {
    placeOnLink(d, range);
    hang(d, range);
  }
  for (const HostRange& range : d.awake.carriedOnSpheres) {
    range.onFrames ? placeOnFrames(d, range) : placeOnSphere(d, range);
    hang(d, range);
  }
  weighCarriedNodes(d);
}

}  // namespace medulla
