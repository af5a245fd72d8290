#include "physics/model/identify/hex_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace medulla {

using Eigen::Vector3d;

namespace {

constexpr double kFractionMin = 0.02, kFloorWeight = 1e-3;

// Legendre polynomials of degree 0 to 5 at x in -1..1.
std::array<double, 6> legendre(double x) {
  std::array<double, 6> p = {1, x};
  for (int n = 1; n < 5; ++n) p[n + 1] = ((2 * n + 1) * x * p[n] - n * p[n - 1]) / (n + 1);
  return p;
}

using AxisWeights = std::array<double, 5>;

// Five weights that give the mean of polynomials up to the fourth degree over [from, to] of 0..1 by their values at the
// Gauss points of the whole: the projection on Legendre polynomials, whose antiderivative is (P[n+1] - P[n-1]) / (2 n +
// 1).
AxisWeights meanWeights(double from, double to) {
  const std::array<double, 6> high = legendre(2 * to - 1), low = legendre(2 * from - 1);
  std::array<double, 5> moments;  // (2 n + 1) times the integral of P[n] over the part
  moments[0] = 2 * (to - from);
  for (int n = 1; n < 5; ++n) moments[n] = high[n + 1] - high[n - 1] - low[n + 1] + low[n - 1];
  const GaussRule& rule = fivePointRule();
  AxisWeights weights{};
  for (int i = 0; i < 5; ++i) {
    const std::array<double, 6> at = legendre(2 * rule.points[i] - 1);
    for (int n = 0; n < 5; ++n) weights[i] += rule.weights[i] / (2 * (to - from)) * at[n] * moments[n];
  }
  return weights;
}

void numberNodes(HexGrid& grid) {
  const std::array<int, 3> lines = {2 * grid.count[0] + 1, 2 * grid.count[1] + 1, 2 * grid.count[2] + 1};
  std::vector<int> number(static_cast<std::size_t>(lines[0]) * lines[1] * lines[2], -1);
  const auto at = [&](const std::array<int, 3>& cell, int a) -> int& {
    const int i = 2 * cell[0] + a / 9, j = 2 * cell[1] + a / 3 % 3, k = 2 * cell[2] + a % 3;
    return number[(static_cast<std::size_t>(i) * lines[1] + j) * lines[2] + k];
  };
  for (const std::array<int, 3>& cell : grid.cells)
    for (int a = 0; a < kHexNodes; ++a) at(cell, a) = 0;
  for (std::size_t n = 0; n < number.size(); ++n) {
    if (number[n] < 0) continue;
    number[n] = static_cast<int>(grid.nodes.size());
    const int k = static_cast<int>(n % lines[2]), j = static_cast<int>(n / lines[2] % lines[1]),
              i = static_cast<int>(n / lines[2] / lines[1]);
    grid.nodes.push_back(grid.low + grid.size / 2 * Vector3d(i, j, k));
  }
  for (const std::array<int, 3>& cell : grid.cells) {
    std::array<int, kHexNodes>& nodes = grid.cellNodes.emplace_back();
    for (int a = 0; a < kHexNodes; ++a) nodes[a] = at(cell, a);
  }
}

std::array<int, 3> cellOf(const VoxelPiece& piece) {
  return {piece.index[0] / HexGrid::kVoxels, piece.index[1] / HexGrid::kVoxels, piece.index[2] / HexGrid::kVoxels};
}

}  // namespace

const GaussRule& fivePointRule() {
  static const GaussRule rule = [] {
    const double a = std::sqrt(5 - 2 * std::sqrt(10. / 7)) / 3, b = std::sqrt(5 + 2 * std::sqrt(10. / 7)) / 3;
    const double wa = (322 + 13 * std::sqrt(70.)) / 1800, wb = (322 - 13 * std::sqrt(70.)) / 1800;
    return GaussRule{{(1 - b) / 2, (1 - a) / 2, 0.5, (1 + a) / 2, (1 + b) / 2}, {wb, wa, 64. / 225, wa, wb}};
  }();
  return rule;
}

std::array<double, 3> quadraticShapes(double x) {
  return {(2 * x - 1) * (x - 1), 4 * x * (1 - x), x * (2 * x - 1)};
}

std::array<double, 3> quadraticSlopes(double x) {
  return {4 * x - 3, 4 - 8 * x, 4 * x - 1};
}

