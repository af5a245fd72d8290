#pragma once

#include <cassert>
#include <vector>

#include "haptics/proxy.h"

// Grabbing: a grip that closes in contact holds the patch of tissue around the contact until it opens.
namespace medulla {

struct HeldOffset {
  int node = 0;            // of BlendedSurface
  Eigen::Vector3d offset;  // m, in the tool's frame: twisting the tool twists the tissue
  double share = 1;        // above 0, of the tool's stiffness and forces; 1 in all
};

struct Grip {
  bool closed = false;
  bool slipped = false;          // closed, but what it held has torn away
  std::vector<HeldOffset> held;  // empty while open, and when the grip closed on nothing or slipped
  double give = 0;               // m/N, of what is held, by the nodes' own; 0 where none gives
};

// Opens or closes by the sample's grip (closed above kGripCloses). Closing on `contact`, also at a run's first tick,
// holds the nodes of the touched body within 5/4 of gripRadius of the contact point, less and less firmly from 3/4 on,
// and those of the touched triangle by the contact's weights, where they are: the springs are slack then. Null: nothing
// is touched. `grip.held` must have room for every node of the surface: nothing is allocated here.
void updateGrip(const BlendedSurface& surface, double alpha, const ProxyContact* contact, const ToolSample& device,
                const ToolSettings& tool, Grip& grip);

// The tissue tears away: the grip holds nothing until it opens and closes again.
inline void letSlip(Grip& grip) {
  grip.held.clear();
  grip.slipped = true;
}

// Where the tool wants a held node, m, world.
inline Eigen::Vector3d heldTarget(const ToolSample& device, const HeldOffset& held) {
  return device.position + device.worldFromTool * held.offset;
}

// Mean of `of(held)`, m, over what is held, by its shares.
template <class Of>
Eigen::Vector3d meanOverHeld(const Grip& grip, const Of& of) {
  assert(!grip.held.empty());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const HeldOffset& held : grip.held) sum += held.share * of(held);
  return sum;
}

}  // namespace medulla
