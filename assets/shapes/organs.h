#pragma once

#include <Eigen/Core>

// The organs as signed distance functions: millimetres, negative inside, all in one abdomen so that they fit together.
// Frame: +x patient's left, +y cranial, +z anterior; origin on the midline in the transpyloric plane (L1), half way
// between back and front.
namespace medulla {

// 90 mm from fundus to neck, 30 wide; fundus, body, infundibulum with Hartmann's pouch, neck, stub of the cystic duct.
double gallbladder(const Eigen::Vector3d& p);

}  // namespace medulla
