#pragma once

#include <array>
#include <vector>

#include "physics/dynamics/block6.h"

namespace medulla {

// Cholesky factor of a sparse symmetric positive definite matrix of 6x6 blocks, one row of blocks per sphere and one
// block beside the diagonal per link. Order and fill are found once (minimum degree); factorising and solving allocate
// nothing. A tree's matrix fills in nowhere.
class BlockCholesky {
 public:
  // Row and column of the blocks beside the diagonal; either order, repeats add up.
  void analyse(int rows, const std::vector<std::array<int, 2>>& blocks);

  // A new matrix: clear(), then all diagonal blocks and, in their order, all of analyse()'s, the k-th in (row, column)
  // as given there.
  void clear();
  Block6& diagonal(int row) { return diagonal_[position_[row]]; }
  void addBlock(int k, const Block6& block);

  // False where a pivot is not positive: the matrix is not definite, or not finite.
  bool factorise();
  // In place; `x` holds a vector of six per row.
  void solve(std::vector<Vector6>& x) const;

 private:
  struct Update {  // entry[target] -= entry[i] entry[k]^T; target < 0: the diagonal block -1 - target
    int i, k, target;
  };
  std::vector<int> order_, position_;     // order_[p]: the row that is eliminated p-th; position_: its inverse
  std::vector<int> firstEntry_;           // per column, in the order of elimination
  std::vector<int> entryRow_;             // position of each block below the diagonal
  std::vector<Block6> entry_, diagonal_;  // after factorise(): L, and of its diagonal blocks L^-T
  std::vector<int> firstUpdate_;          // per column
  std::vector<Update> updates_;
  std::vector<int> slot_;      // of analyse()'s blocks: an entry
  std::vector<char> turned_;   // whether the block goes in transposed
  std::vector<char> isFirst_;  // whether it is its entry's first
  std::vector<int> fill_;      // entries without any
  mutable std::vector<Vector6> work_;
};

}  // namespace medulla
