#pragma once

#include <memory>

#include "physics/dynamics/body_mechanics.h"
#include "physics/dynamics/world_data.h"

namespace medulla {

// The arrays of a world at rest in its bodies' poses; `mechanics` holds one entry per body. Substeps are left to the
// caller.
std::unique_ptr<WorldData> layOut(const WorldSettings& settings, std::vector<BodyDescription> bodies,
                                  const std::vector<BodyMechanics>& mechanics);

}  // namespace medulla
