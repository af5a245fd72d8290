#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "physics/dynamics/world_data.h"

// The momenta of whole bodies, and rigid motions that give them back what a step or a change of parts loses.
namespace medulla {

// m2: of a unit mass at r, about the origin.
inline Eigen::Matrix3d inertiaAt(const Eigen::Vector3d& r) {
  return r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose();
}

// Of a body, about the origin; zero where nothing of it is awake.
struct WholeMotion {
  double mass = 0;  // kg
  Eigen::Vector3d moment = Eigen::Vector3d::Zero(), linear = Eigen::Vector3d::Zero(),
                  angular = Eigen::Vector3d::Zero();  // kg m, N s, N m s
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  // kg m2
};

// What a body that can turn turns about: rigid_support.h.
struct Pivot {
  RigidFreedom freedom = RigidFreedom::all;
  Eigen::Vector3d point = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero();  // m, m/s; but for `all`
  Eigen::Vector3d line = Eigen::Vector3d::Zero();                                       // m, of `aboutLine`
};
// As the body stands; of one that cannot turn, what it is carried by.
Pivot pivotOf(const WorldData& d, int body);

struct RigidMotion {
  Eigen::Vector3d centre, velocity, spin;  // m, m/s, rad/s; what is held turns about its pivot
};
// The rigid motion of these momenta; not finite where there is no mass or no inertia.
RigidMotion rigidMotionOf(const WholeMotion& whole, const Pivot& pivot);
// N m s, about its own centre, or its pivot.
Eigen::Vector3d spinMomentum(const WholeMotion& whole, const Pivot& pivot);
inline Eigen::Vector3d velocityAt(const RigidMotion& m, const Eigen::Vector3d& x) {
  return m.velocity + m.spin.cross(x - m.centre);
}

// Of spheres and of the nodes that move by WorldData::awake.
void wholeMotions(const WorldData& d, std::vector<WholeMotion>& out);

// Adds the rigid motion of these momenta (N s; N m s about the origin) to all of a body that is not held. Nodes that
// are carried are placed anew after it.
void addMomenta(WorldData& d, int body, const WholeMotion& now, const Eigen::Vector3d& linear,
                const Eigen::Vector3d& angular);

// Leaves `share` of what a body does against the rigid motion.
void slowDown(WorldData& d, int body, const RigidMotion& against, double share);

// Turns a body about its centre, or its pivot, by the rotation vector `angle` with all that it does, but for its
// momenta, which stay.
void turn(WorldData& d, int body, const WholeMotion& now, const Eigen::Vector3d& angle);

}  // namespace medulla
