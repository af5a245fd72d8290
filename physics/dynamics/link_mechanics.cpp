#include "physics/dynamics/link_mechanics.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "physics/model/disjoint_sets.h"
#include "physics/model/mesh_topology.h"
#include "physics/model/symmetric_eigen.h"

namespace medulla {

namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// A node on the rim of the held surface, and half of the rim beside it, m.
struct RimNode {
  int node;
  double length;
};
using Rims = std::vector<std::vector<RimNode>>;

// The edges at which triangles that are held by all their corners end, by what of them hangs together.
Rims rimsOfFixed(const BodyDescription& body) {
  const SoftBodyModel& m = *body.model;
  std::vector<char> fixed(m.restNodes.size(), 0);
  for (const int node : body.fixedNodes) fixed[node] = 1;
  std::map<std::array<int, 2>, int> heldTriangles;  // per edge
  for (const auto& [a, b, c] : m.triangles)
    if (fixed[a] && fixed[b] && fixed[c])
      for (const std::array<int, 2> edge : {edgeOf(a, b), edgeOf(b, c), edgeOf(c, a)}) ++heldTriangles[edge];
  DisjointSets together(fixed.size());
  std::vector<double> length(fixed.size(), 0);
  for (const auto& [edge, count] : heldTriangles) {
    if (count > 1) continue;
    together.join(edge[0], edge[1]);
    for (const int node : edge) length[node] += 0.5 * (m.restNodes[edge[0]] - m.restNodes[edge[1]]).norm();
  }
  std::map<int, std::vector<RimNode>> byFirst;
  for (int i = 0; i < static_cast<int>(length.size()); ++i)
    if (length[i] > 0) byFirst[together.of(i)].push_back({i, length[i]});
  Rims out;
  for (auto& [first, nodes] : byFirst) out.push_back(std::move(nodes));
  return out;
}

// A link that leaves what is held.
struct Crossing {
  int link, heldSphere;
};

struct Rim {
  std::vector<Vector3d> nodes;
  std::vector<double> length;  // m, per node; 1 of parts, which are no outline with a mean of its own
  bool isShared = false;       // by several links
};

// The rim that a link leaves through: that of which some nodes hang on it or on its held sphere. It counts whole: how
// much of it hangs there is as spheres happen to lie, and some of its nodes tell how it leans, not where it is. (Of a
// gallbladder of nine spheres half a rim hung there, its mean a third of the link off: 70 % too stiff.) Where several
// links share a rim each has what hangs there: whole, it bends a liver of 35 spheres nearer (14.3 for 14.7 % at most)
// and a gallbladder of 25, whose neck is held, less near (6.9 for 6.0).
Rim rimAround(const SoftBodyModel& m, const Rims& rims, const std::vector<Crossing>& crossings, int link) {
  const auto hangsOn = [&](const Crossing& c) {
    return [&m, &c](const RimNode& n) {
      const Attachment& a = m.attachments[n.node];
      return a.host == (a.onLink ? c.link : c.heldSphere);
    };
  };
  Rim out;
  for (const std::vector<RimNode>& rim : rims) {
    std::vector<const Crossing*> through;
    for (const Crossing& c : crossings)
      if (std::any_of(rim.begin(), rim.end(), hangsOn(c))) through.push_back(&c);
    const auto own =
        std::find_if(through.begin(), through.end(), [link](const Crossing* c) { return c->link == link; });
    if (own == through.end()) continue;
    const bool isShared = through.size() > 1;
    out.isShared = out.isShared || isShared;
    for (const RimNode& n : rim) {
      if (isShared && !hangsOn(**own)(n)) continue;
      out.nodes.push_back(m.restNodes[n.node]);
      out.length.push_back(isShared ? 1 : n.length);
    }
  }
  return out;
}

// How far along the link, as a share from `end` on, the surface around a held sphere is fixed: the mean along the rim,
// however far apart its nodes stand, 0 where that lies behind the link. Nothing where no rim hangs there: a sphere that
// is held by its number holds no section.
// (By the area that the rim spans, which counts most what lies farthest out, gallbladders on a coarse mesh are 4 % off
// in stiffness instead of 14, on finer ones 10 instead of 8.)
std::optional<double> fixedShare(const Rim& rim, const Vector3d& end, const Vector3d& line) {
  const double most = rim.isShared ? 0.5 : 0.9;
  double sum = 0, whole = 0;
  for (std::size_t k = 0; k < rim.nodes.size(); ++k) {
    sum += rim.length[k] * (rim.nodes[k] - end).dot(line) / line.squaredNorm();
    whole += rim.length[k];
  }
  if (!(whole > 0)) return {};
  return std::clamp(sum / whole, 0.0, most);
}

struct SectionAxes {
  Vector3d t, u, v;
};

SectionAxes axesOf(const Vector3d& line, const Vector3d& restU) {
  const Vector3d t = line.normalized(), u = (restU - t * t.dot(restU)).normalized();
  return {t, u, t.cross(u)};
}

Matrix2d squareRootInverse(const SymmetricEigen& eigen) {
  const Matrix2d vectors = eigen.vectors;
  return vectors * Vector2d(eigen.values.cwiseSqrt().cwiseInverse()).asDiagonal() * vectors.transpose();
}

// A rim that is jagged, as that of whole triangles is, clamps a section's fibres at different depths a(r), and a short
// link turns accordingly more in one plane than in another: K = E int r r^T / a dA, so that the compliance mean(a) /
// (E I) grows by I^-1 [int r r^T (a - mean) dA] I^-1 / E = I^-1/2 beyond I^-1/2 / E. `beyond` takes the second moments
// of the rim's own nodes for the section's. What is held inside is a fan over the rim: (a - mean) grows from the middle
// to the rim, and int r^4 dr / int r^3 dr = 4/5 of it counts. A plane that lies askew bends nothing by itself and is
// left out. `outward`: along the link, from what is free to what is held.
Matrix2d beyondRim(const std::vector<Vector3d>& rim, const Vector3d& outward, const SectionAxes& axes, double most) {
  constexpr double kFan = 0.8;
  constexpr std::size_t kFewest = 6;  // a plane and a form of second degree
  constexpr double kRoundest = 0.1;   // a rim on one side only tells nothing of the section
  if (rim.size() < kFewest) return Matrix2d::Zero();
  Vector3d centre = Vector3d::Zero();
  for (const Vector3d& node : rim) centre += node / static_cast<double>(rim.size());
  const auto across = [&](const Vector3d& node) {
    return Vector2d((node - centre).dot(axes.u), (node - centre).dot(axes.v));
  };
  Matrix2d second = Matrix2d::Zero();
  Vector2d askew = Vector2d::Zero();
  for (const Vector3d& node : rim) {
    const Vector2d r = across(node);
    second += r * r.transpose();
    askew += r * (node - centre).dot(outward);
  }
  const SymmetricEigen eigen = symmetricEigen(second);
  if (!(eigen.values[0] > kRoundest * eigen.values[1])) return Matrix2d::Zero();
  const Vector2d slope = second.inverse() * askew;
  Matrix2d sum = Matrix2d::Zero();
  for (const Vector3d& node : rim) {
    const Vector2d r = across(node);
    sum += ((node - centre).dot(outward) - slope.dot(r)) * r * r.transpose();
  }
  const Matrix2d root = squareRootInverse(eigen), beyond = kFan * root * sum * root;
  const double largest = beyond.norm();
  return largest > most ? Matrix2d(most / largest * beyond) : beyond;
}

// Mean along a span of a section's compliance, and of it times x and x^2, x = 0..1 along the span.
struct Compliance {
  double mean = 0, first = 0, second = 0;
};

// Of the sections' 1 / `member` from `from` to `to`, places on the whole link.
Compliance complianceOf(const ElasticLink& l, double from, double to, const LinkSpan& span,
                        double LinkSection::*member) {
  Compliance out;
  for (int k = 0; k < ElasticLink::kSections; ++k) {
    const auto at = [&](int section) {
      const double place = std::clamp(static_cast<double>(section) / ElasticLink::kSections, from, to);
      return (place - span.from) / (span.to - span.from);
    };
    const double a = at(k), b = at(k + 1), c = 1 / (l.sections[k].*member);
    out.mean += c * (b - a);
    out.first += c * (b * b - a * a) / 2;
    out.second += c * (b * b * b - a * a * a) / 3;
  }
  return out;
}

const LinkSection& sectionAt(const ElasticLink& l, double place) {
  return l.sections[std::clamp(static_cast<int>(place * ElasticLink::kSections), 0, ElasticLink::kSections - 1)];
}

// Where a section is clamped it cannot grow narrower or wider, which stiffens what is near as if the body began
// nu^2 R / 2 farther on: the energy of the hindered contraction goes by nu^2. The factor makes a cylinder of finite
// elements, which bends 3 % less than Timoshenko's beam at five diameters' length. m.
double hinderedDepth(const LinkSection& section, double poisson) {
  return poisson * poisson * std::sqrt(section.area / std::numbers::pi) / 2;
}

// From where to where a link gives way, places on the whole link: a clamp lies `deeper` (m) than the span says.
struct FreePart {
  double from, to;
};
FreePart freePart(const LinkSpan& span, double deeper) {
  constexpr double kMost = 0.5;  // of the span
  const double part = span.to - span.from, length = (span.end1 - span.end0).norm() / part;
  const double share = std::clamp(deeper / length, -kMost * part, kMost * part);
  return {span.from + (span.clamped0 ? share : 0), span.to - (span.clamped1 ? share : 0)};
}

// Section axes in which a clamped link bends in one plane at a time, though its rim be jagged: principal axes of the
// sections' compliance along the span and of what the rim adds to it. The sections' compliances between their own axes
// and these are left out, as they are where sections of one link have different axes.
struct TurnedLink {
  ElasticLink link;
  double beyondU, beyondV;  // m, for bending across the new U and V
};

TurnedLink turnedToRim(const ElasticLink& l, const LinkSpan& span) {
  if (span.beyond.isZero(0)) return {l, 0, 0};
  const Vector3d line = span.end1 - span.end0;
  const SectionAxes axes = axesOf(line, l.restU);
  const LinkSection& clamped = sectionAt(l, span.clamped0 ? span.from : span.to);
  const Vector2d root(1 / std::sqrt(clamped.bendingMomentV), 1 / std::sqrt(clamped.bendingMomentU));
  Matrix2d compliance = root.asDiagonal() * span.beyond * root.asDiagonal();
  compliance(0, 0) += line.norm() * complianceOf(l, span.from, span.to, span, &LinkSection::bendingMomentV).mean;
  compliance(1, 1) += line.norm() * complianceOf(l, span.from, span.to, span, &LinkSection::bendingMomentU).mean;
  // The turn that makes it diagonal, the smaller of the two.
  const double difference = compliance(0, 0) - compliance(1, 1);
  const double angle = 0.5 * std::atan2(2 * std::copysign(1.0, difference) * compliance(0, 1), std::abs(difference));
  const Vector2d u(std::cos(angle), std::sin(angle)), v(-u.y(), u.x()), squares = u.cwiseAbs2();
  TurnedLink out{l, u.dot(span.beyond * u), v.dot(span.beyond * v)};
  out.link.restU = u.x() * axes.u + u.y() * axes.v;
  for (LinkSection& s : out.link.sections) {
    const Vector2d own(1 / s.bendingMomentV, 1 / s.bendingMomentU);  // across U, across V
    s.bendingMomentV = 1 / squares.dot(own);
    s.bendingMomentU = 1 / squares.dot(own.reverse());
  }
  return out;
}

// Of a link whose compliance per length is c / factor. Springs: each end bends as the link would, weighted towards the
// end; both act in series: 2EI/L each of a uniform link. Beam (Timoshenko): the inverse of how moments at the ends turn
// them, L int c [[(1-x)^2, -x (1-x)], [., x^2]] dx + shear [[1, 1], [1, 1]]; without shear EI/L [[4, 2], [2, 4]] of a
// uniform link.
FlexionStiffness flexionStiffness(const Compliance& c, double shear, bool beam, double factor) {
  if (!beam) return {factor / (c.mean - c.first), factor / c.first, 0};
  const double f00 = c.mean - 2 * c.first + c.second + shear, f01 = c.second - c.first + shear, f11 = c.second + shear;
  const double scale = factor / (f00 * f11 - f01 * f01);
  return {scale * f11, scale * f00, -scale * f01};
}

LinkStiffness stiffnessOf(const BodyDescription& body, const ElasticLink& own, const LinkSpan& span) {
  constexpr double kShearCoefficient = 0.9;  // round sections (Cowper 1966)
  const double e = body.tissue.young, shear = e / (2 * (1 + body.tissue.poisson));
  const bool beam = body.links == LinkModel::beam;
  const Vector3d line = span.end1 - span.end0;
  const TurnedLink turned = beam ? turnedToRim(own, span) : TurnedLink{own, 0, 0};
  const ElasticLink& l = turned.link;
  const double hindered =
      beam ? hinderedDepth(sectionAt(l, span.clamped0 ? span.from : span.to), body.tissue.poisson) : 0;
  const auto compliance = [&](double LinkSection::*member, double beyond) {
    const FreePart part = freePart(span, hindered - beyond);
    return complianceOf(l, part.from, part.to, span, member);
  };
  const double inverse = 1 / line.norm(), stretch = compliance(&LinkSection::area, 0).mean;
  const double sheared = stretch * inverse * inverse * e / (kShearCoefficient * shear);
  const LinkFactors factors = factorsAt(body, 0.5 * (span.end0 + span.end1));
  const double bending = factors.flexion * e * inverse;
  LinkStiffness k;
  k.elongation = factors.elongation * e * inverse / stretch;
  k.flexionU = flexionStiffness(compliance(&LinkSection::bendingMomentU, turned.beyondV), sheared, beam, bending);
  k.flexionV = flexionStiffness(compliance(&LinkSection::bendingMomentV, turned.beyondU), sheared, beam, bending);
  k.torsion =
      factors.torsion * shear * inverse / complianceOf(l, span.from, span.to, span, &LinkSection::torsionConstant).mean;
  k.restU = axesOf(line, l.restU).u;
  return k;
}

}  // namespace

