#pragma once

#include <Eigen/Core>

namespace medulla {

struct SymmetricEigen {
  Eigen::VectorXd values;   // ascending
  Eigen::MatrixXd vectors;  // columns of length 1
};

// Of a symmetric matrix; its lower triangle is read. In a source of its own, and for any size, as Eigen's solvers take
// g++ 5 to 10 s per file and size.
SymmetricEigen symmetricEigen(const Eigen::MatrixXd& matrix);

// Of M^-1 K, ascending: symmetric K, symmetric and positive definite M.
Eigen::VectorXd eigenvaluesOf(const Eigen::MatrixXd& stiffness, const Eigen::MatrixXd& mass);

}  // namespace medulla
