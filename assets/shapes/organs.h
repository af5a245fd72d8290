#pragma once

#include <Eigen/Core>

// The organs as signed distance functions: millimetres, negative inside, all in one abdomen so that they fit together.
// Frame: +x patient's left, +y cranial, +z anterior; origin on the midline in the transpyloric plane (L1), half way
// between back and front.
namespace medulla {

// 93 mm long, 30 wide, 40 ml; fundus, body, infundibulum with Hartmann's pouch, neck, stub of the cystic duct.
double gallbladder(const Eigen::Vector3d& p);

// Big right and thin left lobe, 215 x 165 x 105 mm: sharp inferior border with the falciform notch; on the visceral
// side gallbladder fossa, quadrate and caudate lobe, porta hepatis, groove of the vena cava, impressions of its
// neighbours.
double liver(const Eigen::Vector3d& p);

// Moderately filled: stub of the oesophagus, fundus, body, incisura, antrum, pylorus, first and second part of the
// duodenum.
double stomach(const Eigen::Vector3d& p);

// Caecum with the appendix to the upper rectum: haustra between three taeniae.
double colon(const Eigen::Vector3d& p);

// Jejunum and ileum as one coil within the colon's frame.
double smallIntestine(const Eigen::Vector3d& p);

// Greater omentum: a bed of fat lobules below and behind the others.
double fat(const Eigen::Vector3d& p);

// The insufflated cavity that holds everything, camera included; its surface is the abdominal wall seen from inside.
double cavity(const Eigen::Vector3d& p);

// A bottlenose dolphin, 2.5 m, in a frame of its own: +x towards the snout, +y dorsal, +z its right; origin half way
// along it. `finRim` is half the thickness of the fins' rims in mm: thin for the picture, thicker where few triangles
// have to carry it. `mouth`: of the crease between the lips, mm; for the picture as wide as vertices 15 mm apart can
// follow, or it would be a row of blotches.
struct DolphinMouth {
  double halfWidth, depth;
};
double dolphin(const Eigen::Vector3d& p, double finRim, const DolphinMouth& mouth);

}  // namespace medulla