LinkFactors factorsAt(const BodyDescription& body, const Vector3d& middle) {
  LinkFactors out;
  for (const SteeredLinks& s : body.steered) {
    if (s.where && !contains(*s.where, middle)) continue;
    out.elongation *= s.factors.elongation;
    out.flexion *= s.factors.flexion;
    out.torsion *= s.factors.torsion;
  }
  return out;
}

std::vector<Vector3d> linkMiddles(const BodyDescription& body) {
  const SoftBodyModel& m = *body.model;
  std::vector<Vector3d> out;
  if (body.links == LinkModel::identified)
    for (const IdentifiedLink& l : m.identified->links) out.push_back(0.5 * (l.restPoint0 + l.restPoint1));
  else
    for (const ElasticLink& l : m.links)
      out.push_back(0.5 * (m.spheres[l.sphere0].restLinkEnd + m.spheres[l.sphere1].restLinkEnd));
  return out;
}

// A link to a held sphere begins where the surface around it is free: what lies within the held surface cannot bend.
std::vector<LinkSpan> linkSpans(const BodyDescription& body, const std::vector<bool>& moves,
                                const std::vector<bool>& turns) {
  const SoftBodyModel& m = *body.model;
  const Rims rims = rimsOfFixed(body);
  const auto isHeld = [&](int sphere) { return !moves[sphere] && !turns[sphere]; };
  std::vector<Crossing> crossings;
  for (std::size_t k = 0; k < m.links.size(); ++k) {
    const ElasticLink& l = m.links[k];
    if (isHeld(l.sphere0) != isHeld(l.sphere1))
      crossings.push_back({static_cast<int>(k), isHeld(l.sphere0) ? l.sphere0 : l.sphere1});
  }
  std::vector<LinkSpan> out;
  for (std::size_t k = 0; k < m.links.size(); ++k) {
    const ElasticLink& l = m.links[k];
    const Vector3d end0 = m.spheres[l.sphere0].restLinkEnd, line = m.spheres[l.sphere1].restLinkEnd - end0;
    if (line.isZero(0))
      throw std::runtime_error(
          fmt::format("its model's spheres {} and {} are linked and lie in one point", l.sphere0, l.sphere1));
    LinkSpan span;
    if (isHeld(l.sphere0) != isHeld(l.sphere1)) {
      const bool first = isHeld(l.sphere0);
      const Rim around = rimAround(m, rims, crossings, static_cast<int>(k));
      const std::optional<double> share =
          first ? fixedShare(around, end0, line) : fixedShare(around, end0 + line, -line);
      (first ? span.clamped0 : span.clamped1) = share.has_value();
      if (first) span.from = share.value_or(0);
      if (!first) span.to = 1 - share.value_or(0);
      const SectionAxes axes = axesOf(line, l.restU);
      span.beyond = beyondRim(around.nodes, first ? -axes.t : axes.t, axes, (span.to - span.from) * line.norm());
    }
    span.end0 = end0 + span.from * line;
    span.end1 = end0 + span.to * line;
    out.push_back(span);
  }
  return out;
}

std::vector<LinkStiffness> linkStiffness(const BodyDescription& body, const std::vector<LinkSpan>& spans) {
  std::vector<LinkStiffness> out;
  for (std::size_t i = 0; i < spans.size(); ++i) out.push_back(stiffnessOf(body, body.model->links[i], spans[i]));
  return out;
}

double twistShare(const ElasticLink& l, const LinkSpan& span, double along) {
  const double place = span.from + along * (span.to - span.from);
  const auto twist = [&](double to) {
    return complianceOf(l, span.from, to, span, &LinkSection::torsionConstant).mean;
  };
  return twist(place) / twist(span.to);
}

}  // namespace medulla
