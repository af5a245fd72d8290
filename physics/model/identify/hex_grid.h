#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "physics/model/power_cells.h"

namespace medulla {

constexpr int kHexNodes = 27, kHexGauss = 125;  // of a cell: quadratic shapes in every axis; five Gauss points in each

// A body in cells of a regular grid, whatever their part inside: cells that the surface cuts keep all 27 nodes and
// integrate over their part alone, by Gauss weights fitted to its moments (Mueller, Kummer and Oberlack 2013).
struct HexGrid {
  static constexpr int kVoxels = 8;               // along a cell's edge: the voxels that measure a cut cell's part
  double size = 0;                                // m, edge of a cell
  Eigen::Vector3d low = Eigen::Vector3d::Zero();  // m, corner of cell (0, 0, 0)
  std::array<int, 3> count{};
  std::vector<std::array<int, 3>> cells;              // by x, y, then z
  std::vector<int> cellAt;                            // cell at (i * count[1] + j) * count[2] + k, -1 where dropped
  std::vector<std::array<int, kHexNodes>> cellNodes;  // node (i * 3 + j) * 3 + k of the cell at i, j, k halves of it
  Eigen::MatrixXd weights;                            // kHexGauss x cells, 1 in sum over a cell wholly inside
  std::vector<Eigen::Vector3d> nodes;                 // m
};

// The grid whose cells are kVoxels voxels wide. Cells with less than 2 % inside are dropped: they would make the
// stiffness matrix nearly singular. The rest get 1e-3 of the whole cell on top, for the same reason. Pieces `without`,
// if given, are left out.
HexGrid makeHexGrid(const VoxelBody& voxels, const std::vector<bool>& without = {});

// Where a point lies among the nodes: in its cell, or, where that was dropped, beyond the edge of the nearest one.
struct HexPoint {
  int cell = 0;
  std::array<double, kHexNodes> shape{};  // 1 in sum
};
HexPoint locate(const HexGrid& grid, const Eigen::Vector3d& point);

// Quadratic Lagrange shapes at 0, 1/2 and 1, and their slopes, at x.
std::array<double, 3> quadraticShapes(double x);
std::array<double, 3> quadraticSlopes(double x);

// Abscissas in 0..1 and weights, 1 in sum, of five-point Gauss-Legendre quadrature.
struct GaussRule {
  std::array<double, 5> points, weights;
};
const GaussRule& fivePointRule();

}  // namespace medulla
