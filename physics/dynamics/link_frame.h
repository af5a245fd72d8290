#pragma once

#include "physics/dynamics/world_data.h"

// How the frames of four links, which carry surface nodes (anchor.h), follow their spheres' motion, and the transpose.
namespace medulla {

// Slopes of the ends, the bow between them and the curve of sections, of which a node that hangs `widest` / 2 from a
// link that is not stretched sees no more than 1/2, however far the link is folded: t0, t1, n, U, V, the line and the
// thickness are set.
MEDULLA_INLINE void setBend(const LinkGroup& g, LinkFrame& f) {
  f.slopeU = g.beam * dot(f.t0, f.axisU);
  f.slopeV = g.beam * dot(f.t0, f.axisV);
  f.slopeUAlong = g.beam * dot(f.t1, f.axisU) - f.slopeU;
  f.slopeVAlong = g.beam * dot(f.t1, f.axisV) - f.slopeV;
  const Lanes length = dot(f.n, f.line);
  put((splat(0) - length) * fma(f.slopeUAlong, f.axisU, f.slopeVAlong * f.axisV), f.bow);
  const Lanes u = g.curving * f.slopeUAlong, v = g.curving * f.slopeVAlong, widest = g.widest * g.widest;
  f.curveEase = g.curving / (f.thickness * squareRoot(fma(widest, fma(u, u, v * v), splat(1))));
  f.curveU = f.curveEase * f.slopeUAlong;
  f.curveV = f.curveEase * f.slopeVAlong;
}

// The curve's derivative by the slopes' increase, which is symmetric, times (u, v).
struct Curve {
  Lanes u, v;
};
MEDULLA_INLINE Curve easedCurve(const LinkGroup& g, const LinkFrame& f, Lanes u, Lanes v) {
  const Lanes wide = g.widest * f.thickness, less = (wide * wide) * fma(f.curveU, u, f.curveV * v);
  return {f.curveEase * fnma(less, f.curveU, u), f.curveEase * fnma(less, f.curveV, v)};
}

// Their rates: U and V turn with the frame of sphere 0 carried onto the line, whose turning and spin0 are set. m/s,
// rad/s.
MEDULLA_INLINE void setBendRates(const LinkGroup& g, const Lanes3& omega0, const Lanes3& omega1, Lanes lengthRate,
                                 LinkFrame& f) {
  const Lanes3 frame = fma(f.spin0, f.n, f.turning);
  const Lanes3 rate0 = cross(omega0 - frame, f.t0), rate1 = cross(omega1 - frame, f.t1);
  f.slopeURate = g.beam * dot(f.axisU, rate0);
  f.slopeVRate = g.beam * dot(f.axisV, rate0);
  f.slopeUAlongRate = g.beam * dot(f.axisU, rate1) - f.slopeURate;
  f.slopeVAlongRate = g.beam * dot(f.axisV, rate1) - f.slopeVRate;
  const Curve curve = easedCurve(g, f, f.slopeUAlongRate, f.slopeVAlongRate);
  f.curveURate = curve.u;
  f.curveVRate = curve.v;
  const Lanes length = dot(f.n, f.line);
  const Lanes3 bowing = (splat(0) - length) * fma(f.slopeUAlongRate, f.axisU, f.slopeVAlongRate * f.axisV);
  put(bowing + fma(lengthRate * f.inverseLength, f.bow, cross(frame, f.bow)), f.bowVelocity);
}

struct EndLoads {
  Lanes3 force0, torque0, force1, torque1;  // N at the link's ends, N m
};

// What loads on a link's anchors do to its ends and spheres: the transpose of the rates above and of the anchors'
// velocities. Arms from the spheres' frames to the ends are the caller's.
MEDULLA_INLINE EndLoads endLoads(const LinkGroup& g, const LinkFrame& f, const AnchorLoads& loads) {
  Lanes3 moment = loads.moment, lean0 = zeroVectors(), lean1 = lean0;
  Lanes stretching = splat(0);
  if (g.hasBeams) {
    const Lanes length = dot(f.n, f.line);
    const Lanes bowU = length * dot(loads.bow, f.axisU), bowV = length * dot(loads.bow, f.axisV);
    const Curve curve = easedCurve(g, f, loads.curveU, loads.curveV);
    const Lanes alongU = bowU + loads.slopeUAlong - curve.u, alongV = bowV + loads.slopeVAlong - curve.v;
    const Lanes u0 = alongU - loads.slopeU, v0 = alongV - loads.slopeV;
    const Lanes u1 = splat(0) - alongU, v1 = splat(0) - alongV;
    lean0 = g.beam * cross(f.t0, fma(u0, f.axisU, v0 * f.axisV));
    lean1 = g.beam * cross(f.t1, fma(u1, f.axisU, v1 * f.axisV));
    moment = moment + cross(f.bow, loads.bow) - lean0 - lean1;
    stretching = fma(f.inverseLength, dot(loads.bow, f.bow), f.thicknessSlope * loads.thickness);
  }
  const Lanes spin0 = dot(f.n, moment) - loads.twist, spin1 = loads.twist;
  const Lanes3 byDirection = cross(moment, f.n) - spin0 * f.spinLever0 - spin1 * f.spinLever1;
  EndLoads out;
  out.force1 = loads.along + fma(f.inverseLength, byDirection, stretching * f.n);
  out.force0 = loads.sum - out.force1;
  out.torque0 = fma(spin0, f.spinAxis0, lean0);
  out.torque1 = fma(spin1, f.spinAxis1, lean1);
  return out;
}

// The same on the spheres' frames.
MEDULLA_INLINE EndLoads sphereLoads(const LinkGroup& g, const LinkFrame& f, const AnchorLoads& loads) {
  EndLoads out = endLoads(g, f, loads);
  out.torque0 = out.torque0 + cross(f.arm0, out.force0);
  out.torque1 = out.torque1 + cross(f.arm1, out.force1);
  return out;
}

}  // namespace medulla
