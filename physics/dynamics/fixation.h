#pragma once

#include <vector>

#include "physics/model/soft_body_model.h"

namespace medulla {

// Spheres that fixed nodes hold: those on which at least half of the surface that hangs on them is fixed. Others follow
// through the attachments of their nodes.
std::vector<int> spheresHeldBy(const SoftBodyModel& model, const std::vector<int>& fixedNodes);

// Spheres whose cells lie almost wholly behind a patch. Finite elements have no cells there, so such a frame is held by
// the patch's penalty alone, and its link would dictate the whole body's step without moving anything visible.
std::vector<int> spheresBehindPatches(const IdentifiedNetwork& network);

}  // namespace medulla
