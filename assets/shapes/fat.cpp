#include <algorithm>
#include <cmath>
#include <vector>

#include "assets/shapes/organs.h"
#include "assets/shapes/sdf.h"

namespace medulla {

using Eigen::Vector3d;

struct Lobule {
  Vector3d top;
  double radius;
};

// Higher at the flanks, behind, and around the duodenum, which would stand in it as a bare pipe.
static double bedHeight(double x, double z) {
  const double dx = x + 31, dz = z + 20, heap = std::max(0.0, 1 - (dx * dx + dz * dz) / (55 * 55));
  return -118 + 0.0011 * (x + 15) * (x + 15) + 16 * noise({x, 0, z}, 55) - 0.22 * (z - 30) + 34 * heap * heap;
}

// Jittered grid rather than free random places: no bare spots.
static std::vector<Lobule> makeLobules() {
  std::vector<Lobule> lobules;
  const double spacing = 15;
  for (int i = 0; i < 24; ++i) {
    for (int j = 0; j < 15; ++j) {
      const auto random = [&](int salt) { return noise(Vector3d(i, j, salt), 1) + 0.5; };  // lattice values: 0..1
      const double x = -195 + spacing * (i + random(1)), z = -95 + spacing * (j + random(2));
      lobules.push_back({{x, bedHeight(x, z) + 12 * random(3), z}, 9 + 8 * random(4)});
    }
  }
  return lobules;
}

// Domes over a bed: a height field, because a smooth union of balls leaves holes between them that no closed surface of
// genus 0 can have.
static double topHeight(double x, double z) {
  static const std::vector<Lobule> lobules = makeLobules();
  double height = bedHeight(x, z) - 8;
  for (const Lobule& lobule : lobules) {
    const double dx = x - lobule.top.x(), dz = z - lobule.top.z(), across = dx * dx + dz * dz;
    const double widest = 1.7 * lobule.radius;
    if (across > widest * widest) continue;  // below its neighbours
    const double relative = across / (lobule.radius * lobule.radius);
    height = smoothMax(height, lobule.top.y() - lobule.radius * relative * (0.25 + 0.28 * relative), 5);  // pillows
  }
  return height;
}

double fat(const Vector3d& p) {
  const double dx = (p.x() + 15) / 170, dz = (p.z() - 15) / 105;
  const double outside = 105 * (std::sqrt(dx * dx + dz * dz) - 1);
  if (p.y() > 0 || p.y() < -200 || outside > 40) return std::max({p.y() - 10, -190 - p.y(), outside, 10.0});
  const double top = 0.6 * (p.y() - topHeight(p.x(), p.z()));  // 0.6: the domes' flanks are steep
  return smoothMax(smoothMax(top, outside, 40), -180 - p.y(), 20) + 1.5 * noise(p, 14);
}

}  // namespace medulla
