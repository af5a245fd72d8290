#pragma once

#include <vector>

#include "physics/model/soft_body_model.h"

namespace medulla {

// Spheres that fixed nodes hold: those on which at least half of the surface that hangs on them is fixed. Others follow
// through the attachments of their nodes.
std::vector<int> spheresHeldBy(const SoftBodyModel& model, const std::vector<int>& fixedNodes);

}  // namespace medulla
