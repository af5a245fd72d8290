#pragma once

#include "physics/model/identified_network.h"

namespace medulla {

struct SymmetricEigen {
  Eigen::Matrix<double, 6, 1> values;  // ascending
  Matrix6d vectors;                    // columns of length 1
};

// Of a symmetric matrix; its lower triangle is read. In a source of its own, as Eigen's solver takes g++ 5 s per file
// that names it.
SymmetricEigen symmetricEigen(const Matrix6d& matrix);

}  // namespace medulla
