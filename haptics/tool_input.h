#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

namespace medulla {

// m; device positions lie within this of the origin on every axis. The ray queries run in float: farther out their
// rounding would outgrow the 10 um by which the surface's bounds are padded. Also catches trajectories in millimetres.
constexpr double kToolReach = 20;

constexpr double kGripCloses = 0.5;  // a grip above this is closed, and holds what it closed on

// One row of a haptic trajectory: where the device is and how far its grip is closed.
struct ToolSample {
  double time = 0;                                     // s
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m, world
  // The tool's shaft runs along its +z, away from the tip.
  Eigen::Quaterniond worldFromTool = Eigen::Quaterniond::Identity();
  double grip = 0;  // 0 open .. 1 closed; closes above kGripCloses
};

struct Trajectory {
  std::vector<ToolSample> samples;              // strictly increasing time, at least one
  std::vector<Eigen::Vector3d> measuredForces;  // N, world, on the hand; one per sample, or none
};

// The device at a time: before the first and after the last sample it stands still. Position by Catmull-Rom with
// monotone tangents (smooth through sparse key poses and dense recordings alike, no overshoot on any axis), orientation
// by the same cubic on quaternions, grip linearly. Velocities have no steps; at a sample's time it is that sample to
// the bit.
ToolSample sampleTrajectory(const Trajectory& trajectory, double time);

// Between samples linearly; none where nothing was measured.
std::optional<Eigen::Vector3d> measuredForceAt(const Trajectory& trajectory, double time);

// s, from when on the device keeps its last pose and grip.
double motionEnd(const Trajectory& trajectory);

// A tool of the scene: its proxy (paper 4) and the virtual coupling between proxy and device.
struct ToolSettings {
  double radius = 0.003;         // m, of the proxy sphere, > 0
  double stiffness = 400;        // N/m between device and proxy, > 0; more feels harder and needs faster dynamics
  double damping = 1;            // N s/m, >= 0
  double staticFriction = 0.3;   // Coulomb, >= dynamicFriction
  double dynamicFriction = 0.2;  // Coulomb, >= 0
  double forceMax = 8;           // N, > 0; the coupling is clamped there and says so
  double gripRadius = 0.006;     // m, patch held when the grip closes in contact
  double gripForceMax = 6;       // N, > 0; beyond, what the grip holds slips out; from forceMax on it never does
};

}  // namespace medulla
