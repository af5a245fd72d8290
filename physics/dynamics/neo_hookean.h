#pragma once

#include "physics/dynamics/simd.h"

// An incompressible neo-Hookean bar: EA/3 (x - 1/x^2) at the stretch x, of stiffness EA at rest. Shorter than
// kStraightBelow it goes on straight: the law stiffens as 1/x^3 there, and no explicit step would follow.
namespace medulla {

constexpr double kStraightBelow = 0.75;

// Over EA.
MEDULLA_INLINE Lanes neoHookeanTension(Lanes stretch) {
  const Lanes x = larger(stretch, splat(kStraightBelow)), inverse = splat(1) / x;
  constexpr double kSlope = (1 + 2 / (kStraightBelow * kStraightBelow * kStraightBelow)) / 3;
  const Lanes below = splat(kSlope) * (stretch - x);
  return fma(splat(1.0 / 3), fnma(inverse, inverse, x), below);
}

// Of the tension, by the stretch.
MEDULLA_INLINE Lanes neoHookeanSlope(Lanes stretch) {
  const Lanes inverse = splat(1) / larger(stretch, splat(kStraightBelow));
  return splat(1.0 / 3) * fma(splat(2) * inverse, inverse * inverse, splat(1));
}

// Over EA L: the tension's integral from rest.
inline Lanes neoHookeanEnergy(Lanes stretch) {
  const Lanes half = splat(0.5), x = larger(stretch, splat(kStraightBelow)), below = stretch - x;
  const Lanes longer = x - splat(1);
  const Lanes bar = longer * longer * (x + splat(2)) / (x + x);  // x^2 / 2 + 1 / x - 3 / 2, without their rounding
  const Lanes straight = fma(half * neoHookeanSlope(x), below, neoHookeanTension(x));
  return fma(splat(1.0 / 3), bar, straight * below);
}

}  // namespace medulla
