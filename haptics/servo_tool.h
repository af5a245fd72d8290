#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "haptics/contact_patch.h"
#include "haptics/grab.h"
#include "haptics/proxy.h"
#include "haptics/tissue_motion.h"
#include "haptics/tool_input.h"

namespace medulla {

// One tool of a Servo, between two hand-overs.
struct ServoTool {
  ToolSample device, deviceAtFrameStart;
  ToolSettings settings;
  int index = 0;
  Proxy proxy;
  Grip grip;
  Eigen::Vector3d deviceSum = Eigen::Vector3d::Zero();  // of positions over the frame's ticks
  ContactPatch patch;
  // While isLeaving, in contact or not yet clear of it: where it touched last, and what lies below it by now.
  std::array<ProxyContact, 2> left;
  Eigen::Vector3d lastFelt = Eigen::Vector3d::Zero();  // unit; along which it was felt
  // m, across: how far what the contact sticks to was ahead of the late surface when it began to. There it was touched.
  Eigen::Vector3d leadWhereItStuck = Eigen::Vector3d::Zero();
  Eigen::Vector3d dragged = Eigen::Vector3d::Zero();  // across, per push, when it touched last
  bool sticks = false;
  double largestPush = 0;  // N, of the coupling's spring during this contact
  DeviceMotion motion;     // in this contact or grip
  // N, by how much the tissue's force changed over the frame up to the surface's `to`, and up to its `from`.
  std::array<double, 2> change{};
  std::optional<Eigen::Vector3d> pathEnd;  // m, of the device's path as handed over since the frame began
  double estimate = 0;                     // N, of the force at the last tick, before it was kept to the tissue's
  double push = 0;                         // N, along the normal, of what was felt at the last tick
  double depth = 0;                        // m, of the device, when it touched last
  double stillFor = 0;                     // s, that its device has been still while it pushes
  int ticks = 0;                           // in this frame
  bool isLeaving = false;
  std::optional<ToolSample> holdBegan;  // in this frame: the device, when the grip took hold
};

}  // namespace medulla
