#include "assets/shapes/organs.h"
#include "assets/shapes/sdf.h"
#include "assets/shapes/tube.h"

namespace medulla {

using Eigen::Vector3d;

// J shape; a tube flattened front to back. The small blend towards the duodenum keeps the groove of the pylorus.
double stomach(const Vector3d& p) {
  static const Tube body = makeTube({{84, 66, -74, 37},  // fundus
                                     {89, 48, -66, 43},
                                     {93, 22, -46, 44},  // body
                                     {92, -4, -22, 42},
                                     {84, -30, 1, 39},
                                     {66, -52, 17, 35},
                                     {42, -63, 27, 30.5},  // antrum
                                     {20, -65, 29, 26},
                                     {4, -60, 26, 20.5},
                                     {-7, -53, 19, 13.5},
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
  const double flattening = 1.15;
  const Vector3d q(p.x(), p.y(), p.z() * flattening);
  return 0.95 * smoothMin(tubeDistance(body, q), tubeDistance(duodenum, q), 4) + 4 * noise(p, 45) + 1.2 * noise(p, 18);
}

}  // namespace medulla
