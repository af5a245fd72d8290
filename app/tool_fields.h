#pragma once

#include <Eigen/Geometry>
#include <string>
#include <type_traits>

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

// The same as numbers: `visit(name, double)`, of vectors "device.x" and so on, of orientations x, y, z, w.
template <class Visit>
void visitToolNumbers(const ToolSample& input, const ToolState& tool, const Visit& visit) {
  visitToolFields(input, tool, [&visit](const std::string& name, const auto& value) {
    using Value = std::remove_cvref_t<decltype(value)>;
    const auto each = [&](const char* axes, const auto& numbers) {
      for (int k = 0; axes[k] != 0; ++k) visit(name + "." + axes[k], numbers[k]);
    };
    if constexpr (std::is_same_v<Value, Eigen::Vector3d>)
      each("xyz", value);
    else if constexpr (std::is_same_v<Value, Eigen::Quaterniond>)
      each("xyzw", value.coeffs());
    else
      visit(name, double(value));
  });
}

}  // namespace medulla
