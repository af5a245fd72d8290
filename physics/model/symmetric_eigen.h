#pragma once

#include "physics/model/identified_network.h"

namespace medulla {

struct SymmetricEigen {
  Eigen::Matrix<double, 6, 1> values;  // ascending
  Matrix6d vectors;                    // columns of length 1
};

// Of a symmetric matrix; its lower triangle is read. In a source of its own, as Eigen's solvers take g++ 5 to 10 s per
// file that names one.
SymmetricEigen symmetricEigen(const Matrix6d& matrix);

// Of M^-1 K, ascending: symmetric K, symmetric and positive definite M.
Eigen::VectorXd eigenvaluesOf(const Eigen::MatrixXd& stiffness, const Eigen::MatrixXd& mass);

}  // namespace medulla
