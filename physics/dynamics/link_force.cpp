#include <cstddef>

#include "physics/dynamics/anchor.h"
#include "physics/dynamics/angles.h"
#include "physics/dynamics/identified_stages.h"
#include "physics/dynamics/link_blocks.h"
#include "physics/dynamics/link_frame.h"
#include "physics/dynamics/neo_hookean.h"
#include "physics/dynamics/stages.h"

// The elastic link (paper 2.2): six measures of the state q_m, each a smooth function of the two poses, and generalised
// forces k_m (q_m + beta q_m') that return through the exact gradients of the measures. Derivations:
// physics/equations/links.md.
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
  // Floored where the link is folded back on itself beyond 170 degrees: no smallest rotation is left at 180.
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

MEDULLA_INLINE Lanes isFar(const LinkEnd& e0, const LinkEnd& e1) {
  return isLess(splat(kLevelValue), larger(e0.angle.value, e1.angle.value));
}

MEDULLA_INLINE Flexion damped(const Flexion& q, const Flexion& rate, Lanes relaxation) {
  return {fma(relaxation, rate.a, q.a), fma(relaxation, rate.b, q.b)};
}

// Components of a flexion in axes turned about the line by the angle of this cosine and sine.
MEDULLA_INLINE Flexion turned(const Flexion& q, Lanes cosine, Lanes sine) {
  return {fma(sine, q.b, cosine * q.a), fnma(sine, q.a, cosine * q.b)};
}

// A beam bends in planes that both ends share: in axes midway between theirs, half the twist from either. With A and B
// the flexions' components there
//   energy = 1/2 (kV0 A0^2 + kV1 A1^2) + cV A0 A1 + 1/2 (kU0 B0^2 + kU1 B1^2) + cU B0 B1,
// positive whatever the twist and the same after a whole turn of it. Rejected: each end's own stiffnesses in its own
// axes and the coupling between them, which is negative from some twist on where U and V differ (30 degrees of a flat
// ribbon's link). Springs know no coupling and keep to their ends' axes.
struct Bending {
  Flexion still0, still1;      // in the middle's axes
  Flexion moments0, moments1;  // derivatives of the energy, in the ends' own
};

MEDULLA_INLINE Flexion momentsInMiddle(Lanes ownV, Lanes ownU, const LinkGroup& l, const Flexion& own,
                                       const Flexion& other) {
  return {fma(ownV, own.a, l.coupleV * other.a), fma(ownU, own.b, l.coupleU * other.b)};
}

// `q` are the flexions that the moments answer to, with what damps them; `still` those of the present pose.
MEDULLA_INLINE Bending bend(const LinkGroup& l, Lanes twist, const Flexion& q0, const Flexion& q1,
                            const Flexion& still0, const Flexion& still1) {
  Bending b{still0, still1, {l.flexionV0 * q0.a, l.flexionU0 * q0.b}, {l.flexionV1 * q1.a, l.flexionU1 * q1.b}};
  if (!l.hasBeams) return b;
  Lanes cosine, sine;
  cosineSine(splat(0.5) * l.beam * twist, cosine, sine);
  const Lanes back = splat(0) - sine;
  const Flexion m0 = turned(q0, cosine, sine), m1 = turned(q1, cosine, back);
  b.still0 = turned(still0, cosine, sine);
  b.still1 = turned(still1, cosine, back);
  b.moments0 = turned(momentsInMiddle(l.flexionV0, l.flexionU0, l, m0, m1), cosine, back);
  b.moments1 = turned(momentsInMiddle(l.flexionV1, l.flexionU1, l, m1, m0), cosine, sine);
  return b;
}

// Towards kFoldAngle, from which on flexions fall back as they rose, the coupling and the difference of the two
// stiffnesses see less and less of them: of the length r of (a, b) no more than r - (r - kLevelFrom)^2 / 2 (kFoldAngle
// - kLevelFrom), whose slope is 0 there. Else their moments would jump at the fold, and an end of a bent link that
// comes to rest in such a dent is none that any step settles. A level that fades faster would stiffen links many times.
struct Level {
  Lanes share, slope;  // of a flexion that is seen; what d(seen) has of (q.dq) q besides share dq
};
Level levelOf(const Flexion& still) {
  const Lanes one = splat(1), squared = fma(still.a, still.a, still.b * still.b), length = squareRoot(squared);
  constexpr double kWidth = kFoldAngle - kLevelFrom;
  const Lanes over = larger(length - splat(kLevelFrom), splat(0)), far = isLess(splat(0), over);
  const Lanes safe = select(far, length, one), rise = larger(fnma(splat(1 / kWidth), over, one), splat(0));
  const Lanes share = select(far, fnma(splat(0.5 / kWidth) * over / safe, over, one), one);
  return {share, masked(far, (rise - share) / (safe * safe))};
}

