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
  Lanes spin0, spinAlong, twist, thickness, thicknessRate;
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
  h.thickness = splat(f.thickness[lane]);
  h.thicknessRate = splat(f.thicknessRate[lane]);
  return h;
}

// What a link's nodes give it: sums of force and twist share, of force along the link and thickness, of moments.
inline void setLoads(LinkFrame& f, int lane, Lanes sumAndTwist, Lanes alongAndThickness, Lanes moment) {
  const auto set = [lane](Lanes3& to, Lanes from) {
    to.x[lane] = from[0];
    to.y[lane] = from[1];
    to.z[lane] = from[2];
  };
  set(f.loadSum, sumAndTwist);
  set(f.loadAlong, alongAndThickness);
  set(f.loadMoment, moment);
  f.loadTwist[lane] = sumAndTwist[3];
  f.loadThickness[lane] = alongAndThickness[3];
}

// The point at `along` of the centre line, slid with its stretch, plus the offset in the frame of sphere 0 carried onto
// the line, twisted by its share of the torsion and as much shorter as the link is thinner.
inline Anchor anchorOnLink(const LinkHost& h, const NodeGroup& g) {
  Lanes c, s;
  const Lanes angle = g.twistShare * h.twist;
  if (any(isLess(splat(kSmallAngle), magnitude(angle)))) {
    cosineSine(angle, c, s);
  } else {
    smallCosineSine(angle, c, s);
  }
  Anchor a;
  a.area = fma(g.restArea.x, h.n,
               fma(fnma(g.restArea.z, s, g.restArea.y * c), h.axisU, fma(g.restArea.y, s, g.restArea.z * c) * h.axisV));
  c = c * h.thickness;
  s = s * h.thickness;
  a.base = fma(g.along, h.line, h.origin);
  a.omega = fma(fma(g.twistShare, h.spinAlong, h.spin0), h.n, h.turning);
  a.offset =
      fma(fnma(g.restOffset.z, s, g.restOffset.y * c), h.axisU, fma(g.restOffset.y, s, g.restOffset.z * c) * h.axisV);
  a.baseVelocity = fma(h.thicknessRate, a.offset, fma(g.along, h.lineVelocity, h.originVelocity));
  return a;
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
