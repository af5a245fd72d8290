#pragma once

#include <Eigen/Core>
#include <span>

#include "physics/model/identify/hex_grid.h"

namespace medulla {

constexpr int kHexFreedoms = 3 * kHexNodes;  // three per node: 3 a + axis

// Linear elasticity's stiffness of a cell with edges of 1 m (N/m per Pa of Young's modulus) per weight of each Gauss
// point: a column of kHexFreedoms^2 numbers, column by column, for each point.
Eigen::MatrixXd stiffnessPerPoint(double poisson);

// The matrices of cells of the grid, a column each.
Eigen::MatrixXd hexStiffness(const HexGrid& grid, const Eigen::MatrixXd& perPoint, std::span<const int> cells);

}  // namespace medulla
