#pragma once

#include <Eigen/Core>

namespace medulla {

// crossMatrix(a) b = a x b.
inline Eigen::Matrix3d crossMatrix(const Eigen::Vector3d& a) {
  return (Eigen::Matrix3d() << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0).finished();
}

}  // namespace medulla
