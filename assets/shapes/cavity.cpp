#include "assets/shapes/organs.h"
#include "assets/shapes/sdf.h"

namespace medulla {

using Eigen::Vector3d;

double cavity(const Vector3d& p) {
  return ellipsoid(p, {-15, -15, 50}, {215, 165, 205}) + 22 * noise(p, 90) + 7 * noise(p, 35);
}

}  // namespace medulla
