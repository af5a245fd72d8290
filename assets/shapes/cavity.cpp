#include "assets/shapes/organs.h"
#include "assets/shapes/sdf.h"

namespace medulla {

using Eigen::Vector3d;

double cavity(const Vector3d& p) {
  const double pelvis = p.y() < -15 ? 180.0 / 400 : 1;  // deeper below: room for the sigmoid colon
  const Vector3d q(p.x(), -15 + pelvis * (p.y() + 15), p.z());
  return ellipsoid(q, {-2, -15, 40}, {228, 180, 220}) + 22 * noise(p, 90) + 7 * noise(p, 35);
}

}  // namespace medulla
