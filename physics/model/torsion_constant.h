#pragma once

#include <Eigen/Core>
#include <vector>

namespace medulla {

// Part of a plane region: all between `low` and `high` on a strip of height `step` about the line v = `across`. Metres.
struct SectionSpan {
  double low, high, across, step;
};

// Saint-Venant's torsion constant of the region that the spans make up, m4: the least of

//     J = integral (w_u - v)^2 + (w_v + u)^2 dA

// over all warpings w, taken over harmonic polynomials of degree 6, the real and imaginary parts of z^k, which
// compact sections' warpings are made of: never too soft, exact for ellipses and equilateral triangles, within half a
// percent for squares, rectangles of up to 1 to 5 and half discs (Timoshenko and Goodier 1970, sections 105 to 109);
// thin angles come out twice, thin half rings three times too stiff. `centroid` and `radius`, the root of the polar
// moment over the area, keep the powers of order one.
double torsionConstant(const std::vector<SectionSpan>& spans, const Eigen::Vector2d& centroid, double radius);

}  // namespace medulla
