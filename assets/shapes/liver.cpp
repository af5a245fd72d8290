#include <algorithm>
#include <cmath>

#include "assets/shapes/organs.h"
#include "assets/shapes/sdf.h"

namespace medulla {

using Eigen::Vector3d;

// The visceral surface: a large sphere from below, behind and the left.
static const double visceralRadius = 240;

static Vector3d visceralCentre() {
  return Vector3d(-58, -39, 16) + visceralRadius * Vector3d(0.33, -0.72, -0.61).normalized();
}

// The point of the visceral surface at x, z, moved `deeper` mm into the liver along y.
static Vector3d onVisceral(double x, double z, double deeper) {
  const Vector3d c = visceralCentre();
  const double across = (x - c.x()) * (x - c.x()) + (z - c.z()) * (z - c.z());
  return {x, c.y() + std::sqrt(visceralRadius * visceralRadius - across) + deeper, z};
}

// Diaphragmatic surface: a big right and a thin left lobe.
static double hull(const Vector3d& p) {
  const Vector3d leaning(p.x() - 0.25 * (p.y() - 22), p.y(), p.z());  // lowest at the right, so that the border rises
  const double right = ellipsoid(leaning, {-66, 23, -23}, {69, 86, 52});
  const Vector3d q(p.x() + 0.17 * (p.y() - 58), p.y() - 0.17 * (p.x() - 16), p.z());  // tilted: the tip points up
  const double left = ellipsoid(q, {14, 58, -8}, {68, 36, 33});
  return smoothMin(smoothMin(right, left, 44), ellipsoid(p, {-24, 20, -10}, {45, 52, 38}), 36);
}

// The H of the visceral surface: fissure of the round ligament and gallbladder fossa in front, fissure of the venous
// ligament and groove of the vena cava behind, the porta hepatis as the bar between quadrate and caudate lobe.
static double withVisceralLandmarks(double d, const Vector3d& p) {
  d = smoothMin(d, ellipsoid(p, onVisceral(-14, -46, 10), {13, 11, 22}), 24);  // caudate lobe
  d = smoothMax(d, -roundCone(p, onVisceral(9, 60, 0), onVisceral(4, -14, 2), 6, 5), 8);
  d = smoothMax(d, -roundCone(p, onVisceral(-32, -24, 1), onVisceral(2, -18, 1), 7.5, 6.5), 12);
  d = smoothMax(d, -roundCone(p, onVisceral(4, -18, 1), onVisceral(6, -80, 0), 4.5, 5), 8);
  d = smoothMax(d, -roundCone(p, {-33, -10, -82}, {-27, 110, -70}, 13, 13), 10);  // vena cava
  d = smoothMax(d, -ellipsoid(p, {-96, -42, -72}, {34, 54, 34}), 18);             // right kidney
  return smoothMax(d, -ellipsoid(p, {-102, -86, -34}, {30, 36, 32}), 16);         // right flexure of the colon
}

// How much lower the border hangs beside the gallbladder's neck, mm: it hides the end of the cystic duct.
static double borderDrop(const Vector3d& p) {
  const double aside = (p.x() + 16) / 26, near = std::max(1 - aside * aside, 0.0);
  return 7 * near * near * smoothStep(-20, 5, p.z()) * (1 - smoothStep(0, 40, p.y()));
}

double liver(const Vector3d& p) {
  const Vector3d q = p + Vector3d(0, borderDrop(p), 0);
  double d = smoothMax(hull(q), visceralRadius - (q - visceralCentre()).norm(), 5);
  d = withVisceralLandmarks(d, p);

  // Falciform ligament: a notch in the border that runs up over the dome as a shallow furrow.
  const double sideways = std::abs(p.x() - 8 + 0.0012 * (p.y() - 20) * (p.y() - 20));
  const double furrow = std::max(1 - sideways / 7, 0.0);
  d += 2.2 * furrow * furrow * smoothStep(-30, 0, p.z() + 0.3 * p.y());

  d += 2.4 * noise(p, 45) + 0.6 * noise(p, 12);
  if (d > 25) return d;  // the neighbours cannot matter
  d = smoothMax(d, 1 - stomach(p), 10);
  return smoothMax(d, 0.9 - gallbladder(p), 8);  // fossa
}

}  // namespace medulla
