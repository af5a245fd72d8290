#include "physics/model/identify/held_give.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "physics/model/identify/check_loads.h"
#include "physics/model/mesh_topology.h"

namespace medulla {

using Eigen::VectorXd;

namespace {

// Of the error of work by the cells' size: twice the exponent of displacements at the rim, 0.5 where a smooth surface
// goes on and 0.62 where the free surface leaves at a right angle, at a Poisson's ratio of 0.45 (Williams 1952). A
// liver's work, on a smooth surface, changes between cells of 19.9, 13.2 and 9.9 mm with orders of 1.2 to 1.4 where it
// bends: cells of this size are not yet where the first order is alone.
constexpr double kOrder = 1.25;

VectorXd workOf(const VoxelSolid& solid, const RowMatrix& forces, const RowMatrix& displacements) {
  return forces.cwiseProduct(RowMatrix(solid.loading.transpose() * displacements)).colwise().sum().transpose();
}

// The same body in cells twice as large, unless they fall apart.
std::optional<VoxelSolid> doubled(const TriangleMesh& mesh, const SolidSettings& settings, const VoxelSolid& solid) {
  try {
    return makeVoxelSolid(mesh, 2 * solid.grid.size, settings);
  } catch (const std::runtime_error&) {
    return {};
  }
}

}  // namespace

// Grids differ by chance, too, by where their cells cut the surface and the rim: a few thousandths of the work, which
// extrapolation enlarges. So the lesser of two answers counts, that of cells a third larger and that of cells twice as
// large, and none where these do not agree that the body is held too stiffly.
double giveOfHeld(const TriangleMesh& mesh, const SolidSettings& settings, const VoxelSolid& solid,
                  const VoxelSolid& larger) {
  constexpr int count = 16;
  if (solid.isFree) return 0;
  const std::optional<VoxelSolid> largest = doubled(mesh, settings, solid);
  if (!largest) return 0;
  NodeSurface surface = measureNodes(mesh, {});
  for (const int t : settings.heldTriangles) {
    for (const int n : mesh.triangles[t]) surface.held[n] = true;
  }
  const RowMatrix forces = randomLoads(mesh, surface, LoadKind::bulk, boundsDiagonal(mesh), count, 3);
  const RowMatrix x = displacementsUnder(solid, forces);
  const VectorXd work = workOf(solid, forces, x);
  const VectorXd springs =
      x.cwiseProduct(RowMatrix(solid.rimSprings * x)).colwise().sum().transpose().cwiseQuotient(work);
  const auto giveBy = [&](const VoxelSolid& other) {
    const VectorXd lacking =
        VectorXd::Ones(count) - workOf(other, forces, displacementsUnder(other, forces)).cwiseQuotient(work);
    const double ratio = other.grid.size / solid.grid.size;
    return lacking.dot(springs) / springs.squaredNorm() / (std::pow(ratio, kOrder) - 1);
  };
  return std::max(0., std::min(giveBy(larger), giveBy(*largest)));
}

}  // namespace medulla
