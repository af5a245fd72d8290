#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "physics/model/identified_network.h"

namespace medulla {

struct Loads;
struct WorldData;

// A massless node on the spheres that carry it: what a force on it is to each of them. Transposed, what their
// velocities are to it.
struct HostPoint {
  int count = 0;  // of spheres; 0: the node has a mass of its own, or is a held one of a skin
  static constexpr int kMost = 2 * kSkinFrames;  // those it hangs on, and those that turn its host's frame
  std::array<int, kMost> spheres{};
  std::array<Eigen::Matrix3d, kMost> force, torque;  // 1, m
};

// The common form of what tools do: ToolSpring and HeldNode.
struct PointSpring {
  int count, tool;
  std::array<int, 3> nodes;  // indices in Nodes
  std::array<double, 3> weights;
  Eigen::Vector3d anchor, anchorVelocity;  // m, m/s, at the substep's end
  Eigen::Vector3d slackVelocity;           // m/s, of the damper
  const Eigen::Vector3d* outward;          // null: pulls and pushes
  double stiffness, damping;
  bool slides;      // across `outward`: no spring, but Coulomb's friction
  double friction;  // times the push: the most across `outward`
  double forceMax;  // N
};

// One of them while the velocities of a substep settle, with all that stays meanwhile.
struct SettlingSpring {
  PointSpring spring;
  std::array<HostPoint, 3> hosts;  // of its nodes
  Eigen::Vector3d place;           // m, of its nodes, weighted
  double mobility;                 // 1/kg: their velocity per impulse
};

// The k-th of `loads`, tool springs first; `remaining` is the time (s) from the substep's end to the frame's.
PointSpring pointSpring(const WorldData& d, const Loads& loads, std::size_t k, double remaining);

}  // namespace medulla
