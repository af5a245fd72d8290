#pragma once

#include <Eigen/Core>
#include <algorithm>

// What a force is kept to. Normals and axes are unit vectors.
namespace medulla {

inline Eigen::Vector3d tangential(const Eigen::Vector3d& v, const Eigen::Vector3d& normal) {
  return v - v.dot(normal) * normal;
}

// `force` within `since` of `given`.
inline Eigen::Vector3d keptNear(const Eigen::Vector3d& force, const Eigen::Vector3d& given, double since) {
  const Eigen::Vector3d beyond = force - given;
  const double size = beyond.norm();
  return size > since ? Eigen::Vector3d(given + since / size * beyond) : force;
}

// Within Coulomb's cone about `axis`; nothing pulls.
inline Eigen::Vector3d withinCone(const Eigen::Vector3d& force, const Eigen::Vector3d& axis, double friction) {
  const Eigen::Vector3d across = tangential(force, axis);
  const double along = std::max(0.0, force.dot(axis)), size = across.norm(), most = friction * along;
  return along * axis + (size > most ? most / size : 1) * across;
}

}  // namespace medulla
