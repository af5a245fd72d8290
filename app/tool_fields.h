#pragma once

#include "haptics/servo.h"

namespace medulla {

// All that a picture's state holds of a tool, by name: what caches keep, what runs are compared by and what golden
// images name the state of. `visit(name, value)` is called with double, bool, Vector3d and Quaterniond, which may be
// changed where `input` and `tool` are not const.
template <class Input, class Tool, class Visit>
void visitToolFields(Input& input, Tool& tool, const Visit& visit) {
  visit("trajectory.time", input.time);
  visit("trajectory.position", input.position);
  visit("trajectory.orientation", input.worldFromTool);
  visit("trajectory.grip", input.grip);
  visit("device", tool.device);
  visit("proxy", tool.proxy);
  visit("force", tool.force);
  visit("steady_force", tool.steadyForce);
  visit("grasp", tool.grasp);
  visit("contact", tool.inContact);
  visit("held", tool.holding);
  visit("clamped", tool.clamped);
}

}  // namespace medulla
