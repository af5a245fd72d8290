#pragma once

#include <Eigen/Core>

// Soft toys and a bowl to drop them into, as signed distance functions (assets/shapes/sdf.h): millimetres, y up, each
// about its own origin.
namespace medulla {

double bean(const Eigen::Vector3d& p);  // a bent roll, 106 mm long
double drop(const Eigen::Vector3d& p);  // thick below, thin above, 90 mm
double star(const Eigen::Vector3d& p);  // five arms in the plane z = 0, 95 mm
double bowl(const Eigen::Vector3d& p);  // half a spherical shell, 198 mm inside, open above y = 20, on a foot

}  // namespace medulla
