#include <algorithm>
#include <cmath>

#include "assets/shapes/organs.h"
#include "assets/shapes/sdf.h"
#include "assets/shapes/tube.h"

namespace medulla {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Sacculations in three rows between three taeniae, flatter towards the rectum, none at the ends and none where the
// bend is about as tight as the tube. Millimetres to add to the radius.
static double haustra(const TubePlace& place, double length) {
  const double spacing = 42, root = std::sqrt(3.0) / 2;
  const double ends = smoothStep(4, 30, place.along) * (1 - smoothStep(length - 32, length - 6, place.along));
  const double fading = 1 - 0.5 * smoothStep(0.62 * length, 0.95 * length, place.along);
  const double bends = 1 - smoothStep(0.45, 0.85, place.curvature * place.radius);
  double bulge = 0, taenia = 0;
  for (int row = 0; row < 3; ++row) {
    const Vector2d middle = row == 0 ? Vector2d(1, 0) : Vector2d(-0.5, row == 1 ? root : -root);
    const double cosine = place.side.dot(middle);
    const double turns = place.along / spacing + row / 3.0;
    const double fromFold = 1 - std::abs(2 * (turns - std::floor(turns)) - 1);  // 0 at the folds, 1 half way
    bulge += smoothStep(0.4, 0.9, cosine) * std::sqrt(fromFold * (2 - fromFold) + 0.1);
    const double aside = place.radius * (middle.x() * place.side.y() - middle.y() * place.side.x()) / 5;
    const double band = std::max(1 - aside * aside, 0.0);
    if (cosine < 0) taenia += band * band;
  }
  return ends * bends * fading * place.radius * (0.36 * bulge - 0.2) + 2.2 * ends * taenia;
}

double colon(const Vector3d& p) {
  static const Tube axis =
      makeTube({{-98, -207, 20, 22},     {-103, -193, 16, 31},   {-111, -171, 2, 32},   {-119, -146, -22, 27},
                {-122, -122, -37, 24.5}, {-118, -99, -42, 23.5}, {-107, -84, -36, 23},  {-95, -79, -20, 23},
                {-84, -86, -2, 23},      {-73, -100, 14, 23.5},  {-58, -113, 28, 24},   {-30, -124, 40, 24},
                {0, -126, 45, 24},       {38, -122, 43, 23},     {80, -106, 32, 22},    {114, -84, 16, 21},
                {136, -58, 0, 20},       {146, -34, -8, 18.5},   {150, -12, -18, 17.5}, {151, 0, -44, 17},
                {150, -12, -70, 17},     {148, -34, -80, 17.5},  {144, -62, -76, 17.5}, {138, -96, -58, 17},
                {126, -136, -36, 17},    {113, -178, -20, 17},   {96, -207, -4, 17.5},  {76, -222, 9, 18},
                {55, -225, 17, 18},      {37, -232, 13, 18},     {25, -247, 0, 18},     {15, -266, -20, 18},
                {3, -288, -44, 19}},
               2.4);
  static const Tube appendix =
      makeTube({{-90, -208, 10, 6.5}, {-81, -219, 4, 5.5}, {-71, -229, 5, 5}, {-64, -241, 8, 5}, {-64, -253, 7, 5}}, 1);
  const double far = tubeDistance(axis, p);
  if (far > 30) return std::min(far - 8, tubeDistance(appendix, p));  // the details cannot matter
  double d = 0.85 * (far - haustra(tubePlace(axis, p), axis.along.back()));
  d = smoothMin(d, tubeDistance(appendix, p), 5);
  return d > 12 ? d : smoothMax(d, 1 - stomach(p), 6);  // the greater curvature rests on the transverse colon
}

}  // namespace medulla
