#pragma once

#include <string>
#include <vector>

#include "physics/dynamics/world.h"

namespace medulla {

// The physics surfaces of all bodies at one moment as OBJ: metres, world frame, 17 significant digits, one object per
// body. Vertices come in the order of the mesh file that the model was built from, so that line k is vertex k of every
// moment. A vertex that mesh repair dropped keeps its number and takes the place of the kept one before it (the first
// kept one where none is before): its own position was not simulated and no face uses it. Nodes that no input vertex
// became follow at the end of their body.
std::string surfaceText(const std::vector<BodyDescription>& bodies, const DynamicsFrame& frame);

}  // namespace medulla
