#pragma once

#include "physics/dynamics/body_mechanics.h"
#include "physics/dynamics/world_data.h"

namespace medulla {

// WorldData::identified of all bodies that have identified links, once spheres and nodes are laid out.
void layOutIdentified(WorldData& d, const std::vector<BodyMechanics>& mechanics);

}  // namespace medulla
