#pragma once

#include <Eigen/Geometry>
#include <stdexcept>
#include <vector>

// What the dynamics hands to everybody else: the state at the end of a dynamics frame.
namespace medulla {

struct SpherePose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m, world
  Eigen::Quaterniond worldFromSphere = Eigen::Quaterniond::Identity();
};

struct BodyFrame {
  std::vector<Eigen::Vector3d> nodes;  // m, world; order of SoftBodyModel::restNodes
  std::vector<SpherePose> spheres;
};

// m/N, >= 0: how far a node yields within a frame to a small force on it alone, into the surface.
struct NodeGive {
  double own = 0;      // by its attachment and edges, while the spheres and what lies beyond its neighbours stand still
  double carried = 0;  // by what the spheres that carry it are moved
};

// A body's state is not finite any more, or nearly so; says which, when and why.
struct NotFinite : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct DynamicsFrame {
  double time = 0;  // s
  std::vector<BodyFrame> bodies;
};

// Blending transition between the two last dynamics frames (paper 5); alpha in 0..1, 0 gives `from` and 1 gives `to`:
// points exactly, orientations to rounding, of either sign of the quaternion. The servo blends the few points it
// touches, the picture whole frames: both through these.
inline Eigen::Vector3d blendPoint(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double alpha) {
  return (1 - alpha) * from + alpha * to;
}
// Nodes linearly, orientations by normalised linear interpolation along the shorter arc. `out` is resized once and
// reused.
void blendFrames(const DynamicsFrame& from, const DynamicsFrame& to, double alpha, DynamicsFrame& out);

}  // namespace medulla
