#pragma once

#include <Eigen/Core>

// The organs as signed distance functions: millimetres, negative inside, all in one abdomen so that they fit together.
// Frame: +x patient's left, +y cranial, +z anterior; origin on the midline in the transpyloric plane (L1), half way
// between back and front.
namespace medulla {

// 93 mm long, 30 wide, 40 ml; fundus, body, infundibulum with Hartmann's pouch, neck, stub of the cystic duct.
double gallbladder(const Eigen::Vector3d& p);

// Both lobes, as a laparoscope sees them: sharp inferior border, falciform fissure, gallbladder fossa. The upper and
// rear sides are plain.
double liver(const Eigen::Vector3d& p);

// Moderately filled: fundus, body, antrum, pylorus, first and second part of the duodenum.
double stomach(const Eigen::Vector3d& p);

// Greater omentum: a bed of fat lobules below and behind the others.
double fat(const Eigen::Vector3d& p);

// The insufflated cavity that holds everything, camera included; its surface is the abdominal wall seen from inside.
double cavity(const Eigen::Vector3d& p);

}  // namespace medulla