// By what the seen flexion has as derivatives, or, of a change, what is seen of it: the same, being symmetric.
Flexion seenOf(const Level& level, const Flexion& still, const Flexion& x) {
  const Lanes along = level.slope * fma(still.a, x.a, still.b * x.b);
  return {fma(along, still.a, level.share * x.a), fma(along, still.b, level.share * x.b)};
}

// What the coupling and the differences give, in the middle's axes.
Flexion sharedMoments(const LinkGroup& l, Lanes ownV, Lanes ownU, const Flexion& own, const Flexion& other) {
  const Lanes difference = splat(0.5) * (ownV - ownU);
  return {fma(difference, own.a, l.coupleV * other.a), fnma(difference, own.b, l.coupleU * other.b)};
}

struct SharedBending {
  Flexion still0, still1, moments0, moments1;  // in the middle's axes
  Lanes cosine, sine;
};
SharedBending shareBending(const LinkGroup& l, Lanes twist, const Flexion& q0, const Flexion& q1, const Flexion& still0,
                           const Flexion& still1) {
  SharedBending b;
  cosineSine(splat(0.5) * l.beam * twist, b.cosine, b.sine);
  const Lanes back = splat(0) - b.sine;
  b.still0 = turned(still0, b.cosine, b.sine);
  b.still1 = turned(still1, b.cosine, back);
  const Flexion m0 = turned(q0, b.cosine, b.sine), m1 = turned(q1, b.cosine, back);
  b.moments0 = sharedMoments(l, l.flexionV0, l.flexionU0, m0, m1);
  b.moments1 = sharedMoments(l, l.flexionV1, l.flexionU1, m1, m0);
  return b;
}

Flexion scaled(Lanes by, const Flexion& q) {
  return {by * q.a, by * q.b};
}
Flexion sumOf(const Flexion& p, const Flexion& q) {
  return {p.a + q.a, p.b + q.b};
}
Flexion selected(Lanes which, const Flexion& p, const Flexion& q) {
  return {select(which, p.a, q.a), select(which, p.b, q.b)};
}

// Instead of bend(), in the lanes `far`.
[[gnu::noinline]] void bendFar(const LinkGroup& l, Lanes twist, const Flexion& q0, const Flexion& q1,
                               const Flexion& still0, const Flexion& still1, Lanes far, Bending& b) {
  const Level level0 = levelOf(still0), level1 = levelOf(still1);
  const auto seen = [](const Level& level, const Flexion& still, const Flexion& q) {
    return sumOf(scaled(level.share, still), seenOf(level, still, {q.a - still.a, q.b - still.b}));
  };
  const SharedBending shared = shareBending(l, twist, seen(level0, still0, q0), seen(level1, still1, q1),
                                            scaled(level0.share, still0), scaled(level1.share, still1));
  const auto moments = [](const Level& level, const Flexion& still, const Flexion& q, Lanes both, const Flexion& m) {
    return sumOf(scaled(splat(0.5) * both, q), seenOf(level, still, m));
  };
  const Lanes back = splat(0) - shared.sine;
  b.still0 = selected(far, shared.still0, b.still0);
  b.still1 = selected(far, shared.still1, b.still1);
  b.moments0 = selected(
      far, moments(level0, still0, q0, l.flexionU0 + l.flexionV0, turned(shared.moments0, shared.cosine, back)),
      b.moments0);
  b.moments1 = selected(
      far, moments(level1, still1, q1, l.flexionU1 + l.flexionV1, turned(shared.moments1, shared.cosine, shared.sine)),
      b.moments1);
}

// Twice the energy of the flexions.
Lanes bendingEnergy(const LinkGroup& l, Lanes twist, const Flexion& q0, const Flexion& q1) {
  const Flexion seen0 = scaled(levelOf(q0).share, q0), seen1 = scaled(levelOf(q1).share, q1);
  const SharedBending b = shareBending(l, twist, seen0, seen1, seen0, seen1);
  const auto product = [](const Flexion& p, const Flexion& q) { return fma(p.a, q.a, p.b * q.b); };
  const Lanes own = fma(l.flexionU0 + l.flexionV0, product(q0, q0), (l.flexionU1 + l.flexionV1) * product(q1, q1));
  return fma(splat(0.5), own, product(b.still0, b.moments0) + product(b.still1, b.moments1));
}

