#include <algorithm>
#include <cmath>

#include "assets/shapes/organs.h"
#include "assets/shapes/sdf.h"

namespace medulla {

using Eigen::Vector3d;

// The diaphragmatic surface is a hull of two lobes; the visceral surface is where a large sphere from below and behind
// cuts it. The small blend between the two makes the sharp inferior border.
double liver(const Vector3d& p) {
  const double right = ellipsoid(p, {-72, 42, -18}, {88, 86, 68});
  const double left = ellipsoid(p, {38, 48, 0}, {84, 52, 46});
  double d = smoothMin(smoothMin(right, left, 40), ellipsoid(p, {-17, 4, 12}, {26, 33, 24}), 24);

  const double visceralRadius = 240;
  const Vector3d visceralNormal = Vector3d(0.2, -0.69, -0.69).normalized();
  const Vector3d visceralCentre = Vector3d(-48, -22.5, 7.5) + visceralRadius * visceralNormal;
  d = smoothMax(d, visceralRadius - (p - visceralCentre).norm(), 5);

  // Falciform fissure: a slot through the border, left of the midline, that narrows and fades upwards.
  const double sideways = p.x() - 8 - 0.15 * (p.y() - 20);
  const double above = 0.22 * std::max(p.y() - 12, 0.0);
  d = smoothMax(d, 4 - std::sqrt(sideways * sideways + above * above), 8);

  d += 2.4 * noise(p, 45) + 0.6 * noise(p, 12);
  if (d > 25) return d;  // the neighbours cannot matter
  d = smoothMax(d, 1 - stomach(p), 10);
  return smoothMax(d, 0.5 - gallbladder(p), 8);  // fossa, 0.5 mm clear of the gallbladder
}

}  // namespace medulla
