#pragma once

#include <algorithm>

#include "physics/dynamics/neo_hookean.h"
#include "physics/dynamics/simd.h"

// How a bar that is stretched to (1 + y) of its length thins across, to
//   thinness(y) = sqrt(J / (1 + y)),   J(y) = 1 + b y / (1 + k y),   b = 1 - 2 nu,   k = min(b, 2 nu / b),
// where J is its volume. A bar of the neo-Hookean material G/2 (I1 J^(-2/3) - 3) + K/2 (J - 1)^2, that of the
// references in tests/accuracy, has J - 1 = c ((1 + y)^2 - J / (1 + y)) J^(-5/3) with c = b / 2 (1 + nu): from nu = 0.3
// on J is within 0.1 % of it up to y = 0.25 and 0.6 % down to -0.25, at nu = 0.45 within 0.1 % both ways. Where the
// other bound counts, below nu = 0.19, J goes over to 1 + y, since at nu = 0 nothing is known of how a body thins. (1 /
// sqrt(1 + 2 nu y), which agrees to first order, loses 0.4 % of the volume at nu = 0.45 and y = 0.25, 0.6 % at 0.35.)
namespace medulla {

struct Thinning {
  double k = 0, kAndB = 1;       // 1
  double first = 2, second = 1;  // k / nu, and (k / nu (1 + k) - 2 k) / 2
};

inline Thinning thinningOf(double poisson) {  // 0 <= nu < 0.5
  const double b = 1 - 2 * poisson, k = std::min(b, 2 * poisson / b);
  const double first = poisson > 0 ? k / poisson : 2;
  return {k, k + b, first, 0.5 * first * (1 + k) - k};
}

// By how much a line that had length 1 and this direction, `axis`, is longer, and the slope: half by its length, half
// by what lies along the direction. The first takes what is sheared for stretched, the second what turns for shortened.
// The length is straight in its square below kStraightBelow, since lines have no direction where they vanish.
struct PlaceStretch {
  Lanes value;
  Lanes3 slope;
};
MEDULLA_INLINE PlaceStretch stretchOf(const Lanes3& line, const Lanes3& axis) {
  const Lanes half = splat(0.5), square = dot(line, line);
  const Lanes r = squareRoot(larger(square, splat(kStraightBelow * kStraightBelow))), inverse = splat(1) / r;
  const Lanes length = half * fma(square, inverse, r);
  return {fma(half, length + dot(line, axis), splat(-1)), half * fma(inverse, line, axis)};
}

// y - (1 - thinness(y)) / nu, and its slope: what a stretch does less across than in proportion. With D = (1 + k y)
// (1 + y) and r = thinness D they are y - y (2 + first y) / (D + r) and 1 - (1 + first y + second y^2) / (r D).
// Straight below kStraightBelow.
struct Spare {
  Lanes value, slope;
};
MEDULLA_INLINE Spare spareOf(const Thinning& t, Lanes stretch) {
  const Lanes one = splat(1), two = splat(2), k = splat(t.k), first = splat(t.first);
  const Lanes y = larger(stretch, splat(kStraightBelow - 1));
  const Lanes d = fma(k, y, one) * (one + y), r = squareRoot(d * fma(splat(t.kAndB), y, one));
  const Lanes product = r * d, inverse = one / (product * (d + r));
  const Lanes slope = fnma(fma(y, fma(splat(t.second), y, first), one), (d + r) * inverse, one);
  const Lanes value = fnma(y * fma(first, y, two), product * inverse, y);
  return {fma(slope, stretch - y, value), slope};
}

}  // namespace medulla
