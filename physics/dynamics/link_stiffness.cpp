#include "physics/dynamics/implicit_stages.h"
#include "physics/dynamics/link_blocks.h"
#include "physics/dynamics/link_fold.h"
#include "physics/dynamics/neo_hookean.h"

// The links' stiffness matrices: G^T K G with the gradients G of their measures and K the stiffnesses between them
// (Gauss and Newton), plus what a tension adds across the line. Both are positive semidefinite at any pose, so that
// nothing has to be projected by eigenvalues, but for a compressed line, which takes stiffness away: that belongs to
// the derivative near a solution, and is left out of a matrix that has to be definite. Near the fold the coupling alone
// sees less of the flexions, and beyond it fades with the torsion. What is left out always, moments times second
// derivatives of the angles, vanishes at rest and changes how fast an iteration converges, not to what. Tried: all of
// them to first order in the angles; assembling them takes the time that they spare.
namespace medulla {

namespace {

// Gradient by the line of what has the gradient `byN` by its direction.
MEDULLA_INLINE Lanes3 lineGradient(const LinkPose& f, const Lanes3& byN) {
  return f.inverseLength * fnma(dot(f.n, byN), f.n, byN);
}

// d(f n.u) and d(f n.v) by n: link_measures.h, flexionRate.
struct EndGradients {
  Lanes3 a, b;
  Lanes left;  // of torsion and coupling: link_fold.h, Fade
  Lanes seen;  // of a change of the flexion's length, by the coupling: link_fold.cpp, Level
};

EndGradients endGradients(const LinkGroup& g, const Spheres& s, const std::uint32_t* i, const Lanes3& n) {
  Lanes w;
  const Lanes3 q = gather(s.orientation[i[0]], s.orientation[i[1]], s.orientation[i[2]], s.orientation[i[3]], w);
  const Rotation r = rotationOf(q, w);
  const Lanes3 t = rotate(r, g.restT), u = rotate(r, g.restU), v = cross(t, u);
  const Lanes cosine = dot(n, t);
  const AngleOverSine angle = angleOverSine(cosine);
  const Lanes along = dot(n, u), across = dot(n, v), one = splat(1);
  const Lanes length = angle.value * squareRoot(fma(along, along, across * across));
  constexpr double kWidth = kFoldAngle - kLevelFrom;
  const Lanes over = larger(length - splat(kLevelFrom), splat(0));
  return {fnma(angle.slope * along, t, angle.value * u), fnma(angle.slope * across, t, angle.value * v),
          fadeAt(cosine).share, larger(fnma(splat(1 / kWidth), over, one), splat(0))};
}

// Gradients of an end's two flexions: by the line, and by the turning of its own sphere.
struct EndRows {
  Lanes3 lineA, lineB, turnA, turnB;
  Lanes left, seen;
};

MEDULLA_INLINE EndRows endRows(const LinkGroup& g, const Spheres& s, const std::uint32_t* i, const LinkPose& f) {
  const EndGradients e = endGradients(g, s, i, f.n);
  return {lineGradient(f, e.a), lineGradient(f, e.b), cross(e.a, f.n), cross(e.b, f.n), e.left, e.seen};
}

// Slope and value of the tension, as in link_force.cpp: the bar's share of it is the beam's.
void elongationLaw(const LinkGroup& g, Lanes length, Lanes& slope, Lanes& tension) {
  const Lanes stretch = length * g.inverseRestLength, linear = length - g.restLength;
  slope = g.elongation * fma(g.beam, neoHookeanSlope(stretch) - splat(1), splat(1));
  tension = g.elongation * fma(g.beam, g.restLength * neoHookeanTension(stretch) - linear, linear);
}

// In axes turned about the line: link_measures.h, `turned`.
MEDULLA_INLINE EndRows turned(const EndRows& e, Lanes cosine, Lanes sine) {
  const auto a = [&](const Lanes3& ofA, const Lanes3& ofB) { return fma(sine, ofB, cosine * ofA); };
  const auto b = [&](const Lanes3& ofA, const Lanes3& ofB) { return fnma(sine, ofA, cosine * ofB); };
  return {a(e.lineA, e.lineB), b(e.lineA, e.lineB), a(e.turnA, e.turnB), b(e.turnA, e.turnB), e.left, e.seen};
}

// What flexions and torsion add.
MEDULLA_INLINE void addTurning(const LinkGroup& g, const LinkPose& f, const Spheres& s, Lanes damped, LinkBlocks& m) {
  Lanes cosine, sine;  // of half the twist: a beam's ends bend in axes midway between theirs
  cosineSine(splat(0.5) * g.beam * f.twist, cosine, sine);
  const EndRows e0 = turned(endRows(g, s, g.sphere0, f), cosine, sine),
                e1 = turned(endRows(g, s, g.sphere1, f), cosine, splat(0) - sine);
  const Lanes a0 = damped * g.flexionV0, b0 = damped * g.flexionU0, a1 = damped * g.flexionV1,
              b1 = damped * g.flexionU1, left = damped * (e0.left * e1.left), twist = left * g.torsion,
              seen = left * (e0.seen * e1.seen), ca = seen * g.coupleV, cb = seen * g.coupleU;
  const Lanes3 ofA0 = fma(ca, e1.lineA, a0 * e0.lineA), ofB0 = fma(cb, e1.lineB, b0 * e0.lineB);
  const Lanes3 ofA1 = fma(ca, e0.lineA, a1 * e1.lineA), ofB1 = fma(cb, e0.lineB, b1 * e1.lineB);
  const Lanes3 lineTwist = lineGradient(f, f.spinLever0 - f.spinLever1), ofTwist = twist * lineTwist;
  const Lanes3 spin0 = splat(-1) * f.spinAxis0;
  addOuter(e0.lineA, ofA0, m.line);
  addOuter(e0.lineB, ofB0, m.line);
  addOuter(e1.lineA, ofA1, m.line);
  addOuter(e1.lineB, ofB1, m.line);
  addOuter(lineTwist, ofTwist, m.line);
  addOuter(ofA0, e0.turnA, m.line0);
  addOuter(ofB0, e0.turnB, m.line0);
  addOuter(ofTwist, spin0, m.line0);
  addOuter(ofA1, e1.turnA, m.line1);
  addOuter(ofB1, e1.turnB, m.line1);
  addOuter(ofTwist, f.spinAxis1, m.line1);
  addOuter(a0 * e0.turnA, e0.turnA, m.turn0);
  addOuter(b0 * e0.turnB, e0.turnB, m.turn0);
  addOuter(twist * spin0, spin0, m.turn0);
  addOuter(a1 * e1.turnA, e1.turnA, m.turn1);
  addOuter(b1 * e1.turnB, e1.turnB, m.turn1);
  addOuter(twist * f.spinAxis1, f.spinAxis1, m.turn1);
  addOuter(ca * e0.turnA, e1.turnA, m.between);
  addOuter(cb * e0.turnB, e1.turnB, m.between);
  addOuter(twist * spin0, f.spinAxis1, m.between);
}

// The ends lie on arms, so that turning moves them: turn0 += line x arm0, turn1 += arm1 x line in every gradient.
MEDULLA_INLINE void addArms(const LinkPose& f, LinkBlocks& m) {
  const Lanes3 back1 = splat(-1) * f.arm1;
  const Matrix3Lanes from0 = transposed(m.line0), from1 = transposed(m.line1);
  m.line0 = m.line0 + rowsCrossed(m.line, f.arm0);
  m.line1 = m.line1 + rowsCrossed(m.line, back1);
  m.turn0 = m.turn0 + rowsCrossed(from0, f.arm0) + transposed(rowsCrossed(transposed(m.line0), f.arm0));
  m.turn1 = m.turn1 + rowsCrossed(from1, back1) + transposed(rowsCrossed(transposed(m.line1), back1));
  m.between = m.between + rowsCrossed(from0, back1) + transposed(rowsCrossed(transposed(m.line1), f.arm0));
}

// Of the elongation, whose damper goes by its stiffness at rest, and of a tension across the line.
MEDULLA_INLINE Matrix3Lanes lineStiffness(const LinkGroup& g, const LinkPose& f, Lanes damped, Lanes h2,
                                          bool definite) {
  Lanes slope, tension;
  elongationLaw(g, squareRoot(dot(f.line, f.line)), slope, tension);
  const Lanes across = h2 * (definite ? larger(tension, splat(0)) : tension) * f.inverseLength;
  Matrix3Lanes m = zeroMatrix();
  m.row[0].x = m.row[1].y = m.row[2].z = across;
  addOuter((fma(h2, slope, (damped - h2) * g.elongation) - across) * f.n, f.n, m);
  return m;
}

void setStiffness(const LinkGroup& g, const LinkPose& f, const Spheres& s, double duration, bool definite,
                  LinkBlocks& m) {
  const Lanes h2 = splat(duration * duration), damped = fma(splat(duration), g.relaxation, h2);
  m.line = lineStiffness(g, f, damped, h2, definite);
  m.line0 = m.line1 = m.turn0 = m.between = m.turn1 = zeroMatrix();
  addTurning(g, f, s, damped, m);
  if (g.hasArms) addArms(f, m);
}

// Where a lane's blocks belong; none in a lane that fills up a group.
struct LinkTargets {
  Block6 *own0[4] = {}, *own1[4] = {}, *beside[4] = {};
};

void addTo(Block6* const (&blocks)[4], const Matrix3Lanes& line, const Matrix3Lanes& lineTurn,
           const Matrix3Lanes& turn) {
  visitBlocks(line, lineTurn, transposed(lineTurn), turn, [&](int lane, int k, Lanes quad) {
    if (blocks[lane] == nullptr) return;
    double* to = blocks[lane]->data() + 4 * k;
    _mm256_storeu_pd(to, _mm256_loadu_pd(to) + quad);
  });
}

}  // namespace

void addLinkBlocks(const LinkBlocks& m, const int (&pair)[4], ImplicitData& s) {
  LinkTargets to;
  for (int lane = 0; lane < 4; ++lane) {
    if (pair[lane] < 0) continue;
    const auto [sphere0, sphere1] = s.pairs[pair[lane]];
    to.own0[lane] = &s.diagonal[sphere0];
    if (sphere1 < 0) continue;
    to.own1[lane] = &s.diagonal[sphere1];
    to.beside[lane] = &s.beside[pair[lane]];
  }
  // The line goes from sphere 0 to sphere 1.
  addTo(to.own0, m.line, -m.line0, m.turn0);
  addTo(to.own1, m.line, m.line1, m.turn1);
  visitBlocks(-m.line, -m.line1, transposed(m.line0), m.between, [&](int lane, int k, Lanes quad) {
    if (to.beside[lane] != nullptr) _mm256_storeu_pd(to.beside[lane]->data() + 4 * k, quad);
  });
}

void addLinkStiffness(const WorldData& d, ImplicitData& s, bool definite) {
  for (std::size_t group = 0; group < d.links.groups.size(); ++group) {
    LinkBlocks m;
    setStiffness(d.links.groups[group], poseOfLinks(d, group), d.spheres, s.duration, definite, m);
    int pair[4];
    for (int lane = 0; lane < 4; ++lane) {
      const int link = 4 * static_cast<int>(group) + lane;
      pair[lane] = link < d.links.count ? link : -1;
    }
    addLinkBlocks(m, pair, s);
  }
  addIdentifiedStiffness(d, s);
}

}  // namespace medulla
