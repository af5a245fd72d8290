#include <cstddef>

#include "physics/dynamics/angles.h"
#include "physics/dynamics/stages.h"

// The elastic link (paper 2.2): six measures of the state q_m, each a smooth function of the two poses, and generalised
// forces k_m (q_m + beta q_m') that return through the exact gradients of the measures. Derivations: physics/README.md.
namespace medulla {

namespace {

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
};

struct SphereLanes {
  Lanes3 position, velocity, angularVelocity;
  Rotation rotation;
};

MEDULLA_INLINE SphereLanes gatherSpheres(const Spheres& s, const std::uint32_t* i) {
  SphereLanes out;
  out.position = gather(s.position[i[0]], s.position[i[1]], s.position[i[2]], s.position[i[3]]);
  out.velocity = gather(s.velocity[i[0]], s.velocity[i[1]], s.velocity[i[2]], s.velocity[i[3]]);
  out.angularVelocity =
      gather(s.angularVelocity[i[0]], s.angularVelocity[i[1]], s.angularVelocity[i[2]], s.angularVelocity[i[3]]);
  Lanes w;
  const Lanes3 q = gather(s.orientation[i[0]], s.orientation[i[1]], s.orientation[i[2]], s.orientation[i[3]], w);
  out.rotation = rotationOf(q, w);
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
  // Floored where the link is folded back on itself beyond 170 degrees, like the flexion angle.
  const Lanes inverse = splat(1) / larger(splat(1) + cosine, splat(0.5 * kSmallestSine * kSmallestSine));
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
  m.end0 = measureEnd(link, s0.rotation, m.n);
  m.end1 = measureEnd(link, s1.rotation, m.n);
  m.axisU = carry(m.end0, m.end0.u, m.end0.a);
  m.axisV = carry(m.end0, m.end0.v, m.end0.b);
  const Lanes3 far = carry(m.end1, m.end1.u, m.end1.a);
  const Lanes wrapped = angleOf(dot(m.axisU, far), dot(m.axisV, far));
  m.twist = fma(nearest((unwoundTwist - wrapped) * splat(1 / kTurn)), splat(kTurn), wrapped);
  return m;
}

// Flexion: the rotation vector from t to n has components -f b on u and f a on v, f = theta / sin(theta). Their
// gradients with respect to n are f v - b h t and f u - a h t (signs cancel in the energy), h = -df/dcos(theta).
MEDULLA_INLINE Lanes3 flexionGradient(const LinkGroup& link, const LinkEnd& e, const Lanes3& nRate, const Lanes3& omega,
                                      const Lanes3& n) {
  const Lanes3 relative = nRate - cross(omega, n);  // n' as the sphere sees it
  const Lanes alongT = e.angle.slope * dot(e.t, relative);
  const Lanes rateA = e.angle.value * dot(e.u, relative) - e.a * alongT;
  const Lanes rateB = e.angle.value * dot(e.v, relative) - e.b * alongT;
  const Lanes momentA = link.flexionV * fma(link.relaxation, rateA, e.angle.value * e.a);
  const Lanes momentB = link.flexionU * fma(link.relaxation, rateB, e.angle.value * e.b);
  return fnma(e.angle.slope * fma(e.a, momentA, e.b * momentB), e.t,
              fma(e.angle.value * momentA, e.u, (e.angle.value * momentB) * e.v));
}

void evaluateGroup(const LinkGroup& link, const Spheres& spheres, Quad& unwoundTwist, LinkFrame& f) {
  const SphereLanes s0 = gatherSpheres(spheres, link.sphere0), s1 = gatherSpheres(spheres, link.sphere1);
  const LinkMeasures m = measure(link, s0, s1, load(unwoundTwist));
  store(unwoundTwist, m.twist);

  const Lanes3 lineVelocity = s1.velocity - s0.velocity;
  const Lanes lengthRate = dot(m.n, lineVelocity);
  const Lanes3 nRate = m.inverseLength * fnma(lengthRate, m.n, lineVelocity);
  const Lanes spin0 = dot(m.end0.spinAxis, s0.angularVelocity) - dot(m.end0.lever, nRate);
  const Lanes spin1 = dot(m.end1.spinAxis, s1.angularVelocity) - dot(m.end1.lever, nRate);

  const Lanes tension = link.elongation * fma(link.relaxation, lengthRate, m.length - link.restLength);
  const Lanes3 bend0 = flexionGradient(link, m.end0, nRate, s0.angularVelocity, m.n);
  const Lanes3 bend1 = flexionGradient(link, m.end1, nRate, s1.angularVelocity, m.n);
  const Lanes3 bend = bend0 + bend1;
  const Lanes3 across = fnma(dot(bend, m.n), m.n, bend);
  f.force1 = (splat(0) - tension) * m.n - m.inverseLength * across;
  f.torque0 = cross(m.n, bend0);
  f.torque1 = cross(m.n, bend1);
  f.twistMoment = link.torsion * fma(link.relaxation, spin1 - spin0, m.twist);

  f.origin = s0.position;
  f.line = m.line;
  f.originVelocity = s0.velocity;
  f.lineVelocity = lineVelocity;
  f.n = m.n;
  f.axisU = m.axisU;
  f.axisV = m.axisV;
  f.turning = cross(m.n, nRate);
  f.spin0 = spin0;
  f.spinAlong = spin1 - spin0;
  f.twist = m.twist;
  f.inverseLength = m.inverseLength;
  f.spinAxis0 = m.end0.spinAxis;
  f.spinAxis1 = m.end1.spinAxis;
  f.spinLever0 = m.end0.lever;
  f.spinLever1 = m.end1.lever;
  const Lanes zero = splat(0);
  f.loadSum = f.loadAlong = f.loadMoment = {zero, zero, zero};
  f.loadTwist = zero;
}

void storeVectors(const Lanes3& v, Quad& q0, Quad& q1, Quad& q2, Quad& q3) {
  Lanes a = v.x, b = v.y, c = v.z, d = splat(0);
  transpose(a, b, c, d);
  store(q0, a);
  store(q1, b);
  store(q2, c);
  store(q3, d);
}

}  // namespace

