#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "physics/dynamics/frame.h"
#include "physics/model/soft_body_model.h"

// Shapes to be touched in tests and benchmarks: models with nodes, triangles and buckets alone.
namespace medulla {

using TouchShape = std::shared_ptr<SoftBodyModel>;

// Buckets by farthest-point seeds: triangles go to the nearest seed.
inline void fillBuckets(SoftBodyModel& model, int count) {
  std::vector<Eigen::Vector3d> centroids;
  for (const auto& [a, b, c] : model.triangles)
    centroids.push_back((model.restNodes[a] + model.restNodes[b] + model.restNodes[c]) / 3);
  std::vector<double> nearest(centroids.size(), std::numeric_limits<double>::infinity());
  std::vector<int> owner(centroids.size(), 0);
  std::size_t seed = 0;
  for (int k = 0; k < count; ++k) {
    for (std::size_t t = 0; t < centroids.size(); ++t)
      if (const double d = (centroids[t] - centroids[seed]).norm(); d < nearest[t]) {
        nearest[t] = d;
        owner[t] = k;
      }
    seed = std::size_t(std::max_element(nearest.begin(), nearest.end()) - nearest.begin());
  }
  model.buckets.assign(count, {});
  for (std::size_t t = 0; t < owner.size(); ++t) model.buckets[owner[t]].push_back(int(t));
}

// Of one body whose nodes are here.
inline DynamicsFrame frameOf(double time, const std::vector<Eigen::Vector3d>& nodes) {
  DynamicsFrame out;
  out.time = time;
  out.bodies.resize(1);
  out.bodies[0].nodes = nodes;
  return out;
}

// A closed ellipsoid, 0.2 m long, around the x axis; 2 around (along - 1) triangles: 18, 14 gives 468.
inline TouchShape ellipsoid(int around, int along, int bucketCount, double bumpiness = 1) {
  auto model = std::make_shared<SoftBodyModel>();
  const auto point = [&](double theta, double phi) {
    const double bump = 1 + bumpiness * (0.08 * std::sin(5 * phi) * std::sin(4 * theta) + 0.05 * std::cos(3 * theta));
    return Eigen::Vector3d(0.10 * bump * std::cos(theta), 0.06 * bump * std::sin(theta) * std::cos(phi),
                           0.05 * bump * std::sin(theta) * std::sin(phi));
  };
  model->restNodes.push_back(point(0, 0));
  for (int i = 1; i < along; ++i)
    for (int j = 0; j < around; ++j)
      model->restNodes.push_back(point(std::numbers::pi * i / along, 2 * std::numbers::pi * j / around));
  model->restNodes.push_back(point(std::numbers::pi, 0));
  const int last = int(model->restNodes.size()) - 1;
  const auto id = [&](int i, int j) { return 1 + (i - 1) * around + j % around; };
  for (int j = 0; j < around; ++j) {
    model->triangles.push_back({0, id(1, j), id(1, j + 1)});
    model->triangles.push_back({last, id(along - 1, j + 1), id(along - 1, j)});
    for (int i = 1; i + 1 < along; ++i) {
      model->triangles.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
      model->triangles.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
    }
  }
  fillBuckets(*model, bucketCount);
  return model;
}

// A closed box of n x n squares above and below, centred at the origin; its top faces +y.
inline TouchShape plate(int n, double halfWidth, double thickness, int bucketCount) {
  auto model = std::make_shared<SoftBodyModel>();
  for (const double y : {thickness / 2, -thickness / 2})
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j)
        model->restNodes.emplace_back(halfWidth * (2.0 * j / n - 1), y, halfWidth * (2.0 * i / n - 1));
  const auto id = [&](int side, int i, int j) { return side * (n + 1) * (n + 1) + i * (n + 1) + j; };
  const auto quad = [&](int a, int b, int c, int d) {
    model->triangles.push_back({a, b, c});
    model->triangles.push_back({a, c, d});
  };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      quad(id(0, i, j), id(0, i + 1, j), id(0, i + 1, j + 1), id(0, i, j + 1));
      quad(id(1, i, j), id(1, i, j + 1), id(1, i + 1, j + 1), id(1, i + 1, j));
    }
    quad(id(0, i, 0), id(1, i, 0), id(1, i + 1, 0), id(0, i + 1, 0));
    quad(id(0, i + 1, n), id(1, i + 1, n), id(1, i, n), id(0, i, n));
    quad(id(0, 0, i + 1), id(1, 0, i + 1), id(1, 0, i), id(0, 0, i));
    quad(id(0, n, i), id(1, n, i), id(1, n, i + 1), id(0, n, i + 1));
  }
  fillBuckets(*model, bucketCount);
  return model;
}

inline TouchShape shapeOf(std::vector<Eigen::Vector3d> nodes, std::vector<std::array<int, 3>> triangles) {
  auto model = std::make_shared<SoftBodyModel>();
  model->restNodes = std::move(nodes);
  model->triangles = std::move(triangles);
  fillBuckets(*model, 1);
  return model;
}

using SurfaceMotion = std::function<Eigen::Vector3d(const Eigen::Vector3d& rest, double time)>;

inline DynamicsFrame frameAt(const SoftBodyModel& model, double time, const SurfaceMotion& motion = {}) {
  DynamicsFrame frame;
  frame.time = time;
  frame.bodies.resize(1);
  for (const Eigen::Vector3d& x : model.restNodes) frame.bodies[0].nodes.push_back(motion ? motion(x, time) : x);
  return frame;
}

// xorshift64*: the same numbers everywhere.
struct TestRandom {
  std::uint64_t state = 0x9E3779B97F4A7C15ULL;
  double uniform() {  // 0..1
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return double((state * 0x2545F4914F6CDD1DULL) >> 11) * 0x1p-53;
  }
  double uniform(double from, double to) { return from + (to - from) * uniform(); }
  Eigen::Vector3d vector(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }
};

}  // namespace medulla
