#pragma once

#include <Eigen/Geometry>
#include <cmath>

namespace medulla {

// The shortest rotation of the direction `from` onto the direction `to`, neither zero. Eigen's FromTwoVectors does the
// same; for opposite directions it takes a singular value decomposition, which g++ takes 5 s per file to compile.
inline Eigen::Quaterniond rotationBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = from.normalized(), b = to.normalized();
  const double twice = std::sqrt(2 * (1 + a.dot(b)));  // the cosine of half the angle, times two
  const Eigen::Vector3d axis = a.cross(b);
  if (!(twice > 1e-6)) {
    const Eigen::Vector3d aside = a.unitOrthogonal();
    return {0, aside.x(), aside.y(), aside.z()};
  }
  return Eigen::Quaterniond(twice / 2, axis.x() / twice, axis.y() / twice, axis.z() / twice).normalized();
}

}  // namespace medulla
