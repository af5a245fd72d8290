#include "physics/dynamics/link_fold.h"

namespace medulla {

namespace {

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

Lanes shareLeft(const LinkMeasures& m) {
  return fadeAt(dot(m.n, m.end0.t)).share * fadeAt(dot(m.n, m.end1.t)).share;
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

Lanes product(const Flexion& p, const Flexion& q) {
  return fma(p.a, q.a, p.b * q.b);
}

// Twice the energy that fades.
Lanes fadingEnergy(const LinkGroup& l, Lanes twist, const Flexion& q0, const Flexion& q1) {
  const Flexion seen0 = scaled(levelOf(q0).share, q0), seen1 = scaled(levelOf(q1).share, q1);
  const SharedBending b = shareBending(l, twist, seen0, seen1, seen0, seen1);
  return fma(l.torsion * twist, twist, product(b.still0, b.moments0) + product(b.still1, b.moments1));
}

// Twice the energy that fold() takes part in.
Lanes foldEnergy(const LinkEnd& e, const Flexion& still, Lanes stiffnesses) {
  const Lanes all = splat(kFoldAngle * kFoldAngle) - product(still, still);
  return masked(e.angle.folded, stiffnesses) * all;
}

}  // namespace

void bendFar(const LinkGroup& l, const LinkMeasures& m, const Flexion& q0, const Flexion& q1, const Flexion& still0,
             const Flexion& still1, Lanes far, Bending& b) {
  const Lanes left = shareLeft(m);
  const Level level0 = levelOf(still0), level1 = levelOf(still1);
  const auto seen = [](const Level& level, const Flexion& still, const Flexion& q) {
    return sumOf(scaled(level.share, still), seenOf(level, still, {q.a - still.a, q.b - still.b}));
  };
  const SharedBending shared = shareBending(l, m.twist, seen(level0, still0, q0), seen(level1, still1, q1),
                                            scaled(level0.share, still0), scaled(level1.share, still1));
  const auto moments = [&](const Level& level, const Flexion& still, const Flexion& q, Lanes both,
                           const Flexion& ofShared) {
    return sumOf(scaled(splat(0.5) * both, q), seenOf(level, still, scaled(left, ofShared)));
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

void fade(const LinkGroup& l, const LinkMeasures& m, const Flexion& still0, const Flexion& still1, Lanes3& bend0,
          Lanes3& bend1, Lanes& twistMoment, Quad& unwoundTwist) {
  const Fade f0 = fadeAt(dot(m.n, m.end0.t)), f1 = fadeAt(dot(m.n, m.end1.t));
  const Lanes energy = splat(0.5) * fadingEnergy(l, m.twist, still0, still1);
  bend0 = fma(energy * f0.slope * f1.share, m.end0.t, bend0);
  bend1 = fma(energy * f1.slope * f0.share, m.end1.t, bend1);
  const Lanes left = f0.share * f1.share, turns = nearest(m.twist * splat(1 / kTurn));
  twistMoment = left * twistMoment;
  store(unwoundTwist, select(isLess(splat(0), left), m.twist, fnma(turns, splat(kTurn), m.twist)));
}

Lanes turningEnergy(const LinkGroup& l, const LinkMeasures& m) {
  const Flexion q0 = flexionOf(m.end0), q1 = flexionOf(m.end1);
  const Lanes both0 = l.flexionU0 + l.flexionV0, both1 = l.flexionU1 + l.flexionV1;
  const Lanes own = fma(both0, product(q0, q0), both1 * product(q1, q1));
  const Lanes folded = foldEnergy(m.end0, q0, both0) + foldEnergy(m.end1, q1, both1);
  return splat(0.5) * (fma(splat(0.5), own, shareLeft(m) * fadingEnergy(l, m.twist, q0, q1)) + folded);
}

}  // namespace medulla
