#pragma once

#include <vector>

#include "physics/model/soft_body_model.h"

namespace medulla {

// Spheres that fixed nodes hold: those on which at least half of the surface that hangs on them is fixed. Others follow
// through the attachments of their nodes.
std::vector<int> spheresHeldBy(const SoftBodyModel& model, const std::vector<int>& fixedNodes);

// Spheres whose cells lie behind a patch of the identified network, but for a rest: finite elements have no cells
// there, and such a frame gives way by no more than the penalty that holds the patch. Its link to the patch would set
// the step of the whole body, for a motion of no account.
std::vector<int> spheresBehindPatches(const IdentifiedNetwork& network);

}  // namespace medulla
