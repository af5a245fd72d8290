#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <vector>

// Loads from outside that the dynamics evaluates in its own substeps. What a tool does is new in every frame and comes
// as springs: a frozen force held for a 20 ms frame loses contact at usual coupling stiffness. What the scene
// prescribes is known beforehand and stands in BodyDescription.
namespace medulla {

struct SoftBodyModel;

// The virtual coupling between a tool and the point of the surface that it touches. The surface point is
// x = sum weights x_nodes; force on it: stiffness (anchor - x) + damping (anchorVelocity + drift - x'), spread to the
// nodes by the same weights (paper 4). A pushing spring never pulls: its component along `outward` is dropped when
// positive, and across it holds by no more than friction times the push. One that slides is such a spring along
// `outward` alone, and across it Coulomb's friction against the anchor's velocity: a spring would hold the tissue where
// it was touched at the frame's start, as a drag of stiffness times the frame's duration, 8 N s/m at 50 Hz. Of spring
// and damper together no more than `forceMax` is given, in the direction of the whole: what is limited pulls with a
// constant force however far its anchor is, as a potential does that is quadratic first and a cone beyond (Huber's), so
// that it gives back no more than it took. A softer spring instead, by what it gave lately, is a feedback that is late
// by frames, and oscillates.
struct ToolSpring {
  int tool = 0;  // whose reaction this is
  int body = 0;
  std::array<int, 3> nodes{};
  std::array<double, 3> weights{};                           // barycentric, sum 1
  Eigen::Vector3d anchor = Eigen::Vector3d::Zero();          // m, world, at the end of the frame
  Eigen::Vector3d anchorVelocity = Eigen::Vector3d::Zero();  // m/s; inside the frame the anchor moves with it
  Eigen::Vector3d outward = Eigen::Vector3d::UnitZ();        // unit surface normal at the contact
  double stiffness = 0;                                      // N/m
  double damping = 0;                                        // N s/m
  Eigen::Vector3d drift = Eigen::Vector3d::Zero();           // m/s against the anchor, at which the damper is slack
  bool slides = false;
  double friction = std::numeric_limits<double>::infinity();  // Coulomb's, >= 0: dynamic where it slides, else static
  double forceMax = std::numeric_limits<double>::infinity();  // N
};

// A grabbed node: the same spring on one node, pulling and pushing.
struct HeldNode {
  int tool = 0;
  int body = 0;
  int node = 0;                                               // of the body's model
  Eigen::Vector3d anchor = Eigen::Vector3d::Zero();           // m, at the frame's end
  Eigen::Vector3d anchorVelocity = Eigen::Vector3d::Zero();   // m/s
  double stiffness = 0;                                       // N/m
  double damping = 0;                                         // N s/m
  double forceMax = std::numeric_limits<double>::infinity();  // N
};

// A force that belongs to the scene rather than to a tool: constant in the world's frame, whichever way the body turns
// (a dead load), and growing linearly from 0 at `from` to the whole at `to`; all at once where the two are the same.
struct DeadLoad {
  int node = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  // N
  double from = 0, to = 1;                          // s, from <= to
};

// `whole` shared out over the nodes by the area that each stands for; its own node is ignored.
std::vector<DeadLoad> spreadLoad(const SoftBodyModel& model, const std::vector<int>& nodes, const DeadLoad& whole);

struct Loads {
  std::vector<ToolSpring> toolSprings;
  std::vector<HeldNode> heldNodes;
};

// Calls visit(spring or held node, node) for each node that a tool acts on, springs first.
template <class Visit>
void visitLoadedNodes(const Loads& loads, const Visit& visit) {
  for (const ToolSpring& spring : loads.toolSprings)
    for (const int node : spring.nodes) visit(spring, node);
  for (const HeldNode& held : loads.heldNodes) visit(held, held.node);
}

}  // namespace medulla
