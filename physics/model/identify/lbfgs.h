#pragma once

#include <Eigen/Core>
#include <functional>

namespace medulla {

// A value and its gradient; infinity where x is outside the domain.
using Objective = std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd& gradient)>;

struct DescentSettings {
  int iterations = 300;
  double tolerance = 1e-9;  // of the value's relative change in one iteration
  int memory = 20;          // pairs of steps
};

// Minimises from x by limited-memory BFGS (Nocedal 1980) with steps that meet the weak Wolfe conditions, found by
// bisection (Lewis and Overton 2013). Returns the value reached. Throws
// std::runtime_error where the value at x is not finite.
double descend(const Objective& objective, const DescentSettings& settings, Eigen::VectorXd& x);

}  // namespace medulla