// Derivative of that energy by the twist: d A0 = B0 / 2, d B0 = -A0 / 2, and end 1's the other way round.
MEDULLA_INLINE Lanes bendingTorque(const LinkGroup& l, const Flexion& q0, const Flexion& q1) {
  const Lanes own = (l.flexionV0 - l.flexionU0) * (q0.a * q0.b) - (l.flexionV1 - l.flexionU1) * (q1.a * q1.b);
  return splat(0.5) * l.beam * fma(l.coupleU + l.coupleV, q1.a * q0.b - q0.a * q1.b, own);
}

// Beyond kFoldAngle the mean of the two stiffnesses acts on what is left to 180 degrees instead of on the flexion:
// energy k (g^2 - (a^2 + b^2) / 2) with g = kFoldAngle, in value and slope the same there, k g^2 at 180.
MEDULLA_INLINE void fold(const LinkEnd& e, const Flexion& still, Lanes stiffnesses, Flexion& moments) {
  const Lanes both = masked(e.angle.folded, stiffnesses);
  moments.a = fnma(both, still.a, moments.a);
  moments.b = fnma(both, still.b, moments.b);
}
double foldEnergy(const LinkEnd& e, const Flexion& still, Lanes stiffnesses, int lane) {
  const double squared = still.a[lane] * still.a[lane] + still.b[lane] * still.b[lane];
  const Lanes both = masked(e.angle.folded, stiffnesses);
  return 0.5 * both[lane] * (kFoldAngle * kFoldAngle - squared);
}

// What hangs on the link thins so that the area across it goes by 1 / (1 + 2 nu (x - 1)) at the stretch x: Poisson's
// ratio at rest, and constant volume at any stretch for nu = 1/2. x^-nu, which differs by 0.1 % of the thickness at 25
// %, would need a logarithm and an exponential.
MEDULLA_INLINE void thin(const LinkGroup& link, Lanes length, Lanes lengthRate, LinkFrame& f) {
  const Lanes inverseArea = splat(1) / fma(link.thinning, fma(length, link.inverseRestLength, splat(-1)), splat(1));
  f.thickness = squareRoot(inverseArea);
  f.thicknessSlope = splat(-0.5) * link.thinning * link.inverseRestLength * inverseArea;
  f.thicknessRate = f.thicknessSlope * lengthRate;
}

struct LinkState {
  SphereLanes s0, s1;
  LinkMeasures m;
  Lanes3 lineVelocity, nRate;
  Lanes lengthRate, spin0, spin1;
  Lanes3 force1, torque0, torque1;  // as LinkFrame's
  Lanes twistMoment;
};

MEDULLA_INLINE void evaluate(const LinkGroup& link, const Spheres& spheres, Quad& unwoundTwist, LinkState& e) {
  e.s0 = gatherSpheres(spheres, link.sphere0, link.restArm0, link.hasArms);
  e.s1 = gatherSpheres(spheres, link.sphere1, link.restArm1, link.hasArms);
  const LinkMeasures& m = e.m = measure(link, e.s0, e.s1, load(unwoundTwist));
  store(unwoundTwist, m.twist);

  e.lineVelocity = e.s1.velocity - e.s0.velocity;
  e.lengthRate = dot(m.n, e.lineVelocity);
  e.nRate = m.inverseLength * fnma(e.lengthRate, m.n, e.lineVelocity);
  e.spin0 = dot(m.end0.spinAxis, e.s0.angularVelocity) - dot(m.end0.lever, e.nRate);
  e.spin1 = dot(m.end1.spinAxis, e.s1.angularVelocity) - dot(m.end1.lever, e.nRate);

  Lanes stretched = m.length - link.restLength;
  if (link.hasBeams) {
    const Lanes hyper = link.restLength * neoHookeanTension(m.length * link.inverseRestLength);
    stretched = fma(link.beam, hyper - stretched, stretched);
  }
  const Lanes tension = link.elongation * fma(link.relaxation, e.lengthRate, stretched);
  const Flexion still0 = flexionOf(m.end0), still1 = flexionOf(m.end1);
  const Flexion q0 = damped(still0, flexionRate(m.end0, e.nRate, e.s0.angularVelocity, m.n), link.relaxation);
  const Flexion q1 = damped(still1, flexionRate(m.end1, e.nRate, e.s1.angularVelocity, m.n), link.relaxation);
  Bending b = bend(link, m.twist, q0, q1, still0, still1);
  const Lanes far = isFar(m.end0, m.end1);
  if (any(far)) bendFar(link, m.twist, q0, q1, still0, still1, far, b);
  fold(m.end0, still0, link.flexionU0 + link.flexionV0, b.moments0);
  fold(m.end1, still1, link.flexionU1 + link.flexionV1, b.moments1);
  const Lanes3 bend0 = flexionGradient(m.end0, b.moments0), bend1 = flexionGradient(m.end1, b.moments1);
  const Lanes3 both = bend0 + bend1;
  const Lanes3 across = fnma(dot(both, m.n), m.n, both);
  e.force1 = (splat(0) - tension) * m.n - m.inverseLength * across;
  e.torque0 = cross(m.n, bend0);
  e.torque1 = cross(m.n, bend1);
  e.twistMoment = link.torsion * fma(link.relaxation, e.spin1 - e.spin0, m.twist);
  if (link.hasBeams) e.twistMoment = e.twistMoment + bendingTorque(link, b.still0, b.still1);
}

