#pragma once

#include "physics/dynamics/angles.h"
#include "physics/dynamics/world_data.h"

// Where the skeleton carries a surface node (paper 2.3), four nodes of one host at a time, and how fast.
namespace medulla {

struct Anchor {
  Lanes3 base, baseVelocity;  // m, m/s: the point of the skeleton
  Lanes3 omega;               // rad/s of the frame that carries the offset
  Lanes3 offset;              // m, from the base to where the node belongs
  Lanes3 area;                // m2, of the surface at rest, carried along
};

inline Lanes3 positionOf(const Anchor& a) {
  return a.base + a.offset;
}
// Of the point fixed to the carrying frame at `lever` from the base.
inline Lanes3 velocityAt(const Anchor& a, const Lanes3& lever) {
  return a.baseVelocity + cross(a.omega, lever);
}

// One link's frame, the same in all lanes.
struct LinkHost {
  Lanes3 origin, line, originVelocity, lineVelocity, n, axisU, axisV, turning;
  Lanes spin0, spinAlong, twist;
  bool isBeam;  // what follows is set
  Lanes thickness, thicknessRate;
  Lanes3 bow, bowVelocity;
  Lanes slopeU, slopeV, slopeUAlong, slopeVAlong, slopeURate, slopeVRate, slopeUAlongRate, slopeVAlongRate;
  Lanes curveU, curveV, curveURate, curveVRate;
};

inline LinkHost linkHost(const WorldData& d, int link) {
  const LinkFrame& f = d.links.frames[link / 4];
  const int lane = link % 4;
  LinkHost h;
  h.origin = splatLane(f.origin, lane);
  h.line = splatLane(f.line, lane);
  h.originVelocity = splatLane(f.originVelocity, lane);
  h.lineVelocity = splatLane(f.lineVelocity, lane);
  h.n = splatLane(f.n, lane);
  h.axisU = splatLane(f.axisU, lane);
  h.axisV = splatLane(f.axisV, lane);
  h.turning = splatLane(f.turning, lane);
  h.spin0 = splat(f.spin0[lane]);
  h.spinAlong = splat(f.spinAlong[lane]);
  h.twist = splat(f.twist[lane]);
  h.isBeam = d.links.groups[link / 4].beam[lane] > 0;
  if (!h.isBeam) return h;
  h.thickness = splat(f.thickness[lane]);
  h.thicknessRate = splat(f.thicknessRate[lane]);
  h.bow = splatLane(f.bow, lane);
  h.bowVelocity = splatLane(f.bowVelocity, lane);
  h.slopeU = splat(f.slopeU[lane]);
  h.slopeV = splat(f.slopeV[lane]);
  h.slopeUAlong = splat(f.slopeUAlong[lane]);
  h.slopeVAlong = splat(f.slopeVAlong[lane]);
  h.slopeURate = splat(f.slopeURate[lane]);
  h.slopeVRate = splat(f.slopeVRate[lane]);
  h.slopeUAlongRate = splat(f.slopeUAlongRate[lane]);
  h.slopeVAlongRate = splat(f.slopeVAlongRate[lane]);
  h.curveU = splat(f.curveU[lane]);
  h.curveV = splat(f.curveV[lane]);
  h.curveURate = splat(f.curveURate[lane]);
  h.curveVRate = splat(f.curveVRate[lane]);
  return h;
}

// A beam's centre line is bowed and its sections lean as those of a bar of constant curvature between the two spheres'
// directions t0 and t1: base += s (1 - s) / 2 bow, and what hangs at (y, z) on U and V moves by -(y, z).slope along n.
// A cubic with the slopes t0 and t1, and the beam's own between shear and flexion, came no nearer to finite elements
// (cylinder's end 0.6 to 0.7 %, along its chords 2.2), and cost more.
inline Lanes bump(const NodeGroup& g) {
  return g.along * fnma(splat(0.5), g.along, splat(0.5));
}

struct Slope {
  Lanes u, v;
};
inline Slope slopeAt(const LinkHost& h, const NodeGroup& g) {
  return {fma(g.along, h.slopeUAlong, h.slopeU), fma(g.along, h.slopeVAlong, h.slopeV)};
}

// Where a bar bends, its sections widen inside of the bend and narrow outside (Saint-Venant): at (y, z) by nu kappa.(y,
// z), the same along both, kappa being the curvature. With o = y + i z and c = nu / 2 (kappaU - i kappaV) that is o + c
// o^2, to first order; o / (1 - c o), which never folds where |c o| < 1, moves with c by the square of itself: rates
// and loads ask for where the node belongs alone.
struct Section {
  Lanes y, z;
};
MEDULLA_INLINE Section curved(const LinkHost& h, Lanes y, Lanes z) {
  const Lanes real = fnma(h.curveU, y, fnma(h.curveV, z, splat(1))), imaginary = fnma(h.curveV, y, h.curveU * z);
  const Lanes scale = splat(1) / fma(real, real, imaginary * imaginary);
  return {scale * fnma(imaginary, z, real * y), scale * fma(imaginary, y, real * z)};
}
// How (y, z) moves where the curve c = u - i v changes by (u, v): a symmetric matrix.
MEDULLA_INLINE Section byCurve(Lanes y, Lanes z, Lanes u, Lanes v) {
  const Lanes a = fnma(z, z, y * y), b = splat(2) * (y * z);
  return {fma(a, u, b * v), fnma(a, v, b * u)};
}

// Velocity of the point of the skeleton, and what changes about the offset, with (y, z) on U and V, otherwise than by
// turning.
MEDULLA_INLINE Lanes3 baseVelocityOf(const LinkHost& h, const NodeGroup& g, const Lanes3& offset, Lanes y, Lanes z) {
  const Lanes3 straight = fma(g.along, h.lineVelocity, h.originVelocity);
  if (!h.isBeam) return straight;
  const Slope slope = slopeAt(h, g);
  const Lanes spin = g.twistShare * h.spinAlong, swirl = spin * (y * slope.v - z * slope.u);
  const Section wider = byCurve(y, z, fma(spin, h.curveV, h.curveURate), fnma(spin, h.curveU, h.curveVRate));
  const Lanes leaning =
      fma(y, fma(g.along, h.slopeUAlongRate, h.slopeURate),
          fma(z, fma(g.along, h.slopeVAlongRate, h.slopeVRate), fma(wider.y, slope.u, fma(wider.z, slope.v, swirl))));
  const Lanes3 across = fma(wider.y, h.axisU, wider.z * h.axisV);
  return fnma(leaning, h.n, fma(bump(g), h.bowVelocity, fma(h.thicknessRate, offset, straight + across)));
}

// The point at `along` of the centre line, slid with its stretch, plus the offset in the frame of sphere 0 carried onto
// the line, twisted by its share of the torsion and as much shorter as a beam is thinner.
MEDULLA_INLINE Anchor anchorOnLink(const LinkHost& h, const NodeGroup& g) {
  Lanes c, s;
  quickCosineSine(g.twistShare * h.twist, c, s);
  Anchor a;
  a.area = fma(g.restArea.x, h.n,
               fma(fnma(g.restArea.z, s, g.restArea.y * c), h.axisU, fma(g.restArea.y, s, g.restArea.z * c) * h.axisV));
  if (h.isBeam) {
    c = c * h.thickness;
    s = s * h.thickness;
  }
  Lanes y = fnma(g.restOffset.z, s, g.restOffset.y * c), z = fma(g.restOffset.y, s, g.restOffset.z * c);
  if (h.isBeam) {
    const Section section = curved(h, y, z);
    y = section.y;
    z = section.z;
  }
  a.base = fma(g.along, h.line, h.origin);
  a.omega = fma(fma(g.twistShare, h.spinAlong, h.spin0), h.n, h.turning);
  a.offset = fma(y, h.axisU, z * h.axisV);
  if (h.isBeam) {
    const Slope slope = slopeAt(h, g);
    a.base = fma(bump(g), h.bow, a.base);
    a.offset = fnma(fma(y, slope.u, z * slope.v), h.n, a.offset);
  }
  a.baseVelocity = baseVelocityOf(h, g, a.offset, y, z);
  return a;
}

inline AnchorLoads noLoads() {
  const Lanes zero = splat(0);
  const Lanes3 none = zeroVectors();
  return {none, none, none, none, zero, zero, zero, zero, zero, zero, zero, zero};
}

// Adds forces on the anchors of four nodes, whose moments about the bases are `turn`: the transpose of the anchors'
// velocities.
MEDULLA_INLINE void addLoads(const LinkHost& h, const NodeGroup& g, const Lanes3& offset, const Lanes3& force,
                             const Lanes3& turn, AnchorLoads& sum) {
  sum.sum = sum.sum + force;
  sum.along = fma(g.along, force, sum.along);
  sum.moment = sum.moment + turn;
  Lanes about = dot(h.n, turn);
  if (h.isBeam) {
    const Slope slope = slopeAt(h, g);
    const Lanes forward = dot(h.n, force), ownY = dot(h.axisU, offset), ownZ = dot(h.axisV, offset);
    const Lanes y = forward * ownY, z = forward * ownZ;
    const Section curve =
        byCurve(ownY, ownZ, fnma(forward, slope.u, dot(h.axisU, force)), fnma(forward, slope.v, dot(h.axisV, force)));
    sum.curveU = sum.curveU + curve.y;
    sum.curveV = sum.curveV + curve.z;
    sum.thickness = sum.thickness + dot(offset, force);
    sum.bow = fma(bump(g), force, sum.bow);
    sum.slopeU = sum.slopeU + y;
    sum.slopeV = sum.slopeV + z;
    sum.slopeUAlong = fma(g.along, y, sum.slopeUAlong);
    sum.slopeVAlong = fma(g.along, z, sum.slopeVAlong);
    about = about - (y * slope.v - z * slope.u) + (h.curveV * curve.y - h.curveU * curve.z);
  }
  sum.twist = fma(g.twistShare, about, sum.twist);
}

// Of one link: the lanes of `sum` are its nodes'.
inline void setLoads(const LinkHost& h, const AnchorLoads& sum, LinkLoads& to) {
  store(to.sumTwist, sumOfLanes(sum.sum, sum.twist));
  store(to.alongThickness, sumOfLanes(sum.along, sum.thickness));
  store(to.momentSlopeU, sumOfLanes(sum.moment, sum.slopeU));
  if (!h.isBeam) return;
  store(to.bowSlopeV, sumOfLanes(sum.bow, sum.slopeV));
  store(to.slopesAlongCurve, sumsOfLanes(sum.slopeUAlong, sum.slopeVAlong, sum.curveU, sum.curveV));
}

// Of four links.
inline AnchorLoads gatherLoads(const LinkLoads* links, bool bend) {
  AnchorLoads out = noLoads();
  const auto gatherAll = [links](Quad LinkLoads::*q, Lanes& fourth) {
    return gather(links[0].*q, links[1].*q, links[2].*q, links[3].*q, fourth);
  };
  out.sum = gatherAll(&LinkLoads::sumTwist, out.twist);
  out.along = gatherAll(&LinkLoads::alongThickness, out.thickness);
  out.moment = gatherAll(&LinkLoads::momentSlopeU, out.slopeU);
  if (!bend) return out;
  out.bow = gatherAll(&LinkLoads::bowSlopeV, out.slopeV);
  const Lanes3 along = gatherAll(&LinkLoads::slopesAlongCurve, out.curveV);
  out.slopeUAlong = along.x;
  out.slopeVAlong = along.y;
  out.curveU = along.z;
  return out;
}

struct SphereHost {
  Lanes3 position, velocity, angularVelocity;
  Rotation rotation;
};

inline SphereHost sphereHost(const WorldData& d, int i) {
  const Spheres& s = d.spheres;
  return {splat(s.position[i]), splat(s.velocity[i]), splat(s.angularVelocity[i]),
          rotationOf(splat(s.orientation[i]), splat(s.orientation[i].v[3]))};
}

inline Anchor anchorOnSphere(const SphereHost& h, const NodeGroup& g) {
  return {h.position, h.velocity, h.angularVelocity, rotate(h.rotation, g.restOffset), rotate(h.rotation, g.restArea)};
}

}  // namespace medulla
