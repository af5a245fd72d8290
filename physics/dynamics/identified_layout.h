#pragma once

#include <span>
#include <vector>

#include "physics/dynamics/body_mechanics.h"
#include "physics/dynamics/world_data.h"

namespace medulla {

// Orders nodes of one home so that groups of four hang on few frames in all, and have as many edges each: a group takes
// time for every frame that any of its nodes hangs on, and for as many edges as the node of it has that has most.
void groupByFrames(const BodyMechanics& mechanics, const std::vector<int>& edges, std::span<int> nodes);

// WorldData::identified of all bodies that have identified links, once spheres and nodes are laid out.
void layOutIdentified(WorldData& d, const std::vector<BodyMechanics>& mechanics);

}  // namespace medulla
