#pragma once

#include "physics/dynamics/angles.h"
#include "physics/dynamics/world_data.h"

// What four links measure of their spheres' poses, with rates and gradients: physics/equations/links.md.
namespace medulla {

struct LinkEnd {
  Lanes3 t, u, v;       // rest centre line and section axes carried by the sphere
  Lanes a, b;           // n . u, n . v
  AngleOverSine angle;  // between n and t
  Lanes3 lever;         // t x n / (1 + t . n): how the smallest rotation t -> n twists when n moves
  Lanes3 spinAxis;      // (n + t) / (1 + t . n): how it twists when the sphere turns
};

struct LinkMeasures {
  Lanes3 line, n;
  Lanes length, inverseLength;
  LinkEnd end0, end1;
  Lanes3 axisU, axisV;  // u, v of sphere 0 carried onto n
  Lanes twist;
  Lanes cosine, sine;  // of the twist
};

struct SphereLanes {
  Lanes3 position, velocity;  // of the link's end
  Lanes3 angularVelocity, arm;
  Rotation rotation;
};

MEDULLA_INLINE SphereLanes gatherSpheres(const Spheres& s, const std::uint32_t* i, const Lanes3& restArm,
                                         bool hasArms) {
  SphereLanes out;
  out.position = gather(s.position[i[0]], s.position[i[1]], s.position[i[2]], s.position[i[3]]);
  out.velocity = gather(s.velocity[i[0]], s.velocity[i[1]], s.velocity[i[2]], s.velocity[i[3]]);
  out.angularVelocity =
      gather(s.angularVelocity[i[0]], s.angularVelocity[i[1]], s.angularVelocity[i[2]], s.angularVelocity[i[3]]);
  Lanes w;
  const Lanes3 q = gather(s.orientation[i[0]], s.orientation[i[1]], s.orientation[i[2]], s.orientation[i[3]], w);
  out.rotation = rotationOf(q, w);
  out.arm = restArm;
  if (hasArms) {
    out.arm = rotate(out.rotation, restArm);
    out.position = out.position + out.arm;
    out.velocity = out.velocity + cross(out.angularVelocity, out.arm);
  }
  return out;
}

MEDULLA_INLINE LinkEnd measureEnd(const LinkGroup& link, const Rotation& rotation, const Lanes3& n) {
  LinkEnd e;
  e.t = rotate(rotation, link.restT);
  e.u = rotate(rotation, link.restU);
  e.v = cross(e.t, e.u);
  e.a = dot(n, e.u);
  e.b = dot(n, e.v);
  const Lanes cosine = dot(n, e.t);
  e.angle = angleOverSine(cosine);
  // Floored where the link is folded back on itself beyond 170 degrees, where nothing asks for it any more:
  // link_fold.h.
  const Lanes inverse = splat(1) / larger(splat(1) + cosine, splat(0.015));
  e.lever = inverse * cross(e.t, n);
  e.spinAxis = inverse * (n + e.t);
  return e;
}

// The smallest rotation that takes t to n, applied to an axis perpendicular to t.
MEDULLA_INLINE Lanes3 carry(const LinkEnd& e, const Lanes3& axis, Lanes axisAlongN) {
  return fnma(axisAlongN, e.spinAxis, axis);
}

MEDULLA_INLINE LinkMeasures measure(const LinkGroup& link, const SphereLanes& s0, const SphereLanes& s1,
                                    Lanes unwoundTwist) {
  LinkMeasures m;
  m.line = s1.position - s0.position;
  m.length = squareRoot(dot(m.line, m.line));
  m.inverseLength = splat(1) / larger(m.length, link.smallestLength);
  m.n = m.inverseLength * m.line;
  // Ends that all but meet know no direction; the one that sphere 0 carries takes over, and parts them again.
  if (any(isLess(m.length, link.smallestLength)))
    m.n = fma(larger(fnma(m.length, m.inverseLength, splat(1)), splat(0)), rotate(s0.rotation, link.restT), m.n);
  m.end0 = measureEnd(link, s0.rotation, m.n);
  m.end1 = measureEnd(link, s1.rotation, m.n);
  m.axisU = carry(m.end0, m.end0.u, m.end0.a);
  m.axisV = carry(m.end0, m.end0.v, m.end0.b);
  const Lanes3 far = carry(m.end1, m.end1.u, m.end1.a);
  m.cosine = dot(m.axisU, far);
  m.sine = dot(m.axisV, far);
  const Lanes wrapped = angleOf(m.cosine, m.sine);
  m.twist = fma(nearest((unwoundTwist - wrapped) * splat(1 / kTurn)), splat(kTurn), wrapped);
  return m;
}

// Flexion at an end: the rotation vector from t to n has components -b on u and a on v, a = f n.u, b = f n.v,
// f = theta / sin(theta).
struct Flexion {
  Lanes a, b;
};

MEDULLA_INLINE Flexion flexionOf(const LinkEnd& e) {
  return {e.angle.value * e.a, e.angle.value * e.b};
}

// Their rates are gradients f v - b h t and f u - a h t (signs cancel in the energy) with h = -df/dcos(theta), times n'
// as the sphere sees it.
MEDULLA_INLINE Flexion flexionRate(const LinkEnd& e, const Lanes3& nRate, const Lanes3& omega, const Lanes3& n) {
  const Lanes3 relative = nRate - cross(omega, n);
  const Lanes alongT = e.angle.slope * dot(e.t, relative);
  return {e.angle.value * dot(e.u, relative) - e.a * alongT, e.angle.value * dot(e.v, relative) - e.b * alongT};
}

// Gradient with respect to n of what has the moments `m` as derivatives by a and b.
MEDULLA_INLINE Lanes3 flexionGradient(const LinkEnd& e, const Flexion& m) {
  return fnma(e.angle.slope * fma(e.a, m.a, e.b * m.b), e.t,
              fma(e.angle.value * m.a, e.u, (e.angle.value * m.b) * e.v));
}

// Components of a flexion in axes turned about the line by the angle of this cosine and sine.
MEDULLA_INLINE Flexion turned(const Flexion& q, Lanes cosine, Lanes sine) {
  return {fma(sine, q.b, cosine * q.a), fnma(sine, q.a, cosine * q.b)};
}

}  // namespace medulla
