#pragma once

#include <array>
#include <vector>

#include "physics/dynamics/simd.h"

namespace medulla {

// Cholesky factor of a sparse symmetric positive definite matrix of numbers that acts alike on x, y and z: the masses
// and springs of the surface, constant for a given step because edge springs act on displacements.
class NodeFactor {
 public:
  struct Edge {
    int node0, node1;
    double weight;
  };
  // Diagonal plus the edges' Laplacian. Throws std::runtime_error where it is not positive definite.
  void factorise(const std::vector<double>& diagonal, const std::vector<Edge>& edges);
  bool empty() const { return inverseDiagonal_.empty(); }
  void solve(Quad* x) const;  // in place

 private:
  std::vector<int> order_;  // order_[p]: which node is p-th
  std::vector<int> firstEntry_, entryRow_;
  std::vector<double> entry_, inverseDiagonal_;
  mutable std::vector<Quad> work_;
};

}  // namespace medulla
