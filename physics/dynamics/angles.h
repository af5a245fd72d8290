#pragma once

#include <numbers>

#include "physics/dynamics/simd.h"

// Angles from sines and cosines and back, by polynomials: accurate to 1e-15, the same on every machine.
namespace medulla {

// r(x) with asin(sqrt(x)) = sqrt(x) (1 + x r(x)) on 0 <= x <= 1/4. Interpolated at Chebyshev nodes from asin's power
// series in exact arithmetic; error of asin 7e-17.
inline Lanes arcSineRemainder(Lanes x) {
  return polynomial(x, 0.16666666666666646, 0.07500000000022967, 0.04464285709958662, 0.030381947625840226,
                    0.022372038738232097, 0.017355437344723182, 0.013927457312716163, 0.011892875834833392,
                    0.007714874347447517, 0.016311748922541877, -0.011237244215539824, 0.028540834429984487);
}

struct AngleOverSine {
  Lanes value;              // f = theta / sin(theta)
  Lanes slope;              // h = -df/dcos(theta) = (1 - f cos(theta)) / sin(theta)^2
  Lanes folded = splat(0);  // all bits where theta is beyond kFoldAngle
};

// Beyond this angle, 116 degrees, where f sin(theta) has slope 1 and f slope 0 on either side, tan(theta) = -theta, f
// stays what it is: f sin(theta) falls back then as it rose. f itself grows without bound towards 180 degrees, where a
// flexion has no direction, and no explicit step would follow. link_fold.h turns the energy's sign there, so that it
// rises on to 180.
constexpr double kFoldAngle = 2.028757838110434;
constexpr double kFoldCosine = -0.4421205929549983;
constexpr double kFoldValue = 2.261826334114652;  // -1 / kFoldCosine

// Cosine of 150 degrees, beyond which a link knows no twist (link_fold.h).
constexpr double kBlindCosine = -0.8660254037844387;

// 75 degrees, and f there: from here on what both ends of a link share of their flexions levels off (link_fold.cpp).
constexpr double kLevelFrom = 1.3089969389957472;
constexpr double kLevelValue = 1.3551733511720077;

// From cos(theta), theta in 0..180 degrees. With x = sin^2(theta/2), w = cos(theta/2): f = asin(sqrt x) / (sqrt x w),
// and h without cancellation where theta is small: (2 - 1/(1+w) - r (1-2x)) / (4 w^3). Lanes do not influence each
// other.
inline AngleOverSine angleOverSine(Lanes cosine) {
  const Lanes zero = splat(0), one = splat(1), half = splat(0.5), quarter = splat(0.25), two = splat(2);
  const Lanes x = larger(half * (one - cosine), zero);
  const Lanes w = squareRoot(larger(one - x, zero));
  const Lanes isLarge = isLess(quarter, x);  // beyond 60 degrees
  const bool anyLarge = any(isLarge);
  const Lanes xSmall = anyLarge ? select(isLarge, quarter, x) : x;
  const Lanes wSmall = anyLarge ? select(isLarge, one, w) : w;
  const Lanes r = arcSineRemainder(xSmall);
  const Lanes inverse = one / wSmall;
  AngleOverSine out;
  out.value = fma(xSmall, r, one) * inverse;
  out.slope = (two - one / (one + wSmall) - r * fnma(two, xSmall, one)) * (quarter * inverse * inverse * inverse);
  if (!anyLarge) return out;
  // asin(sqrt x) = pi/2 - 2 asin(sqrt y), y = (1 - sqrt x) / 2
  const Lanes root = squareRoot(x);
  const Lanes y = larger(select(isLarge, half * (one - root), zero), zero);
  const Lanes arc = fnma(two * squareRoot(y), fma(y, arcSineRemainder(y), one), splat(std::numbers::pi / 2));
  const Lanes sine = larger(two * root * w, splat(0.5));  // folded ones are selected away below
  const Lanes value = two * arc / sine;
  out.value = select(isLarge, value, out.value);
  out.slope = select(isLarge, fnma(value, cosine, one) / (sine * sine), out.slope);
  out.folded = isLess(cosine, splat(kFoldCosine));
  out.value = select(out.folded, splat(kFoldValue), out.value);
  out.slope = select(out.folded, zero, out.slope);
  return out;
}

// The angle of the unit vector (cosine, sine), -180..180 degrees.
inline Lanes angleOf(Lanes cosine, Lanes sine) {
  const Lanes zero = splat(0), one = splat(1), half = splat(0.5), quarter = splat(0.25), two = splat(2);
  const Lanes x = larger(half * (one - magnitude(cosine)), zero);  // up to 90 degrees, then mirrored
  const Lanes isLarge = isLess(quarter, x);
  const Lanes xSmall = select(isLarge, zero, x);
  Lanes angle = magnitude(sine) * fma(xSmall, arcSineRemainder(xSmall), one) / squareRoot(one - xSmall);
  if (any(isLarge)) {
    const Lanes y = select(isLarge, half * (one - squareRoot(x)), zero);
    const Lanes arc = fnma(two * squareRoot(y), fma(y, arcSineRemainder(y), one), splat(std::numbers::pi / 2));
    angle = select(isLarge, two * arc, angle);
  }
  angle = select(isLess(cosine, zero), splat(std::numbers::pi) - angle, angle);
  return withSignOf(angle, sine);
}

constexpr double kTurn = 2 * std::numbers::pi;

// Up to this angle (rad) the power series below are good to 1e-16 as they stand.
constexpr double kSmallAngle = 0.25;

inline void smallCosineSine(Lanes angle, Lanes& cosine, Lanes& sine) {
  const Lanes q2 = angle * angle;
  const Lanes r = polynomial(q2, -1.0 / 6, 1.0 / 120, -1.0 / 5040, 1.0 / 362880, -1.0 / 39916800);
  sine = fma(r, angle * q2, angle);
  cosine = polynomial(q2, 1.0, -0.5, 1.0 / 24, -1.0 / 720, 1.0 / 40320, -1.0 / 3628800);
}

// Cosine and sine of an angle below 1e9: reduced to half a turn either side, the power series on a quarter of it,
// doubled twice.
[[gnu::noinline]] inline void cosineSine(Lanes angle, Lanes& cosine, Lanes& sine) {
  const Lanes one = splat(1), two = splat(2);
  const Lanes q = splat(0.25) * fnma(nearest(angle * splat(1 / kTurn)), splat(kTurn), angle);
  const Lanes q2 = q * q;
  const Lanes r = polynomial(q2, -1.0 / 6, 1.0 / 120, -1.0 / 5040, 1.0 / 362880, -1.0 / 39916800, 1.0 / 6227020800.0,
                             -1.0 / 1307674368000.0);
  const Lanes s = fma(r * q2, q, q);
  // 1 - cos, which keeps the doubling from losing small angles
  const Lanes versine = polynomial(q2, -0.5, 1.0 / 24, -1.0 / 720, 1.0 / 40320, -1.0 / 3628800, 1.0 / 479001600,
                                   -1.0 / 87178291200.0, 1.0 / 20922789888000.0);
  const Lanes c1 = fma(versine, q2, one);
  const Lanes s2 = two * s * c1, c2 = fnma(two * s, s, one);
  sine = two * s2 * c2;
  cosine = fnma(two * s2, s2, one);
}

// By the short series where all lanes are small, as they mostly are.
MEDULLA_INLINE void quickCosineSine(Lanes angle, Lanes& cosine, Lanes& sine) {
  if (any(isLess(splat(kSmallAngle), magnitude(angle))))
    cosineSine(angle, cosine, sine);
  else
    smallCosineSine(angle, cosine, sine);
}

}  // namespace medulla
