#include "assets/shapes/tube.h"

#include <algorithm>
#include <cmath>

#include "assets/shapes/sdf.h"

namespace medulla {

using Eigen::Vector3d;
using Eigen::Vector4d;

// Barry and Goldman's pyramid between the knots of b and c, t in 0..1.
static Vector4d catmullRom(const Vector4d& a, const Vector4d& b, const Vector4d& c, const Vector4d& d, double t) {
  const auto knotDistance = [](const Vector4d& p, const Vector4d& q) { return std::sqrt((q - p).head<3>().norm()); };
  const double t0 = 0, t1 = knotDistance(a, b), t2 = t1 + knotDistance(b, c), t3 = t2 + knotDistance(c, d);
  const double u = t1 + (t2 - t1) * t;
  const auto between = [u](const Vector4d& p, const Vector4d& q, double from, double to) -> Vector4d {
    return p + (q - p) * ((u - from) / (to - from));
  };
  const Vector4d ab = between(a, b, t0, t1), bc = between(b, c, t1, t2), cd = between(c, d, t2, t3);
  return between(between(ab, bc, t0, t2), between(bc, cd, t1, t3), t1, t2);
}

Tube makeTube(const std::vector<Vector4d>& controls, double step) {
  Tube tube;
  const int last = static_cast<int>(controls.size()) - 1;
  for (int i = 0; i < last; ++i) {
    const Vector4d &b = controls[i], &c = controls[i + 1];
    const Vector4d a = i > 0 ? controls[i - 1] : Vector4d(2 * b - c);
    const Vector4d d = i + 1 < last ? controls[i + 2] : Vector4d(2 * c - b);
    const int pieces = std::max(1, static_cast<int>(std::ceil((c - b).head<3>().norm() / step)));
    for (int k = 0; k < pieces; ++k) tube.samples.push_back(catmullRom(a, b, c, d, double(k) / pieces));
  }
  tube.samples.push_back(controls.back());

  const int end = static_cast<int>(tube.samples.size()) - 1, chunkLength = 8;
  for (int first = 0; first < end; first += chunkLength) {
    Tube::Chunk chunk{Vector3d::Zero(), 0, first, std::min(first + chunkLength, end)};
    chunk.centre = 0.5 * (tube.samples[chunk.first] + tube.samples[chunk.last]).head<3>();
    for (int i = chunk.first; i <= chunk.last; ++i) {
      const Vector4d& s = tube.samples[i];
      chunk.radius = std::max(chunk.radius, (s.head<3>() - chunk.centre).norm() + s.w());
    }
    tube.chunks.push_back(chunk);
  }
  return tube;
}

static double chunkDistance(const Tube& tube, const Tube::Chunk& chunk, const Vector3d& p) {
  double best = 1e9;
  for (int i = chunk.first; i < chunk.last; ++i) {
    const Vector4d &a = tube.samples[i], &b = tube.samples[i + 1];
    best = std::min(best, roundCone(p, a.head<3>(), b.head<3>(), a.w(), b.w()));
  }
  return best;
}

double tubeDistance(const Tube& tube, const Vector3d& p) {
  const auto bound = [&](const Tube::Chunk& chunk) { return (p - chunk.centre).norm() - chunk.radius; };
  const auto likeliest = std::min_element(tube.chunks.begin(), tube.chunks.end(),
                                          [&](const auto& a, const auto& b) { return bound(a) < bound(b); });
  double best = chunkDistance(tube, *likeliest, p);
  for (auto chunk = tube.chunks.begin(); chunk != tube.chunks.end(); ++chunk)
    if (chunk != likeliest && bound(*chunk) < best) best = std::min(best, chunkDistance(tube, *chunk, p));
  return best;
}

}  // namespace medulla
