#pragma once

#include "physics/dynamics/frame_turn.h"
#include "physics/dynamics/neo_hookean.h"
#include "physics/dynamics/world_data.h"

// The measures of four identified links (physics/model/identified_network.h), their rates and, transposed, what
// generalised forces on them do to the frames. All in the frame half way between the two. Derivations:
// physics/equations/links.md.
namespace medulla {

// (1 - sin h / h) / h^2 as a function of h^2, and its derivative: power series, good to 1e-15 up to the 116 degrees of
// kFoldAngle.
MEDULLA_INLINE ArcSeries arcSeries(Lanes x) {
  return {polynomial(x, 1.0 / 6, -1.0 / 120, 1.0 / 5040, -1.0 / 362880, 1.0 / 39916800, -1.0 / 6227020800.0,
                     1.0 / 1307674368000.0, -1.0 / 355687428096000.0, 1.0 / 121645100408832000.0,
                     -1.0 / 51090942171709440000.0, 1.0 / 25852016738884976640000.0),
          polynomial(x, -1.0 / 120, 2.0 / 5040, -3.0 / 362880, 4.0 / 39916800, -5.0 / 6227020800.0,
                     6.0 / 1307674368000.0, -7.0 / 355687428096000.0, 8.0 / 121645100408832000.0,
                     -9.0 / 51090942171709440000.0, 10.0 / 25852016738884976640000.0)};
}

// What large flexion does to the measures, by its bounded square: see LinkBending.
MEDULLA_INLINE Lanes measureFlexion(const IdentifiedLinkGroup& link, LinkTurn& m) {
  const Lanes one = splat(1);
  put(fnma(dot(m.w, link.along), link.along, m.w), m.flexed);
  const Lanes square = dot(m.flexed, m.flexed), kept = one / fma(link.bound, square, one);
  m.byFlexion = kept * kept;
  return square * kept;
}

// The measure whose square is the energy of a neo-Hookean bar, (x - 1) sqrt((x + 2) / 3x) at the stretch x, and its
// slope; straight below kStraightBelow. `longer` (m) of the elongation is what bending alone makes.
MEDULLA_INLINE void measureElongation(const IdentifiedLinkGroup& link, Lanes longer, LinkTurn& m) {
  const Lanes one = splat(1);
  const Lanes stretch = fma(m.along - longer, link.inverseRestLength, one), x = larger(stretch, splat(kStraightBelow));
  const Lanes inverse = one / x;
  const Lanes g = squareRoot(fma(splat(2.0 / 3), inverse, splat(1.0 / 3)));
  m.slope = g - (x - one) * inverse * inverse / (splat(3) * g);
  m.hyper = link.restLength * fma(m.slope, stretch - x, g * (x - one));
}

MEDULLA_INLINE LinkTurn measureLink(const IdentifiedLinkGroup& link, const FrameLanes& frame0,
                                    const FrameLanes& frame1) {
  const Lanes one = splat(1);
  LinkTurn m;
  const RelativeTurn r = turnBetween(frame0.q, frame0.w, frame1.q, frame1.w);
  put(r.v, m.v);
  const AngleOverSine angle = angleOverSine(r.cosine);
  m.f = angle.value;
  // Floored where the frames are turned against each other by more than 346 degrees: nothing lies half way at 360.
  m.inverseWider = one / larger(one + r.cosine, splat(0.015));
  m.stretch = fnma(m.f, m.inverseWider, angle.slope);
  put((splat(2) * m.f) * m.v, m.w);
  const Lanes share = squareRoot(splat(0.5) * m.inverseWider);
  m.middle = rotationOf(share * (frame0.q + frame1.q), share * (frame0.w + frame1.w));
  put(rotateBack(m.middle, frame1.position - frame0.position), m.place);
  const Lanes x = m.f * m.f * dot(m.v, m.v);  // h^2
  m.series = arcSeries(x);
  m.bent = dot(m.w, link.restLine);
  put(fma(splat(0.25) * m.series.value * m.bent, m.w, fnma(x, m.series.value, one) * link.restLine), m.arc);
  put(m.place - m.arc, m.t);
  m.along = dot(m.t, link.along);
  const Lanes bending = measureFlexion(link, m);
  m.softer = link.softening * bending;
  measureElongation(link, link.lengthening * bending, m);
  return m;
}

// Elongation by its neo-Hookean measure, flexion softened.
MEDULLA_INLINE LinkMeasures6 measuresOf(const IdentifiedLinkGroup& link, const LinkTurn& m) {
  return {fma(m.hyper - m.along, link.along, m.t), fnma(m.softer, m.flexed, m.w)};
}

struct LinkRates {
  Lanes3 t, w;  // m/s, rad/s
};

// From the frames' velocities and angular velocities, seen in the middle frame: those of frame 1 less those of frame 0,
// and the mean of the angular ones.
MEDULLA_INLINE LinkRates ratesOf(const IdentifiedLinkGroup& link, const LinkTurn& m, const Lanes3& velocity,
                                 const Lanes3& spin, const Lanes3& meanSpin) {
  LinkRates out;
  put(fma(m.stretch * dot(m.v, spin), m.v, m.f * spin), out.w);
  const Lanes3 middle = fnma(splat(0.5) * m.inverseWider, cross(m.v, spin), meanSpin);
  // (S d)' with x = w.w / 4, value P and slope P' by x: d (-(P + x P') x') + (P' x' bent w + P (w'.d w + bent w')) / 4
  const Lanes quarter = splat(0.25), x = quarter * dot(m.w, m.w), xRate = splat(0.5) * dot(m.w, out.w);
  const Lanes3& d = link.restLine;
  const Lanes along = fma(m.series.slope * xRate, m.bent, m.series.value * dot(out.w, d));
  const Lanes3 arc = fma(quarter * along, m.w, (quarter * m.series.value * m.bent) * out.w) -
                     (xRate * fma(x, m.series.slope, m.series.value)) * d;
  put(velocity - cross(middle, m.place) - arc, out.t);
  return out;
}

// From the rates of t and w to those of the measures: with a the axis, f = w across it and b = b(f^2) the bounded
// square, a.t' becomes slope (a.t' - 2 lengthening b' f.w'), and f' becomes f' (1 - softening b) - 2 softening b'
// (f.w') f.
MEDULLA_INLINE LinkRates measuredRates(const IdentifiedLinkGroup& link, const LinkTurn& m, const LinkRates& r) {
  const Lanes bending = splat(2) * m.byFlexion * dot(m.flexed, r.w), along = dot(r.t, link.along);
  const Lanes measured = m.slope * fnma(link.lengthening, bending, along);
  const Lanes3 across = fnma(dot(r.w, link.along), link.along, r.w);
  return {fma(measured - along, link.along, r.t),
          fnma(m.softer, across, fnma(link.softening * bending, m.flexed, r.w))};
}

// The transpose: from forces on the measures to those on t and w.
MEDULLA_INLINE LinkRates forcesOnTurn(const IdentifiedLinkGroup& link, const LinkTurn& m, const LinkMeasures6& on) {
  const Lanes pull = dot(on.t, link.along), measured = m.slope * pull;
  const Lanes3 across = fnma(dot(on.w, link.along), link.along, on.w);
  const Lanes bending = splat(2) * m.byFlexion * fma(link.softening, dot(m.flexed, on.w), link.lengthening * measured);
  return {fma(measured - pull, link.along, on.t), fnma(m.softer, across, fnma(bending, m.flexed, on.w))};
}

struct FrameLoads {
  Lanes3 force1;            // N on frame 1, minus that on frame 0
  Lanes3 torque0, torque1;  // N m
};

// Forces on the measures t and w to loads on the frames, all in the middle frame: the transpose of the rates.
MEDULLA_INLINE FrameLoads loadsOf(const IdentifiedLinkGroup& link, const LinkTurn& m, const Lanes3& onT,
                                  const Lanes3& onW) {
  const Lanes quarter = splat(0.25), half = splat(0.5), x = quarter * dot(m.w, m.w);
  const Lanes3& d = link.restLine;
  const Lanes across = dot(d, onT), along = dot(m.w, onT);
  const Lanes byX =
      fma(quarter * m.series.slope * m.bent, along, splat(0) - fma(x, m.series.slope, m.series.value) * across);
  const Lanes3 arc = fma(half * byX, m.w, (quarter * m.series.value) * fma(along, d, m.bent * onT));
  const Lanes3 turning = onW - arc;
  const Lanes3 middle = cross(onT, m.place);  // on the middle frame's turning
  Lanes3 apart = fma(m.stretch * dot(m.v, turning), m.v, m.f * turning);
  // middle . (-v x D / 2(1 + c)) = D . (v x middle) / 2(1 + c)
  apart = fma(half * m.inverseWider, cross(m.v, middle), apart);
  return {onT, half * middle - apart, fma(half, middle, apart)};
}

// Row i of a symmetric matrix of which the upper triangle is stored.
constexpr int entryOf(int i, int j) {
  return i <= j ? i * (11 - i) / 2 + j : j * (11 - j) / 2 + i;
}

// K m, with m = (a, lengthScale b).
MEDULLA_INLINE void stiffnessTimes(const IdentifiedLinkGroup& link, const Lanes3& a, const Lanes3& b, Lanes3& onA,
                                   Lanes3& onB) {
  const Lanes3 scaled = link.lengthScale * b;
  const Lanes m[6] = {a.x, a.y, a.z, scaled.x, scaled.y, scaled.z};
  Lanes out[6];
  for (int i = 0; i < 6; ++i) {
    Lanes sum = link.stiffness[entryOf(i, 0)] * m[0];
    for (int j = 1; j < 6; ++j) sum = fma(link.stiffness[entryOf(i, j)], m[j], sum);
    out[i] = sum;
  }
  put({out[0], out[1], out[2]}, onA);
  put(link.lengthScale * Lanes3{out[3], out[4], out[5]}, onB);
}

// strain . m, of the six numbers of a cell's strain.
MEDULLA_INLINE Lanes strainOf(const Lanes (&strain)[6], const IdentifiedLinkGroup& link, const LinkMeasures6& m) {
  const Lanes turning = dot({strain[3], strain[4], strain[5]}, m.w);
  return fma(link.lengthScale, turning, dot({strain[0], strain[1], strain[2]}, m.t));
}
MEDULLA_INLINE void addStrains(const IdentifiedLinkGroup& link, const LinkMeasures6& m, double* strains) {
  const Lanes of0 = strainOf(link.strain0, link, m), of1 = strainOf(link.strain1, link, m);
  for (int l = 0; l < 4; ++l) {
    strains[link.frame0[l]] += of0[l];
    strains[link.frame1[l]] += of1[l];
  }
}

}  // namespace medulla
