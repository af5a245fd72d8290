#pragma once

#include "physics/dynamics/link_measures.h"

// What becomes of bending and torsion where an end of a link bends far (beyond kLevelFrom), and of all their energies.
namespace medulla {

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

MEDULLA_INLINE Lanes isFar(const LinkMeasures& m) {
  return isLess(splat(kLevelValue), larger(m.end0.angle.value, m.end1.angle.value));
}

// What of a bent link knows of an axis carried onto the line, torsion and what bending asks of the two ends' twist,
// fades between kFoldAngle and kBlindCosine: at 180 degrees no smallest rotation carries it there, and on the way an
// end's twist moves faster and faster with the line. What is left beyond is the same about any axis.
struct Fade {
  Lanes share, slope;  // at an end, and its derivative by n . t
};
MEDULLA_INLINE Fade fadeAt(Lanes cosine) {
  constexpr double kInverse = 1 / (kFoldCosine - kBlindCosine);
  const Lanes one = splat(1), x = larger(splat(kInverse) * (cosine - splat(kBlindCosine)), splat(0));
  const Lanes in = select(isLess(x, one), x, one);
  return {in * in * fnma(splat(2), in, splat(3)), splat(6 * kInverse) * in * (one - in)};
}

// Into the moments in the lanes `far`. `q` are the flexions that they answer to, with what damps them; `still` those of
// the present pose.
void bendFar(const LinkGroup& l, const LinkMeasures& m, const Flexion& q0, const Flexion& q1, const Flexion& still0,
             const Flexion& still1, Lanes far, Bending& b);
// Fades the twist's moment, and adds to the gradients by n the energy's slope by that: a link that is twisted gives its
// torsion up by folding on. What has faded forgets its turns, since an end that swings past 180 degrees on one side
// would gain one; nodes that hang by the twist then jump by their share of the turn, as they would have been wound up.
void fade(const LinkGroup& l, const LinkMeasures& m, const Flexion& still0, const Flexion& still1, Lanes3& bend0,
          Lanes3& bend1, Lanes& twistMoment, Quad& unwoundTwist);

// Beyond kFoldAngle the mean of the two stiffnesses acts on what is left to 180 degrees instead of on the flexion:
// energy k (g^2 - (a^2 + b^2) / 2) with g = kFoldAngle, in value and slope the same there, k g^2 at 180.
MEDULLA_INLINE void fold(const LinkEnd& e, const Flexion& still, Lanes stiffnesses, Flexion& moments) {
  const Lanes both = masked(e.angle.folded, stiffnesses);
  moments.a = fnma(both, still.a, moments.a);
  moments.b = fnma(both, still.b, moments.b);
}

Lanes turningEnergy(const LinkGroup& l, const LinkMeasures& m);  // J: of flexions and torsion

}  // namespace medulla
