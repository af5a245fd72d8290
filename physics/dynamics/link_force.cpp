#include <cstddef>

#include "physics/dynamics/anchor.h"
#include "physics/dynamics/identified_stages.h"
#include "physics/dynamics/link_blocks.h"
#include "physics/dynamics/link_fold.h"
#include "physics/dynamics/link_frame.h"
#include "physics/dynamics/neo_hookean.h"
#include "physics/dynamics/stages.h"

// The elastic link (paper 2.2): six measures of the state q_m, each a smooth function of the two poses, and generalised
// forces k_m (q_m + beta q_m') that return through the exact gradients of the measures. Derivations:
// physics/equations/links.md.
namespace medulla {

namespace {

MEDULLA_INLINE Flexion damped(const Flexion& q, const Flexion& rate, Lanes relaxation) {
  return {fma(relaxation, rate.a, q.a), fma(relaxation, rate.b, q.b)};
}

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

// Derivative of that energy by the twist: d A0 = B0 / 2, d B0 = -A0 / 2, and end 1's the other way round.
MEDULLA_INLINE Lanes bendingTorque(const LinkGroup& l, const Flexion& q0, const Flexion& q1) {
  const Lanes own = (l.flexionV0 - l.flexionU0) * (q0.a * q0.b) - (l.flexionV1 - l.flexionU1) * (q1.a * q1.b);
  return splat(0.5) * l.beam * fma(l.coupleU + l.coupleV, q1.a * q0.b - q0.a * q1.b, own);
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

// False, and nothing is done, where an end bends far and that is not what is asked for: what it takes would cost all
// others a tenth of their time in registers.
template <bool kFar>
MEDULLA_INLINE bool evaluate(const LinkGroup& link, const Spheres& spheres, Quad& unwoundTwist, LinkState& e) {
  e.s0 = gatherSpheres(spheres, link.sphere0, link.restArm0, link.hasArms);
  e.s1 = gatherSpheres(spheres, link.sphere1, link.restArm1, link.hasArms);
  const LinkMeasures& m = e.m = measure(link, e.s0, e.s1, load(unwoundTwist));
  const Lanes far = isFar(m);
  if (!kFar && any(far)) return false;
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
  if (kFar) {
    bendFar(link, m, q0, q1, still0, still1, far, b);
    fold(m.end0, still0, link.flexionU0 + link.flexionV0, b.moments0);
    fold(m.end1, still1, link.flexionU1 + link.flexionV1, b.moments1);
  }
  Lanes3 bend0 = flexionGradient(m.end0, b.moments0), bend1 = flexionGradient(m.end1, b.moments1);
  e.twistMoment = link.torsion * fma(link.relaxation, e.spin1 - e.spin0, m.twist);
  if (link.hasBeams) e.twistMoment = e.twistMoment + bendingTorque(link, b.still0, b.still1);
  if (kFar) fade(link, m, still0, still1, bend0, bend1, e.twistMoment, unwoundTwist);
  const Lanes3 both = bend0 + bend1;
  const Lanes3 across = fnma(dot(both, m.n), m.n, both);
  e.force1 = (splat(0) - tension) * m.n - m.inverseLength * across;
  e.torque0 = cross(m.n, bend0);
  e.torque1 = cross(m.n, bend1);
  return true;
}

template <bool kFar>
[[gnu::noinline]] void evaluateGroup(const LinkGroup& link, const Spheres& spheres, Quad& unwoundTwist, LinkFrame& f) {
  LinkState e;
  if (!evaluate<kFar>(link, spheres, unwoundTwist, e)) return evaluateGroup<true>(link, spheres, unwoundTwist, f);
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
template <bool kFar>
[[gnu::noinline]] void evaluateBareGroup(const LinkGroup& link, const Spheres& spheres, Quad& unwoundTwist,
                                         Slot* slots) {
  LinkState e;
  if (!evaluate<kFar>(link, spheres, unwoundTwist, e))
    return evaluateBareGroup<true>(link, spheres, unwoundTwist, slots);
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

static void evaluateGroups(WorldData& d, const Batch& batch, const std::vector<int>& groups) {
  for (const int g : groups)
    evaluateGroup<false>(d.links.groups[g], d.spheres, d.links.unwoundTwist[g], d.links.frames[g]);
  evaluateIdentifiedLinks(d, batch);
}

void evaluateLinks(WorldData& d, const Batch& batch) {
  evaluateGroups(d, batch, batch.linkGroups);
}

void evaluateHostLinks(WorldData& d, const Batch& batch) {
  evaluateGroups(d, batch, batch.hostLinkGroups);
}

void evaluateFramedLinks(WorldData& d, const Batch& batch) {
  evaluateGroups(d, batch, batch.framedLinkGroups);
}

void evaluateLinkForces(WorldData& d, const Batch& batch) {
  evaluateFramedLinks(d, batch);
  for (const int g : batch.bareLinkGroups)
    evaluateBareGroup<false>(d.links.groups[g], d.spheres, d.links.unwoundTwist[g], &d.links.slots[8 * g]);
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

// J
static Lanes energyOf(const LinkGroup& link, const LinkMeasures& m) {
  const Lanes stretched = m.length - link.restLength, linear = splat(0.5) * stretched * stretched;
  const Lanes bar = link.restLength * link.restLength * neoHookeanEnergy(m.length * link.inverseRestLength);
  return fma(link.elongation, select(isLess(splat(0), link.beam), bar, linear), turningEnergy(link, m));
}

double linkEnergy(const WorldData& d, std::vector<double>* ofBodies) {
  double sum = identifiedLinkEnergy(d, ofBodies);
  std::size_t body = 0;
  for (std::size_t g = 0; g < d.links.groups.size(); ++g) {
    const LinkGroup& link = d.links.groups[g];
    const LinkMeasures m =
        measure(link, gatherSpheres(d.spheres, link.sphere0, link.restArm0, link.hasArms),
                gatherSpheres(d.spheres, link.sphere1, link.restArm1, link.hasArms), load(d.links.unwoundTwist[g]));
    const Lanes energy = energyOf(link, m);
    const int lanes = std::min(4, d.links.count - 4 * static_cast<int>(g));
    for (int lane = 0; lane < lanes; ++lane) {
      sum += energy[lane];
      if (ofBodies == nullptr) continue;
      while (4 * static_cast<int>(g) + lane >= d.ranges[body].firstLink + d.ranges[body].linkCount) ++body;
      (*ofBodies)[body] += energy[lane];
    }
  }
  return sum;
}

}  // namespace medulla
