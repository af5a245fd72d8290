#include "physics/model/identify/held_give.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "physics/model/identify/check_loads.h"
#include "physics/model/identify/held_rim.h"
#include "physics/model/identify/parallel.h"
#include "physics/model/mesh_topology.h"

namespace medulla {

using Eigen::VectorXd;

namespace {

// Of the error of work by the cells' size: twice the exponent of displacements at the rim, 0.5 where a smooth surface
// goes on and 0.62 where the free surface leaves at a right angle, at a Poisson's ratio of 0.45 (Williams 1952). A
// liver's work, on a smooth surface, changes between cells of 19.9, 13.2 and 9.9 mm with orders of 1.2 to 1.4 where it
// bends: cells of this size are not yet where the first order is alone.
constexpr double kOrder = 1.25;

// Grids whose answers differ by more than this factor do not agree: of ten bodies and beds these are 1.0 to 3.3 times
// apart, of three 8 times, 18 times, and in sign.
constexpr double kAlike = 4;

VectorXd workOf(const VoxelSolid& solid, const RowMatrix& forces, const RowMatrix& displacements) {
  return forces.cwiseProduct(RowMatrix(solid.loading.transpose() * displacements)).colwise().sum().transpose();
}

struct Work {
  double size = 0;   // of the cells
  VectorXd ofLoads;  // none where the cells fell apart
};

Work workUnder(const VoxelSolid& solid, const RowMatrix& forces) {
  return {solid.grid.size, workOf(solid, forces, displacementsUnder(solid, forces))};
}

// In cells twice as large.
Work workOfDoubled(const TriangleMesh& mesh, const SolidSettings& settings, double size, const RowMatrix& forces,
                   const std::function<void(double)>& progress) {
  VoxelSolid solid;
  try {
    solid = makeVoxelSolid(mesh, 2 * size, settings, progress);
  } catch (const std::runtime_error&) {
    return {};
  }
  return workUnder(solid, forces);
}

// How much of `lacking` goes as `springs`, both per load. Where cells are too coarse for the body itself, as a
// stomach's narrow ends are for them, all loads lack a part alike besides: it counts where without it more than twice
// as much is left unexplained, by 1.0 to 1.1 times on bodies whose cells are fine enough and 4 times on the stomach.
double shareOfRim(const VectorXd& lacking, const VectorXd& springs) {
  const VectorXd spread = springs.array() - springs.mean();
  const double alone = lacking.dot(springs) / springs.squaredNorm(),
               beside = lacking.dot(spread) / spread.squaredNorm();
  const VectorXd leftAlone = lacking - alone * springs, left = lacking - beside * springs;
  const double leftBeside = (left.array() - left.mean()).matrix().norm();
  return left.mean() > 0 && leftAlone.norm() > 2 * leftBeside ? beside : alone;
}

}  // namespace

// Grids differ by chance, too, by where their cells cut the surface and the rim: a few thousandths of the work, which
// extrapolation enlarges. So two grids are asked, of cells a third larger and twice as large. The lesser answer counts,
// and where they do not agree what rims of such an angle give as a rule. The rule alone, everywhere, brings elements
// nearer still (tests/accuracy/limits.md), and some networks farther, whose own errors it no longer makes up for.
double giveOfHeld(const TriangleMesh& mesh, const SolidSettings& settings, const VoxelSolid& solid,
                  const VoxelSolid& larger) {
  constexpr int count = 16;
  if (solid.isFree) return 0;
  NodeSurface surface = measureNodes(mesh, {});
  surface.held = nodesOfTriangles(mesh, settings.heldTriangles);
  const RowMatrix forces = randomLoads(mesh, surface, LoadKind::bulk, boundsDiagonal(mesh), count, 3);
  Alongside<Work> doubled([&](const std::function<void(double)>& goOn) {
    return workOfDoubled(mesh, settings, solid.grid.size, forces, goOn);
  });
  const RowMatrix x = displacementsUnder(solid, forces);
  const VectorXd work = workOf(solid, forces, x);
  // Without a rim nothing holds too much.
  const VectorXd springs =
      x.cwiseProduct(RowMatrix(solid.rimSprings * x)).colwise().sum().transpose().cwiseQuotient(work);
  const auto giveBy = [&](const Work& other) {
    const VectorXd lacking = VectorXd::Ones(count) - other.ofLoads.cwiseQuotient(work);
    const double ratio = other.size / solid.grid.size;
    return shareOfRim(lacking, springs) / (std::pow(ratio, kOrder) - 1);
  };
  if (!(springs.squaredNorm() > 0)) return 0;
  const double usual = usualGive(rimOfHeld(mesh, settings.heldTriangles, settings.heldSpaces));
  const Work ofLarger = workUnder(larger, forces), ofDoubled = doubled.get();
  if (ofDoubled.ofLoads.size() == 0) return usual;
  const double byLarger = giveBy(ofLarger), byDoubled = giveBy(ofDoubled);
  const double lesser = std::min(byLarger, byDoubled);
  return std::max(byLarger, byDoubled) < kAlike * lesser ? lesser : usual;
}

}  // namespace medulla
