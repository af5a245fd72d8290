#pragma once

#include "physics/dynamics/simd.h"

// Distances between colliders, four pairs at a time. Lanes do not influence each other.
namespace medulla {

// A ball: centre and radius. A cone's two ends are one ball each.
struct BallLanes {
  Lanes3 centre;
  Lanes radius;
};

inline BallLanes gatherBalls(const Quad* ball, std::uint32_t i0, std::uint32_t i1, std::uint32_t i2, std::uint32_t i3) {
  BallLanes b;
  b.centre = gather(ball[i0], ball[i1], ball[i2], ball[i3], b.radius);
  return b;
}

inline Lanes gapOfBalls(const BallLanes& p, const BallLanes& q) {
  const Lanes3 w = q.centre - p.centre;
  return squareRoot(dot(w, w)) - (p.radius + q.radius);
}

struct ConeContact {
  Lanes s, t;  // 0..1 along either cone, of the two balls that come closest
  Lanes gap;   // m, < 0 where they overlap
};

// Two links that lie side by side have no one closest pair. This much of each length squared pulls the answer to the
// middle of both, so that the point of contact moves smoothly when they tilt; the gap comes out too large by no more
// than this times (length0^2 + length1^2) / (8 distance), and by its square only where they cross.
constexpr double kMiddlePull = 3e-3;

// Minimises f(s, t) = |q(t) - p(s)| - r(s) - R(t) over the unit square, where centres and radii vary linearly: convex,
// a norm of something linear less something linear. With D = |q - p| of the last guess, |q - p| <= (|q - p|^2 / D + D)
// / 2 with equality at the guess: the minimum of that bound, a quadratic over the square solved in closed form (Ericson
// 2005, 5.1.9, with the radii's slopes in the linear terms), never raises f. D^2 converges by sin^2 of the cones' half
// angle; contacts start near it, at the mean radii's sum. Exact in one step where radii are equal.
MEDULLA_INLINE ConeContact closestOnCones(const BallLanes& p0, const BallLanes& p1, const BallLanes& q0,
                                          const BallLanes& q1) {
  constexpr int kIterations = 8;
  constexpr double kConverged = 1e-7;  // of D; the gap's error is second order in it
  const Lanes zero = splat(0), one = splat(1), half = splat(0.5), tiny = splat(1e-30);
  const auto clamped = [&](Lanes x) { return smaller(larger(x, zero), one); };
  const Lanes3 d = p1.centre - p0.centre, e = q1.centre - q0.centre, w0 = p0.centre - q0.centre;
  const Lanes slopeP = p1.radius - p0.radius, slopeQ = q1.radius - q0.radius;
  const Lanes dd = dot(d, d), ee = dot(e, e), de = dot(d, e);
  const Lanes pull = splat(kMiddlePull);
  const Lanes a = fma(pull, dd, dd) + tiny, c = fma(pull, ee, ee) + tiny;
  const Lanes determinant = fnma(de, de, a * c);
  const Lanes linear0 = fnma(half * pull, dd, dot(d, w0)), linear1 = fnma(half * pull, ee, zero - dot(e, w0));
  Lanes distance = half * ((p0.radius + p1.radius) + (q0.radius + q1.radius));
  ConeContact out{half, half, zero};
  Lanes open = _mm256_cmp_pd(zero, zero, _CMP_EQ_OQ);
  for (int k = 0; k < kIterations && any(open); ++k) {
    const Lanes f = fnma(distance, slopeP, linear0), g = fnma(distance, slopeQ, linear1);
    Lanes s = clamped((zero - fma(f, c, de * g)) / larger(determinant, tiny));
    const Lanes t = clamped((de * s - g) / c);
    s = clamped((de * t - f) / a);
    const Lanes3 w = fma(s, d, w0) - t * e;
    const Lanes next = squareRoot(dot(w, w));
    out.s = select(open, s, out.s);
    out.t = select(open, t, out.t);
    const Lanes change = magnitude(next - distance);
    distance = select(open, next, distance);
    open = masked(open, isLess(splat(kConverged) * distance, change));
  }
  out.gap = distance - (fma(out.s, slopeP, p0.radius) + fma(out.t, slopeQ, q0.radius));
  return out;
}

}  // namespace medulla