void evaluateLinks(WorldData& d) {
  for (std::size_t g = 0; g < d.links.groups.size(); ++g)
    evaluateGroup(d.links.groups[g], d.spheres, d.links.unwoundTwist[g], d.links.frames[g]);
}

// The transpose of the anchors' velocities x' = v0 + s v + (turning + n spin(s)) x r: what a load g at the anchor does
// per unit of each sphere's velocity. Loads are minus the forces on the nodes.
void returnLinkForces(WorldData& d) {
  for (std::size_t g = 0; g < d.links.groups.size(); ++g) {
    const LinkFrame& f = d.links.frames[g];
    const Lanes twistOfNodes = dot(f.n, f.loadMoment);
    const Lanes moment0 = f.twistMoment - (twistOfNodes - f.loadTwist);
    const Lanes moment1 = splat(0) - f.twistMoment - f.loadTwist;
    const Lanes3 swing = cross(f.n, f.loadMoment) - moment0 * f.spinLever0 - moment1 * f.spinLever1;
    const Lanes3 onBoth = fma(f.inverseLength, swing, f.force1);
    const Lanes3 force1 = onBoth - f.loadAlong;
    const Lanes3 force0 = f.loadAlong - f.loadSum - onBoth;
    const Lanes3 torque0 = fma(moment0, f.spinAxis0, f.torque0);
    const Lanes3 torque1 = fma(moment1, f.spinAxis1, f.torque1);
    Slot* s = &d.links.slots[8 * g];
    storeVectors(force0, s[0].force, s[2].force, s[4].force, s[6].force);
    storeVectors(torque0, s[0].torque, s[2].torque, s[4].torque, s[6].torque);
    storeVectors(force1, s[1].force, s[3].force, s[5].force, s[7].force);
    storeVectors(torque1, s[1].torque, s[3].torque, s[5].torque, s[7].torque);
  }
}

double linkEnergy(const WorldData& d) {
  double sum = 0;
  for (int k = 0; k < d.links.count; ++k) {
    const LinkGroup& link = d.links.groups[k / 4];
    const int lane = k % 4;
    const LinkMeasures m = measure(link, gatherSpheres(d.spheres, link.sphere0), gatherSpheres(d.spheres, link.sphere1),
                                   load(d.links.unwoundTwist[k / 4]));
    const Lanes stretch = m.length - link.restLength;
    const auto squared = [](Lanes a) { return a * a; };
    Lanes twice = link.elongation * squared(stretch) + link.torsion * squared(m.twist);
    for (const LinkEnd* e : {&m.end0, &m.end1})
      twice = twice + squared(e->angle.value) * (link.flexionV * squared(e->a) + link.flexionU * squared(e->b));
    sum += 0.5 * twice[lane];
  }
  return sum;
}

}  // namespace medulla