namespace {

std::size_t indexOf(const HexGrid& grid, const std::array<int, 3>& c) {
  return (static_cast<std::size_t>(c[0]) * grid.count[1] + c[1]) * grid.count[2] + c[2];
}

// Of all pieces that count, in those that are large enough.
void layOutCells(const VoxelBody& voxels, const std::vector<bool>& counts, HexGrid& grid) {
  const double cell = grid.size * grid.size * grid.size;
  std::vector<double> inside(static_cast<std::size_t>(grid.count[0]) * grid.count[1] * grid.count[2], 0);
  for (std::size_t p = 0; p < voxels.pieces.size(); ++p) {
    const VoxelPiece& piece = voxels.pieces[p];
    if (counts[p]) inside[indexOf(grid, cellOf(piece))] += piece.volume / cell;
  }
  grid.cellAt.assign(inside.size(), -1);
  for (int i = 0; i < grid.count[0]; ++i) {
    for (int j = 0; j < grid.count[1]; ++j) {
      for (int k = 0; k < grid.count[2]; ++k) {
        if (inside[indexOf(grid, {i, j, k})] < kFractionMin) continue;
        grid.cellAt[indexOf(grid, {i, j, k})] = static_cast<int>(grid.cells.size());
        grid.cells.push_back({i, j, k});
      }
    }
  }
}

void addGaussWeights(const VoxelBody& voxels, const std::vector<bool>& counts, HexGrid& grid) {
  constexpr int n = HexGrid::kVoxels;
  std::array<AxisWeights, n> ofWholeVoxel;  // most pieces are
  for (int v = 0; v < n; ++v) ofWholeVoxel[v] = meanWeights(static_cast<double>(v) / n, (v + 1.) / n);
  const double whole = grid.size * grid.size * grid.size;
  for (std::size_t p = 0; p < voxels.pieces.size(); ++p) {
    const VoxelPiece& piece = voxels.pieces[p];
    const int cell = grid.cellAt[indexOf(grid, cellOf(piece))];
    if (cell < 0 || !counts[p]) continue;
    const auto along = [&](int a) {
      if (piece.extent[a] == voxels.size) return ofWholeVoxel[piece.index[a] % n];
      const double middle = (piece.centre[a] - grid.low[a]) / grid.size - grid.cells[cell][a];
      const double half = piece.extent[a] / grid.size / 2;
      return meanWeights(middle - half, middle + half);
    };
    const AxisWeights x = along(0), y = along(1), z = along(2);
    double* weight = grid.weights.col(cell).data();
    for (int i = 0; i < 5; ++i) {
      for (int j = 0; j < 5; ++j) {
        const double xy = piece.volume / whole * x[i] * y[j];
        for (int k = 0; k < 5; ++k) *weight++ += xy * z[k];
      }
    }
  }
}

}  // namespace

HexGrid makeHexGrid(const VoxelBody& voxels, const std::vector<bool>& without) {
  constexpr int n = HexGrid::kVoxels;
  HexGrid grid;
  grid.size = n * voxels.size;
  grid.low = voxels.low;
  for (int a = 0; a < 3; ++a) grid.count[a] = (voxels.count[a] + n - 1) / n;
  std::vector<bool> counts(voxels.pieces.size(), true);
  for (std::size_t p = 0; p < without.size(); ++p) counts[p] = !without[p];
  layOutCells(voxels, counts, grid);
  numberNodes(grid);
  const GaussRule& rule = fivePointRule();
  grid.weights.resize(kHexGauss, static_cast<Eigen::Index>(grid.cells.size()));
  for (int q = 0; q < kHexGauss; ++q) {
    grid.weights.row(q).setConstant(kFloorWeight * rule.weights[q / 25] * rule.weights[q / 5 % 5] *
                                    rule.weights[q % 5]);
  }
  addGaussWeights(voxels, counts, grid);
  return grid;
}

// The cell whose box is nearest among those of the first ring around `home` that has any, the first among equals.
static int nearestCell(const HexGrid& grid, const std::array<int, 3>& home, const Vector3d& local) {
  int best = -1;
  double least = std::numeric_limits<double>::infinity();
  for (int ring = 0; best < 0; ++ring) {
    for (int i = std::max(0, home[0] - ring); i <= std::min(grid.count[0] - 1, home[0] + ring); ++i) {
      for (int j = std::max(0, home[1] - ring); j <= std::min(grid.count[1] - 1, home[1] + ring); ++j) {
        for (int k = std::max(0, home[2] - ring); k <= std::min(grid.count[2] - 1, home[2] + ring); ++k) {
          const int cell = grid.cellAt[indexOf(grid, {i, j, k})];
          if (cell < 0) continue;
          const Vector3d corner(i, j, k);
          const Vector3d clamped = local.cwiseMax(corner).cwiseMin(corner + Vector3d::Ones());
          const double distance = (local - clamped).squaredNorm();
          if (distance < least) {
            least = distance;
            best = cell;
          }
        }
      }
    }
  }
  return best;
}

HexPoint locate(const HexGrid& grid, const Vector3d& point) {
  const Vector3d local = (point - grid.low) / grid.size;
  std::array<int, 3> home;
  for (int a = 0; a < 3; ++a) home[a] = std::clamp(static_cast<int>(std::floor(local[a])), 0, grid.count[a] - 1);
  HexPoint out;
  out.cell = grid.cellAt[indexOf(grid, home)];
  if (out.cell < 0) out.cell = nearestCell(grid, home, local);
  std::array<std::array<double, 3>, 3> shapes;
  for (int a = 0; a < 3; ++a) {
    // Beyond half a cell quadratic shapes say nothing any more.
    shapes[a] = quadraticShapes(std::clamp(local[a] - grid.cells[out.cell][a], -0.5, 1.5));
  }
  for (int a = 0; a < kHexNodes; ++a) out.shape[a] = shapes[0][a / 9] * shapes[1][a / 3 % 3] * shapes[2][a % 3];
  return out;
}

}  // namespace medulla
