#include "assets/shapes/organs.h"
#include "assets/shapes/sdf.h"
#include "assets/shapes/tube.h"

namespace medulla {

using Eigen::Vector3d;

// The axis runs from the fundus, at the liver's inferior border, up, back and medially to the hilum. Past the neck it
// turns over into the cystic duct: the S of a real neck, without the spiral folds, which 466 triangles cannot carry.
double gallbladder(const Vector3d& p) {
  static const Tube axis = makeTube({{-61.6, -60, 23, 11},  // fundus
                                     {-60.3, -56, 20.3, 13.2},
                                     {-58.5, -50.5, 16.8, 14.8},
                                     {-55.5, -43, 12, 15.2},  // body
                                     {-52, -35, 6.8, 14.0},
                                     {-48, -27.5, 1.5, 12.2},
                                     {-43.5, -19.5, -4.5, 9.8},  // infundibulum
                                     {-39, -12.5, -10, 7.2},
                                     {-34.5, -7.5, -14, 5.2},  // neck
                                     {-29, -5, -16.5, 4.0},
                                     {-23.5, -6, -18.3, 3.5},  // cystic duct
                                     {-19, -9.5, -19.8, 3.3},
                                     {-16, -14.5, -21, 3.2}},
                                    0.7);
  const double hartmannsPouch = ellipsoid(p, {-41.5, -20, -12}, {7.5, 7.5, 7.5});
  return smoothMin(tubeDistance(axis, p), hartmannsPouch, 7) + 0.5 * noise(p, 17);
}

}  // namespace medulla
