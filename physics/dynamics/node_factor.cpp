#include "physics/dynamics/node_factor.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cstddef>
#include <stdexcept>

namespace medulla {

void NodeFactor::factorise(const std::vector<double>& diagonal, const std::vector<Edge>& edges) {
  const int n = static_cast<int>(diagonal.size());
  std::vector<Eigen::Triplet<double>> triplets;
  for (int i = 0; i < n; ++i) triplets.emplace_back(i, i, diagonal[i]);
  for (const Edge& e : edges) {
    triplets.emplace_back(e.node0, e.node0, e.weight);
    triplets.emplace_back(e.node1, e.node1, e.weight);
    triplets.emplace_back(std::max(e.node0, e.node1), std::min(e.node0, e.node1), -e.weight);
  }
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> factor(matrix);
  if (factor.info() != Eigen::Success) throw std::runtime_error("the surface's matrix is not positive definite");
  order_.resize(n);
  for (int p = 0; p < n; ++p) order_[p] = factor.permutationPinv().indices()[p];
  const Eigen::SparseMatrix<double> l = factor.matrixL();
  firstEntry_.assign(1, 0);
  entryRow_.clear();
  entry_.clear();
  inverseDiagonal_.clear();
  for (int j = 0; j < n; ++j) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(l, j); it; ++it) {
      if (it.row() == j) {
        inverseDiagonal_.push_back(1 / it.value());
      } else {
        entryRow_.push_back(static_cast<int>(it.row()));
        entry_.push_back(it.value());
      }
    }
    firstEntry_.push_back(static_cast<int>(entry_.size()));
  }
  work_.resize(n);
}

void NodeFactor::solve(Quad* x) const {
  const int n = static_cast<int>(order_.size());
  for (int p = 0; p < n; ++p) work_[p] = x[order_[p]];
  for (int j = 0; j < n; ++j) {
    const Lanes value = splat(inverseDiagonal_[j]) * load(work_[j]);
    store(work_[j], value);
    for (int k = firstEntry_[j]; k < firstEntry_[j + 1]; ++k) {
      Quad& below = work_[entryRow_[k]];
      store(below, fnma(splat(entry_[k]), value, load(below)));
    }
  }
  for (int j = n; j-- > 0;) {
    Lanes sum = load(work_[j]);
    for (int k = firstEntry_[j]; k < firstEntry_[j + 1]; ++k)
      sum = fnma(splat(entry_[k]), load(work_[entryRow_[k]]), sum);
    store(work_[j], splat(inverseDiagonal_[j]) * sum);
  }
  for (int p = 0; p < n; ++p) x[order_[p]] = work_[p];
}

}  // namespace medulla
