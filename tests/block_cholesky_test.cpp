#include "physics/dynamics/block_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "tests/dynamics_states.h"

// The factorisation of the implicit step against a dense one.
namespace medulla {

using states::Random;

static Eigen::MatrixXd randomMatrix(Random& random, int rows, int columns) {
  Eigen::MatrixXd m(rows, columns);
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) m(i, j) = random.uniform();
  return m;
}

TEST(BlockCholesky, SolvesWhatADenseFactorSolves) {
  // A chain, a ring, two rings that share a block, a grid: with and without fill; one block is given twice.
  const std::vector<std::vector<std::array<int, 2>>> graphs = {
      {{0, 1}, {2, 1}, {2, 3}},
      {{0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 0}},
      {{0, 1}, {1, 2}, {2, 0}, {2, 3}, {3, 4}, {4, 2}, {4, 2}},
      {{0, 1}, {1, 2}, {3, 4}, {4, 5}, {6, 7}, {7, 8}, {0, 3}, {3, 6}, {4, 1}, {4, 7}, {2, 5}, {8, 5}}};
  for (const auto& blocks : graphs) {
    int rows = 0;
    for (const auto& b : blocks) rows = std::max({rows, b[0] + 1, b[1] + 1});
    Random random(rows);
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(6 * rows, 6 * rows);
    BlockCholesky factor;
    factor.analyse(rows, blocks);
    for (int twice = 0; twice < 2; ++twice) {  // the second time with other numbers
      factor.clear();
      dense.setZero();
      for (std::size_t k = 0; k < blocks.size(); ++k) {
        const Block6 b = randomMatrix(random, 6, 6);
        const auto [i, j] = blocks[k];
        factor.addBlock(static_cast<int>(k), b);
        dense.block<6, 6>(6 * i, 6 * j) += b;
        dense.block<6, 6>(6 * j, 6 * i) += b.transpose();
      }
      for (int i = 0; i < rows; ++i) {
        const Block6 b = randomMatrix(random, 6, 6);
        const Block6 own = b * b.transpose() + 40 * Block6::Identity();
        factor.diagonal(i) = own;
        dense.block<6, 6>(6 * i, 6 * i) = own;
      }
      ASSERT_TRUE(factor.factorise());
      const Eigen::VectorXd right = randomMatrix(random, 6 * rows, 1), expected = dense.ldlt().solve(right);
      std::vector<Vector6> x(rows);
      for (int i = 0; i < rows; ++i) x[i] = right.segment<6>(6 * i);
      factor.solve(x);
      for (int i = 0; i < rows; ++i) EXPECT_LT((x[i] - expected.segment<6>(6 * i)).norm(), 1e-13 * expected.norm());
    }
  }
}

TEST(BlockCholesky, SaysWhereAMatrixIsNotDefinite) {
  BlockCholesky factor;
  factor.analyse(2, {{0, 1}});
  factor.clear();
  factor.diagonal(0) = factor.diagonal(1) = Block6::Identity();
  factor.addBlock(0, 2 * Block6::Identity());
  EXPECT_FALSE(factor.factorise());
}

}  // namespace medulla
