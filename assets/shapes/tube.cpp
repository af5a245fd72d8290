#include "assets/shapes/tube.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <type_traits>

#include "assets/shapes/sdf.h"

namespace medulla {

using Eigen::Vector2d;
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

static void addFrames(Tube& tube) {
  const int count = static_cast<int>(tube.samples.size());
  const auto centre = [&](int i) -> Vector3d { return tube.samples[std::clamp(i, 0, count - 1)].head<3>(); };
  Vector3d normal = (centre(1) - centre(0)).unitOrthogonal();
  for (int i = 0; i < count; ++i) {
    const Vector3d tangent = (centre(i + 1) - centre(i - 1)).normalized();
    normal = (normal - tangent * tangent.dot(normal)).normalized();
    tube.tangents.push_back(tangent);
    tube.normals.push_back(normal);
    tube.along.push_back(i > 0 ? tube.along.back() + (centre(i) - centre(i - 1)).norm() : 0);
  }
  for (int i = 0; i < count; ++i) {
    int from = i, to = i;
    while (from > 0 && tube.along[i] - tube.along[from] < tube.samples[i].w()) --from;
    while (to + 1 < count && tube.along[to] - tube.along[i] < tube.samples[i].w()) ++to;
    tube.curvature.push_back((tube.tangents[to] - tube.tangents[from]).norm() / (tube.along[to] - tube.along[from]));
  }
}

static void addChunks(Tube& tube) {
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

  addFrames(tube);
  addChunks(tube);
  return tube;
}

struct NearestSegment {
  double distance = 1e9;
  int first = 0;  // its first sample
};

static NearestSegment nearestInChunk(const Tube& tube, const Tube::Chunk& chunk, const Vector3d& p) {
  NearestSegment best;
  for (int i = chunk.first; i < chunk.last; ++i) {
    const Vector4d &a = tube.samples[i], &b = tube.samples[i + 1];
    const double distance = roundCone(p, a.head<3>(), b.head<3>(), a.w(), b.w());
    if (distance < best.distance) best = {distance, i};
  }
  return best;
}

static NearestSegment nearestSegment(const Tube& tube, const Vector3d& p) {
  const auto bound = [&](const Tube::Chunk& chunk) { return (p - chunk.centre).norm() - chunk.radius; };
  auto likeliest = tube.chunks.begin();
  double lowest = bound(*likeliest);
  for (auto chunk = tube.chunks.begin() + 1; chunk != tube.chunks.end(); ++chunk) {
    const double candidate = bound(*chunk);
    if (candidate < lowest) lowest = candidate, likeliest = chunk;
  }
  NearestSegment best = nearestInChunk(tube, *likeliest, p);
  for (auto chunk = tube.chunks.begin(); chunk != tube.chunks.end(); ++chunk) {
    if (chunk == likeliest || bound(*chunk) >= best.distance) continue;
    const NearestSegment candidate = nearestInChunk(tube, *chunk, p);
    if (candidate.distance < best.distance) best = candidate;
  }
  return best;
}

double tubeDistance(const Tube& tube, const Vector3d& p) {
  return nearestSegment(tube, p).distance;
}

// Newton steps on the stationarity of |p - c(u)| - r(u), e . c' + |e| r' = 0, with interpolated tangents; u counts
// samples.
TubePlace tubePlace(const Tube& tube, const Vector3d& p) {
  const double last = static_cast<double>(tube.samples.size()) - 1;
  const auto mix = [](const auto& a, const auto& b, double t) { return std::decay_t<decltype(a)>(a + (b - a) * t); };
  double u = nearestSegment(tube, p).first + 0.5;
  for (int step = 0;; ++step) {
    const int i = std::min(static_cast<int>(u), static_cast<int>(last) - 1);
    const double t = u - i, length = tube.along[i + 1] - tube.along[i];
    const Vector4d sample = mix(tube.samples[i], tube.samples[i + 1], t);
    const Vector3d tangent = mix(tube.tangents[i], tube.tangents[i + 1], t), e = p - sample.head<3>();
    const double fromAxis = e.norm(), slope = (tube.samples[i + 1].w() - tube.samples[i].w()) / length;
    if (step == 6) {
      const Vector3d normal = mix(tube.normals[i], tube.normals[i + 1], t);
      const Vector2d side(e.dot(normal), e.dot(tangent.cross(normal)));
      return {fromAxis, sample.w(), mix(tube.along[i], tube.along[i + 1], t),
              mix(tube.curvature[i], tube.curvature[i + 1], t), side / std::max(side.norm(), 1e-9)};
    }
    const double change = std::min(e.dot(tube.tangents[i + 1] - tube.tangents[i]) / length - 1, -0.25);
    u = std::clamp(u - std::clamp((e.dot(tangent) + fromAxis * slope) / (change * length), -1.0, 1.0), 0.0, last);
  }
}

}  // namespace medulla
