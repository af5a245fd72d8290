#include "physics/model/ball_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "physics/model/greedy_cover.h"
#include "physics/model/medial_balls.h"
#include "physics/model/mesh_topology.h"
#include "physics/model/power_cells.h"

namespace medulla {

using Progress = std::function<void(double)>;

BodyShape measureShape(const TriangleMesh& mesh, double overshoot) {
  if (mesh.triangles.empty()) throw std::runtime_error("the mesh has no triangles; expected a closed surface");
  BodyShape shape{mesh, makeSurfaceTree(mesh), massProperties(mesh), boundsDiagonal(mesh)};
  shape.overshoot = overshoot / 100 * shape.diagonal;
  if (!(shape.exact.volume > 0)) throw std::runtime_error("the mesh encloses no volume; expected an outward surface");
  return shape;
}

static std::vector<Ball> candidatesOf(const BodyShape& shape, int count) {
  std::vector<Ball> medial =
      medialBalls(shape.tree, sampleSurface(shape.mesh, std::max(2500, 3 * count), 1), shape.diagonal);
  if (static_cast<int>(medial.size()) < count) {
    throw std::runtime_error(
        fmt::format("too thin: the mesh holds {} inscribed balls of 0.4 % of its diagonal or more; {} were asked for",
                    medial.size(), count));
  }
  for (Ball& ball : medial) ball.radius += shape.overshoot;
  return medial;
}

static CoverTargets targetsOf(const BodyShape& shape, int count) {
  CoverTargets targets;
  targets.diagonal = shape.diagonal;
  targets.overshoot = shape.overshoot;
  for (const SurfaceSample& s : sampleSurface(shape.mesh, std::max(3000, 3 * count), 2))
    targets.surface.push_back(s.point);
  // Vertices stick out furthest; beyond a few thousand the samples lie as close.
  if (shape.mesh.vertices.size() < 1500)
    targets.surface.insert(targets.surface.end(), shape.mesh.vertices.begin(), shape.mesh.vertices.end());
  const VoxelBody voxels = voxelise(shape.mesh, shape.exact.volume, std::max(20000, 30 * count));
  for (const VoxelPiece& piece : voxels.pieces)
    if (piece.extent.z() > voxels.size / 2) targets.volume.push_back(piece.centre);
  return targets;
}

std::vector<Ball> chooseBalls(const BodyShape& shape, int count, CoverGoal goal, const Progress& progress) {
  return coverWithBalls(shape.tree, candidatesOf(shape, count), targetsOf(shape, count), count, goal, progress);
}

double largestGap(const BodyShape& shape, const std::vector<Ball>& balls) {
  double largest = 0;
  for (const Eigen::Vector3d& p : gapPoints(shape.mesh)) largest = std::max(largest, distanceToBalls(p, balls));
  return 100 * largest / shape.diagonal;
}

std::vector<Ball> fewestBalls(const BodyShape& shape, double gap, int most, const Progress& progress) {
  std::vector<Ball> best;
  double closest = std::numeric_limits<double>::infinity();
  const auto reaches = [&](int count) {
    std::vector<Ball> balls = chooseBalls(shape, count, CoverGoal::gap);
    const double reached = largestGap(shape, balls);
    closest = std::min(closest, reached);
    if (reached > gap) return false;
    best = std::move(balls);
    return true;
  };
  int high = std::clamp(GreedyCount(candidatesOf(shape, 1), targetsOf(shape, 1))(gap), 1, most), low = 0;
  const int first = high;
  progress(0.1);
  while (!reaches(high)) {
    if (high == most || high > 4 * first) {
      throw std::runtime_error(
          fmt::format("a gap of {:g} % is out of reach: {} spheres leave {:.3g} %", gap, high, closest));
    }
    low = high;
    high = std::min(most, high + std::max(1, high / 2));
  }
  progress(0.3);
  const int range = high - low;
  // Improvement saves a quarter or so of the greedy balls: the first probe is there.
  for (int probe = std::max(low + 1, low + 3 * (high - low) / 4); high - low > 1; probe = (low + high) / 2) {
    if (probe >= high) probe = high - 1;
    (reaches(probe) ? high : low) = probe;
    progress(1 - 0.7 * (high - low) / range);
  }
  // Now and then one ball less does better than one more.
  for (int below = 2; below <= 3 && high - below >= 1;) {
    if (reaches(high - below)) {
      high -= below;
      below = 1;
    } else {
      ++below;
    }
  }
  return best;
}

std::vector<int> shareSpheres(const std::vector<BodyShape>& shapes, int count, const Progress& progress) {
  constexpr int kSteps = 16;
  const int bodies = static_cast<int>(shapes.size());
  if (count < bodies)
    throw std::runtime_error(fmt::format("{} spheres for {} bodies; expected one each at least", count, bodies));
  std::vector<GreedyCount> greedy;
  double high = 0;  // m
  for (const BodyShape& shape : shapes) {
    greedy.emplace_back(candidatesOf(shape, 1), targetsOf(shape, 1));
    high = std::max(high, shape.diagonal);
    progress(0.5 * static_cast<double>(greedy.size()) / bodies);
  }
  const auto countsFor = [&](double gap) {
    std::vector<int> counts(bodies);
    for (int b = 0; b < bodies; ++b) counts[b] = greedy[b](100 * gap / shapes[b].diagonal);
    return counts;
  };
  // Gaps that bring the sum just under and just over what was asked for.
  std::vector<int> counts(bodies, 1), more = countsFor(0);
  double low = 0;
  for (int step = 0; step < kSteps; ++step) {
    progress(0.5 + 0.5 * step / kSteps);
    const std::vector<int> probe = countsFor((low + high) / 2);
    const bool fits = std::accumulate(probe.begin(), probe.end(), 0) <= count;
    (fits ? high : low) = (low + high) / 2;
    (fits ? counts : more) = probe;
  }
  // What is left goes, one each in turn, to those that the smaller gap gives more; then to all.
  for (int left = count - std::accumulate(counts.begin(), counts.end(), 0); left > 0;) {
    bool any = false;
    for (int b = 0; b < bodies && left > 0; ++b) {
      if (counts[b] >= more[b]) continue;
      ++counts[b];
      --left;
      any = true;
    }
    if (!any) std::transform(counts.begin(), counts.end(), more.begin(), [](int c) { return c + 1; });
  }
  return counts;
}

}  // namespace medulla