void evaluateGroup(const LinkGroup& link, const Spheres& spheres, Quad& unwoundTwist, LinkFrame& f) {
  LinkState e;
  evaluate(link, spheres, unwoundTwist, e);
  const LinkMeasures& m = e.m;
  put(e.force1, f.force1);
  put(e.torque0, f.torque0);
  put(e.torque1, f.torque1);
  f.twistMoment = e.twistMoment;
  put(e.s0.arm, f.arm0);
  put(e.s1.arm, f.arm1);
  put(e.s0.position, f.origin);
  put(m.line, f.line);
  put(e.s0.velocity, f.originVelocity);
  put(e.lineVelocity, f.lineVelocity);
  put(m.n, f.n);
  put(m.axisU, f.axisU);
  put(m.axisV, f.axisV);
  put(cross(m.n, e.nRate), f.turning);
  f.spin0 = e.spin0;
  f.spinAlong = e.spin1 - e.spin0;
  f.twist = m.twist;
  f.inverseLength = m.inverseLength;
  put(m.end0.spinAxis, f.spinAxis0);
  put(m.end1.spinAxis, f.spinAxis1);
  put(m.end0.lever, f.spinLever0);
  put(m.end1.lever, f.spinLever1);
  if (link.hasBeams) {
    thin(link, m.length, e.lengthRate, f);
    put(m.end0.t, f.t0);
    put(m.end1.t, f.t1);
    setBend(link, f);
    setBendRates(link, e.s0.angularVelocity, e.s1.angularVelocity, e.lengthRate, f);
  }
}

// The forces on four links' spheres: `own` at the ends and on the spheres, less what the anchors' loads take.
MEDULLA_INLINE void giveToSpheres(const LinkGroup& link, const Lanes3& ownForce1, const Lanes3& ownTorque0,
                                  const Lanes3& ownTorque1, const EndLoads& nodes, const Lanes3& arm0,
                                  const Lanes3& arm1, Slot* s) {
  const Lanes3 force1 = ownForce1 - nodes.force1;
  const Lanes3 force0 = splat(-1) * (ownForce1 + nodes.force0);
  Lanes3 torque0 = ownTorque0 - nodes.torque0;
  Lanes3 torque1 = ownTorque1 - nodes.torque1;
  if (link.hasArms) {
    torque0 = torque0 + cross(arm0, force0);
    torque1 = torque1 + cross(arm1, force1);
  }
  const Lanes none = splat(0);
  scatter(force0, none, s[0].force, s[2].force, s[4].force, s[6].force);
  scatter(torque0, none, s[0].torque, s[2].torque, s[4].torque, s[6].torque);
  scatter(force1, none, s[1].force, s[3].force, s[5].force, s[7].force);
  scatter(torque1, none, s[1].torque, s[3].torque, s[5].torque, s[7].torque);
}

// Links on which nothing hangs that moves by itself: their frames, 2.5 kB for four, are nobody's business. To the bit
// what endLoads() makes of the torsion alone.
void evaluateBareGroup(const LinkGroup& link, const Spheres& spheres, Quad& unwoundTwist, Slot* slots) {
  LinkState e;
  evaluate(link, spheres, unwoundTwist, e);
  const Lanes zero = splat(0), spin0 = zero - e.twistMoment, spin1 = e.twistMoment;
  const Lanes3 none = zeroVectors();
  EndLoads twisting;
  twisting.force1 = e.m.inverseLength * (none - spin0 * e.m.end0.lever - spin1 * e.m.end1.lever);
  twisting.force0 = none - twisting.force1;
  twisting.torque0 = spin0 * e.m.end0.spinAxis;
  twisting.torque1 = spin1 * e.m.end1.spinAxis;
  giveToSpheres(link, e.force1, e.torque0, e.torque1, twisting, e.s0.arm, e.s1.arm, slots);
}

}  // namespace

