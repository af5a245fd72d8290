#pragma once

#include <vector>

#include "physics/dynamics/body_mechanics.h"
#include "physics/dynamics/frame.h"

namespace medulla {

struct FrameSteps {
  int count = 1;       // substeps in a dynamics frame
  double substep = 0;  // s
};

// Per node, of the body at rest; 0 of fixed nodes. `own` is 0 on a skin, whose nodes ride on spheres. `carried` is what
// a push that grows evenly for a frame moves the spheres, at least.
std::vector<NodeGive> nodeGive(const BodyDescription& body, const BodyMechanics& mechanics, const FrameSteps& steps);

}  // namespace medulla
