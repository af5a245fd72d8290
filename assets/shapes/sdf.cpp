#include "assets/shapes/sdf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace medulla {

using Eigen::Vector3d;

double smoothMin(double a, double b, double blend) {
  const double h = std::max(blend - std::abs(a - b), 0.0);
  return std::min(a, b) - h * h / (4 * blend);
}

double smoothMax(double a, double b, double blend) {
  return -smoothMin(-a, -b, blend);
}

double smoothStep(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

double ellipsoid(const Vector3d& p, const Vector3d& centre, const Vector3d& radii) {
  const Vector3d q = p - centre;
  const double k = q.cwiseQuotient(radii).norm();
  const double slope = q.cwiseQuotient(radii.cwiseAbs2()).norm();  // |gradient of k| times k
  return slope < 1e-9 ? -radii.minCoeff() : k * (k - 1) / slope;
}

double roundCone(const Vector3d& p, const Vector3d& a, const Vector3d& b, double radiusA, double radiusB) {
  const Vector3d axis = b - a;
  const double length = axis.norm(), along = (p - a).dot(axis) / length;
  const double across = std::sqrt(std::max((p - a).squaredNorm() - along * along, 0.0));
  // The ball that touches p's nearest surface point sits where d/dt (|p - c(t)| - r(t)) = 0: the foot of the
  // perpendicular, moved by the slope of the flank.
  const double slope = std::clamp((radiusB - radiusA) / length, -0.95, 0.95);
  const double t = std::clamp((along + across * slope / std::sqrt(1 - slope * slope)) / length, 0.0, 1.0);
  return (p - a - axis * t).norm() - (radiusA + (radiusB - radiusA) * t);
}

// Uniform in 0..1 from lattice coordinates; multiply-xorshift mixing.
static double latticeValue(int x, int y, int z) {
  std::uint32_t h = static_cast<std::uint32_t>(x) * 374761393U + static_cast<std::uint32_t>(y) * 668265263U +
                    static_cast<std::uint32_t>(z) * 2246822519U;
  h = (h ^ (h >> 13)) * 1274126177U;
  h ^= h >> 16;
  return (h & 0xffffffU) / double(0xffffff);
}

double noise(const Vector3d& p, double size) {
  const Vector3d q = p / size;
  const std::array<int, 3> cell = {static_cast<int>(std::floor(q.x())), static_cast<int>(std::floor(q.y())),
                                   static_cast<int>(std::floor(q.z()))};
  std::array<double, 3> t{};
  for (int a = 0; a < 3; ++a) t[a] = smoothStep(0, 1, q[a] - cell[a]);
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
    const double weight = (i ? t[0] : 1 - t[0]) * (j ? t[1] : 1 - t[1]) * (k ? t[2] : 1 - t[2]);
    sum += weight * latticeValue(cell[0] + i, cell[1] + j, cell[2] + k);
  }
  return sum - 0.5;
}

Vector3d gradient(const SignedDistance& sdf, const Vector3d& p) {
  const double h = 0.25;
  Vector3d g;
  for (int a = 0; a < 3; ++a) {
    const Vector3d step = h * Vector3d::Unit(a);
    g[a] = (sdf(p + step) - sdf(p - step)) / (2 * h);
  }
  return g;
}

Vector3d normalAt(const SignedDistance& sdf, const Vector3d& p) {
  return gradient(sdf, p).normalized();
}

Vector3d projectToSurface(const SignedDistance& sdf, Vector3d p, double reach) {
  for (int i = 0; i < 4; ++i) {
    const double d = sdf(p);
    if (std::abs(d) < 1e-4) break;
    const Vector3d g = gradient(sdf, p);
    Vector3d step = g * (d / std::max(g.squaredNorm(), 0.05));
    if (step.norm() > reach) step *= reach / step.norm();
    p -= step;
  }
  return p;
}

}  // namespace medulla