void evaluateLinks(WorldData& d, const Batch& batch) {
  for (const int g : batch.linkGroups)
    evaluateGroup(d.links.groups[g], d.spheres, d.links.unwoundTwist[g], d.links.frames[g]);
  evaluateIdentifiedLinks(d, batch);
}

void evaluateLinkForces(WorldData& d, const Batch& batch) {
  for (const int g : batch.framedLinkGroups)
    evaluateGroup(d.links.groups[g], d.spheres, d.links.unwoundTwist[g], d.links.frames[g]);
  for (const int g : batch.bareLinkGroups)
    evaluateBareGroup(d.links.groups[g], d.spheres, d.links.unwoundTwist[g], &d.links.slots[8 * g]);
  evaluateIdentifiedLinks(d, batch);
}

// Loads are minus the forces on the nodes; torsion turns the frame's two spins apart, as a load does.
void returnLinkForces(WorldData& d, const Batch& batch) {
  for (const int g : batch.framedLinkGroups) {
    const LinkFrame& f = d.links.frames[g];
    const LinkGroup& link = d.links.groups[g];
    AnchorLoads loads = gatherLoads(&d.links.loads[4 * g], link.hasBeams);
    loads.twist = loads.twist + f.twistMoment;
    giveToSpheres(link, f.force1, f.torque0, f.torque1, endLoads(link, f, loads), f.arm0, f.arm1,
                  &d.links.slots[8 * g]);
  }
  returnFrameForces(d, batch);
}

LinkPose poseOfLinks(const WorldData& d, std::size_t group) {
  const LinkGroup& link = d.links.groups[group];
  const SphereLanes s0 = gatherSpheres(d.spheres, link.sphere0, link.restArm0, link.hasArms);
  const SphereLanes s1 = gatherSpheres(d.spheres, link.sphere1, link.restArm1, link.hasArms);
  const LinkMeasures m = measure(link, s0, s1, load(d.links.unwoundTwist[group]));
  return {m.line,          m.n,          s0.arm,       s1.arm,  m.end0.spinAxis,
          m.end1.spinAxis, m.end0.lever, m.end1.lever, m.twist, m.inverseLength};
}

// J, of the link in one lane.
static double energyOf(const LinkGroup& link, const LinkMeasures& m, const Flexion& q0, const Flexion& q1, Lanes twice,
                       int lane) {
  const double rest = link.restLength[lane], length = m.length[lane], linear = 0.5 * (length - rest) * (length - rest);
  return 0.5 * twice[lane] + foldEnergy(m.end0, q0, link.flexionU0 + link.flexionV0, lane) +
         foldEnergy(m.end1, q1, link.flexionU1 + link.flexionV1, lane) +
         link.elongation[lane] * (link.beam[lane] > 0 ? rest * rest * neoHookeanEnergy(length / rest) : linear);
}

double linkEnergy(const WorldData& d, std::vector<double>* ofBodies) {
  double sum = identifiedLinkEnergy(d, ofBodies);
  std::size_t body = 0;
  for (std::size_t g = 0; g < d.links.groups.size(); ++g) {
    const LinkGroup& link = d.links.groups[g];
    const LinkMeasures m =
        measure(link, gatherSpheres(d.spheres, link.sphere0, link.restArm0, link.hasArms),
                gatherSpheres(d.spheres, link.sphere1, link.restArm1, link.hasArms), load(d.links.unwoundTwist[g]));
    const Flexion q0 = flexionOf(m.end0), q1 = flexionOf(m.end1);
    const Lanes twice = bendingEnergy(link, m.twist, q0, q1) + link.torsion * m.twist * m.twist;
    const int lanes = std::min(4, d.links.count - 4 * static_cast<int>(g));
    for (int lane = 0; lane < lanes; ++lane) {
      const double own = energyOf(link, m, q0, q1, twice, lane);
      sum += own;
      if (ofBodies == nullptr) continue;
      while (4 * static_cast<int>(g) + lane >= d.ranges[body].firstLink + d.ranges[body].linkCount) ++body;
      (*ofBodies)[body] += own;
    }
  }
  return sum;
}

}  // namespace medulla
