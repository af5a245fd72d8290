#include "physics/model/symmetric_eigen.h"

#include <Eigen/Eigenvalues>

namespace medulla {

SymmetricEigen symmetricEigen(const Eigen::MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::VectorXd eigenvaluesOf(const Eigen::MatrixXd& stiffness, const Eigen::MatrixXd& mass) {
  return Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd>(stiffness, mass, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

}  // namespace medulla
