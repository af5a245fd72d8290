#include "assets/shapes/toys.h"

#include <array>

#include "assets/shapes/sdf.h"
#include "assets/shapes/tube.h"

namespace medulla {

using Eigen::Vector3d;

double bean(const Vector3d& p) {
  static const Tube tube =
      makeTube({{-34, -6, 0, 19}, {-17, 5, 0, 18}, {0, 9, 0, 17}, {17, 5, 0, 18}, {34, -6, 0, 19}}, 0.5);
  return tubeDistance(tube, p);
}

double drop(const Vector3d& p) {
  return roundCone(p, {0, -14, 0}, {0, 36, 0}, 28, 12);
}

double star(const Vector3d& p) {
  // Tips of a regular pentagon of radius 42: cosines and sines of multiples of 72 degrees.
  static const std::array<Vector3d, 5> tips = {Vector3d(0, 42, 0), Vector3d(39.944, 12.979, 0),
                                               Vector3d(24.687, -33.979, 0), Vector3d(-24.687, -33.979, 0),
                                               Vector3d(-39.944, 12.979, 0)};
  double d = roundCone(p, Vector3d::Zero(), tips[0], 17, 10);
  for (std::size_t k = 1; k < tips.size(); ++k) d = smoothMin(d, roundCone(p, Vector3d::Zero(), tips[k], 17, 10), 9);
  return d;
}

double bowl(const Vector3d& p) {
  const double r = p.norm();
  const double shell = smoothMax(smoothMax(r - 212, 198 - r, 4), p.y() - 20, 5);
  return smoothMin(shell, smoothMax(ellipsoid(p, {0, -212, 0}, {90, 16, 90}), 198 - r, 4), 10);  // a foot to stand on
}

}  // namespace medulla
