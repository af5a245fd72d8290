#include "physics/dynamics/angles.h"
#include "physics/dynamics/implicit_stages.h"

// The links' stiffness matrices: G^T K G with the gradients G of their measures and K the stiffnesses between them
// (Gauss and Newton), plus what a tension adds across the line. Both are positive semidefinite at any pose, so that
// nothing has to be projected by eigenvalues; what is left out (moments times second derivatives of the angles, and the
// negative stiffness of a compressed line) vanishes at rest and changes how fast an iteration converges, not to what.
namespace medulla {

namespace {

// Gradient of a measure by the line between the link's ends and by the two spheres' turning about their frames.
struct Row {
  Lanes3 line, turn0, turn1;
};

struct Frame {
  Lanes3 n, arm0, arm1;
  Lanes inverseLength;
};

Row rowOf(const Frame& f, const Lanes3& byLine, const Lanes3& turn0, const Lanes3& turn1) {
  return {byLine, turn0 - cross(f.arm0, byLine), turn1 + cross(f.arm1, byLine)};
}

Row rowByDirection(const Frame& f, const Lanes3& byN, const Lanes3& turn0, const Lanes3& turn1) {
  return rowOf(f, f.inverseLength * fnma(dot(f.n, byN), f.n, byN), turn0, turn1);
}

// d(f n.u) and d(f n.v) by n: link_force.cpp, flexionRate.
struct EndGradients {
  Lanes3 a, b;
};

EndGradients endGradients(const LinkGroup& g, const Spheres& s, const std::uint32_t* i, const Lanes3& n) {
  Lanes w;
  const Lanes3 q = gather(s.orientation[i[0]], s.orientation[i[1]], s.orientation[i[2]], s.orientation[i[3]], w);
  const Rotation r = rotationOf(q, w);
  const Lanes3 t = rotate(r, g.restT), u = rotate(r, g.restU), v = cross(t, u);
  const AngleOverSine angle = angleOverSine(dot(n, t));
  return {fnma(angle.slope * dot(n, u), t, angle.value * u), fnma(angle.slope * dot(n, v), t, angle.value * v)};
}

struct Matrix9 {  // upper triangle, row after row: line, turn0, turn1
  Lanes entry[45];
};

void components(const Row& r, Lanes (&c)[9]) {
  const Lanes3* parts[3] = {&r.line, &r.turn0, &r.turn1};
  for (int k = 0; k < 3; ++k) {
    c[3 * k] = parts[k]->x;
    c[3 * k + 1] = parts[k]->y;
    c[3 * k + 2] = parts[k]->z;
  }
}

void addProduct(Matrix9& m, const Row& left, const Row& right) {
  Lanes a[9], b[9];
  components(left, a);
  components(right, b);
  int e = 0;
  for (int i = 0; i < 9; ++i)
    for (int j = i; j < 9; ++j, ++e) m.entry[e] = fma(a[i], b[j], m.entry[e]);
}

Row scaled(Lanes s, const Row& r) {
  return {s * r.line, s * r.turn0, s * r.turn1};
}
Row combined(Lanes a, const Row& r, Lanes b, const Row& s, Lanes c, const Row& t) {
  const auto sum = [&](const Lanes3& x, const Lanes3& y, const Lanes3& z) { return fma(c, z, fma(b, y, a * x)); };
  return {sum(r.line, s.line, t.line), sum(r.turn0, s.turn0, t.turn0), sum(r.turn1, s.turn1, t.turn1)};
}

// Slope and value of the tension: link_force.cpp.
void elongationLaw(const LinkGroup& g, Lanes length, Lanes& slope, Lanes& tension) {
  const Lanes one = splat(1), third = splat(1.0 / 3);
  const Lanes stretch = length * g.inverseRestLength;
  const Lanes x = larger(stretch, splat(kStraightBelow)), inverse = one / x, inverse2 = inverse * inverse;
  const Lanes hyperSlope = third * fma(splat(2), inverse2 * inverse, one);
  const Lanes hyper = g.restLength * fma(hyperSlope, stretch - x, third * (x - inverse2));
  const Lanes linear = length - g.restLength;
  slope = g.elongation * fma(g.beam, hyperSlope - one, one);
  tension = g.elongation * fma(g.beam, hyper - linear, linear);
}

Matrix9 groupStiffness(const LinkGroup& g, const LinkFrame& f, const Spheres& s, double duration) {
  const Lanes h2 = splat(duration * duration), damped = fma(splat(duration), g.relaxation, h2);
  const Frame frame{f.n, f.arm0, f.arm1, f.inverseLength};
  const Lanes3 none{splat(0), splat(0), splat(0)};
  Lanes slope, tension;
  elongationLaw(g, squareRoot(dot(f.line, f.line)), slope, tension);
  const Row elongation = rowOf(frame, f.n, none, none);
  const Row acrossU = rowOf(frame, f.axisU, none, none), acrossV = rowOf(frame, f.axisV, none, none);
  const EndGradients end0 = endGradients(g, s, g.sphere0, f.n), end1 = endGradients(g, s, g.sphere1, f.n);
  const Row a0 = rowByDirection(frame, end0.a, cross(end0.a, f.n), none);
  const Row b0 = rowByDirection(frame, end0.b, cross(end0.b, f.n), none);
  const Row a1 = rowByDirection(frame, end1.a, none, cross(end1.a, f.n));
  const Row b1 = rowByDirection(frame, end1.b, none, cross(end1.b, f.n));
  const Row twist = rowByDirection(frame, f.spinLever0 - f.spinLever1, splat(-1) * f.spinAxis0, f.spinAxis1);

  // Turned by the twist, a coupling larger than this between unlike stiffnesses would not be positive.
  const Lanes largest = squareRoot(_mm256_min_pd(g.flexionU0 * g.flexionV1, g.flexionV0 * g.flexionU1));
  const Lanes couple = select(isLess(largest, g.couple), largest, g.couple);
  Lanes cosine, sine;
  cosineSine(f.twist, cosine, sine);
  const Lanes ca = damped * (couple * cosine + g.coupleDifference),
              cb = damped * (couple * cosine - g.coupleDifference);
  const Lanes cs = damped * couple * sine;
  Matrix9 m{};
  addProduct(m, elongation, scaled(damped * slope, elongation));
  const Lanes across = h2 * larger(tension, splat(0)) * f.inverseLength;
  addProduct(m, acrossU, scaled(across, acrossU));
  addProduct(m, acrossV, scaled(across, acrossV));
  addProduct(m, a0, combined(damped * g.flexionV0, a0, ca, a1, splat(0) - cs, b1));
  addProduct(m, b0, combined(damped * g.flexionU0, b0, cs, a1, cb, b1));
  addProduct(m, a1, combined(damped * g.flexionV1, a1, ca, a0, cs, b0));
  addProduct(m, b1, combined(damped * g.flexionU1, b1, splat(0) - cs, a0, cb, b0));
  addProduct(m, twist, scaled(damped * g.torsion, twist));
  return m;
}

}  // namespace

void addLinkMatrix(const LinkMatrix& h, ImplicitData& s, std::size_t pair) {
  const auto part = [&h](int i, int j) { return h.block<3, 3>(3 * i, 3 * j); };
  const auto [sphere0, sphere1] = s.pairs[pair];
  Block6& own0 = s.diagonal[sphere0];
  own0.topLeftCorner<3, 3>() += part(0, 0);
  own0.topRightCorner<3, 3>() -= part(0, 1);
  own0.bottomLeftCorner<3, 3>() -= part(1, 0);
  own0.bottomRightCorner<3, 3>() += part(1, 1);
  if (sphere1 < 0) return;
  Block6 &own1 = s.diagonal[sphere1], &beside = s.beside[pair];
  own1.topLeftCorner<3, 3>() += part(0, 0);
  own1.topRightCorner<3, 3>() += part(0, 2);
  own1.bottomLeftCorner<3, 3>() += part(2, 0);
  own1.bottomRightCorner<3, 3>() += part(2, 2);
  beside.topLeftCorner<3, 3>() = -part(0, 0);
  beside.topRightCorner<3, 3>() = -part(0, 2);
  beside.bottomLeftCorner<3, 3>() = part(1, 0);
  beside.bottomRightCorner<3, 3>() = part(1, 2);
}

void addLinkStiffness(const WorldData& d, ImplicitData& s) {
  for (std::size_t group = 0; group < d.links.groups.size(); ++group) {
    const LinkGroup& g = d.links.groups[group];
    const Matrix9 m = groupStiffness(g, d.links.frames[group], d.spheres, s.duration);
    const int end = std::min(4, d.links.count - 4 * static_cast<int>(group));
    for (int lane = 0; lane < end; ++lane) {
      LinkMatrix h;
      int e = 0;
      for (int i = 0; i < 9; ++i)
        for (int j = i; j < 9; ++j, ++e) h(i, j) = h(j, i) = m.entry[e][lane];
      addLinkMatrix(h, s, 4 * group + lane);
    }
  }
  addIdentifiedStiffness(d, s);
}

}  // namespace medulla
