#include "physics/model/identify/hex_stiffness.h"

namespace medulla {

using Eigen::MatrixXd;

namespace {

// d shape a / d x at Gauss point q of a cell with edges of 1.
Eigen::Matrix<double, kHexNodes, 3> gradients(int q) {
  const GaussRule& rule = fivePointRule();
  std::array<std::array<double, 3>, 3> shapes, slopes;
  const std::array<int, 3> at = {q / 25, q / 5 % 5, q % 5};
  for (int a = 0; a < 3; ++a) {
    shapes[a] = quadraticShapes(rule.points[at[a]]);
    slopes[a] = quadraticSlopes(rule.points[at[a]]);
  }
  Eigen::Matrix<double, kHexNodes, 3> out;
  for (int n = 0; n < kHexNodes; ++n) {
    const int i = n / 9, j = n / 3 % 3, k = n % 3;
    out.row(n) << slopes[0][i] * shapes[1][j] * shapes[2][k], shapes[0][i] * slopes[1][j] * shapes[2][k],
        shapes[0][i] * shapes[1][j] * slopes[2][k];
  }
  return out;
}

}  // namespace

// K[3a+i, 3b+j] = lambda g_a,i g_b,j + mu (g_a,j g_b,i + delta_ij g_a . g_b)
MatrixXd stiffnessPerPoint(double poisson) {
  const double lambda = poisson / ((1 + poisson) * (1 - 2 * poisson)), mu = 1 / (2 * (1 + poisson));
  MatrixXd out(kHexFreedoms * kHexFreedoms, kHexGauss);
  for (int q = 0; q < kHexGauss; ++q) {
    const Eigen::Matrix<double, kHexNodes, 3> g = gradients(q);
    for (int b = 0; b < kHexNodes; ++b) {
      for (int a = 0; a < kHexNodes; ++a) {
        const double along = mu * g.row(a).dot(g.row(b));
        for (int j = 0; j < 3; ++j) {
          for (int i = 0; i < 3; ++i) {
            out(kHexFreedoms * (3 * b + j) + 3 * a + i, q) =
                lambda * g(a, i) * g(b, j) + mu * g(a, j) * g(b, i) + (i == j ? along : 0);
          }
        }
      }
    }
  }
  return out;
}

MatrixXd hexStiffness(const HexGrid& grid, const MatrixXd& perPoint, std::span<const int> cells) {
  MatrixXd weights(kHexGauss, static_cast<Eigen::Index>(cells.size()));
  for (std::size_t c = 0; c < cells.size(); ++c) weights.col(static_cast<Eigen::Index>(c)) = grid.weights.col(cells[c]);
  return grid.size * (perPoint * weights);
}

}  // namespace medulla
