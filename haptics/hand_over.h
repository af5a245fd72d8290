#pragma once

#include <vector>

#include "haptics/servo_tool.h"
#include "physics/dynamics/loads.h"

namespace medulla {

// The springs that stand for a tool's contacts or grip during the next dynamics frame of `frameDuration` s, added to
// `out`; notes in `tool` where the path that they follow ends. `scratch` needs room for kContactPatchCapacity.
void handOverTool(const BlendedSurface& surface, double alpha, double frameDuration, double tickDuration,
                  ServoTool& tool, std::vector<ProxyContact>& scratch, Loads& out);

}  // namespace medulla
