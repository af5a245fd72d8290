#include "assets/shapes/organs.h"
#include "assets/shapes/sdf.h"
#include "assets/shapes/tube.h"

namespace medulla {

using Eigen::Vector3d;

// J shape; tubes flattened front to back. The blends are small where a groove belongs: the angle of His between
// oesophagus and fundus, the pylorus between antrum and duodenum.
double stomach(const Vector3d& p) {
  static const Tube body = makeTube({{86, 78, -55, 34},  // fundus
                                     {91, 60, -50, 41},
                                     {95, 34, -38, 43.5},  // body
                                     {94, 6, -22, 41.5},
                                     {88, -20, -4, 37.5},
                                     {76, -43, 10, 33.5},
                                     {58, -61, 20, 30.5},
                                     {37, -69, 26, 28.5},  // antrum
                                     {17, -68, 28, 26.5},
                                     {1.5, -61, 25.5, 20.5},
                                     {-7.5, -53.5, 19.5, 13.5},
                                     {-11, -49, 13, 10.5}},  // pylorus
                                    2);
  static const Tube duodenum = makeTube({{-11, -49, 13, 10},
                                         {-14, -47, 6, 11},
                                         {-19, -47, -7, 14.5},
                                         {-25, -52, -22, 14},
                                         {-30, -64, -36, 12.8},
                                         {-32, -84, -45, 12.5},
                                         {-32, -112, -48, 12.5}},
                                        2);
  static const Tube oesophagus = makeTube({{17, 108, -66, 9.5},
                                           {22, 92, -64, 9.8},
                                           {29, 76, -60, 10.3},
                                           {39, 61, -55, 12.5},
                                           {52, 46, -48, 18},
                                           {68, 28, -40, 26}},
                                          2);
  const double flattening = 1.15;
  const Vector3d q(p.x(), p.y(), p.z() * flattening);
  double d = smoothMin(tubeDistance(body, q), tubeDistance(oesophagus, q), 10);
  d = smoothMin(d, tubeDistance(duodenum, q), 4);
  // Incisura angularis: the lesser curvature is notched where the body turns into the antrum.
  d = smoothMax(d, -roundCone(q, {42, -27, -60}, {42, -27, 110}, 9, 9), 16);
  return 0.95 * d + 3 * noise(p, 45) + 0.8 * noise(p, 18);
}

}  // namespace medulla
