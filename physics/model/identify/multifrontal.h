#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <span>
#include <vector>

#include "physics/model/identify/hex_grid.h"

// Cholesky factors of a grid's stiffness matrix by nested dissection (George 1973) and fronts (Duff and Reid 1983):
// the cells are halved again and again by planes; a front eliminates what no cell outside its part touches and hands
// the rest, a dense matrix, to the front of both halves together. Nearly all work is on dense blocks.
namespace medulla {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct Front {
  std::array<int, 2> halves = {-1, -1};  // fronts of its halves; -1 in a leaf
  int firstCell = 0, cellCount = 0;      // of `cellOrder`
  std::vector<int> nodes;                // of the grid; the first `own` are eliminated here
  int own = 0;
};

struct DissectionPlan {
  int nodes = 0;
  std::vector<int> cellOrder;
  std::vector<Front> fronts;  // halves before their whole; the root is the last
  double factorNumbers = 0;   // in all factors
  double operations = 0;      // multiplications and additions
};

DissectionPlan planDissection(const HexGrid& grid);

struct FrontFactors {
  // Of each front: 3 nodes x 3 own. Its upper square is the lower triangular L11, the rest is L21.
  std::vector<Eigen::MatrixXd> columns;
};

// Matrices of cells, one per column: kHexFreedoms square, lower triangles read. Called from several threads at once.
using CellMatrices = std::function<Eigen::MatrixXd(std::span<const int> cells)>;

// Halves of the body are factorised at once; the factors' bits do not depend on how many threads there are. `progress`
// is called from this thread with 0..1; where it throws, all work ends. Throws std::runtime_error where the matrix is
// not positive definite.
FrontFactors factorise(
    const DissectionPlan& plan, const HexGrid& grid, const CellMatrices& cellMatrices,
    const std::function<void(double)>& progress = [](double) {});

// Solves in place, on two threads: 3 nodes x right-hand sides. The more of these at once, the less each of them costs.
void solve(const DissectionPlan& plan, const FrontFactors& factors, RowMatrix& x);

}  // namespace medulla
