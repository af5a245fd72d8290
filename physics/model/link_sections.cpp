#include "physics/model/link_sections.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "physics/model/link_graph.h"
#include "physics/model/plane_section.h"
#include "physics/model/symmetric_eigen.h"

namespace medulla {

using Eigen::Vector3d;

using std::numbers::pi;

static SectionMoments disc(double radius) {
  SectionMoments s;
  const double squared = radius * radius;
  s.area = pi * squared;
  s.secondMoment = pi * squared * squared / 4 * Eigen::Matrix2d::Identity();
  s.torsionConstant = s.secondMoment.trace();
  return s;
}

using Sections = std::array<SectionMoments, ElasticLink::kSections>;

// Stations that the plane misses get the nearest other's section, the one before of two. A corner of a cell that it
// cuts off where the line lies outside is a miss, too; a neck, however thin, has the line in it.
static void fillGaps(Sections& sections, double radius) {
  double largest = 0;
  for (const SectionMoments& s : sections) largest = std::max(largest, s.area);
  if (largest <= 0) sections.fill(disc(radius));
  const Sections measured = sections;
  const auto isGap = [&](int k) {
    return measured[k].area <= 0 || (!measured[k].holdsOrigin && measured[k].area <= 0.01 * largest);
  };
  for (int k = 0; k < ElasticLink::kSections; ++k) {
    for (int away = 1; isGap(k) && away < ElasticLink::kSections; ++away) {
      const int before = k - away, after = k + away;
      const int found = before >= 0 && !isGap(before) ? before : after;
      if (found >= ElasticLink::kSections || isGap(found)) continue;
      sections[k] = measured[found];
      break;
    }
  }
}

// Where the body widens, tension cannot follow to the rim at once: in a cone it is the same on spheres about the cone's
// tip, whose part inside has the rim of a flat section farther back, cos(slope) times as wide. Torsion is borne near
// the rim anyway; taking it so made the gallbladder of finite elements a fifth too soft. What widens faster than
// `kSteepest`, as where an arm joins, is no cone.
static std::array<double, ElasticLink::kSections> taperCosines(const Sections& sections, double length) {
  constexpr int last = ElasticLink::kSections - 1;
  constexpr double kSteepest = 0.5;
  std::array<double, ElasticLink::kSections> out;
  const auto radius = [&](int k) { return std::sqrt(sections[k].area / pi); };
  for (int k = 0; k <= last; ++k) {
    const int before = std::max(k - 1, 0), after = std::min(k + 1, last);
    const double step = (after - before) * length / ElasticLink::kSections;
    const double slope = std::min(std::abs(radius(after) - radius(before)) / step, kSteepest);
    out[k] = 1 / std::hypot(1, slope);
  }
  return out;
}

static void measureLink(const TriangleMesh& mesh, const PowerSites& sites, const std::vector<FillingSphere>& spheres,
                        ElasticLink& link) {
  const FillingSphere &s0 = spheres[link.sphere0], &s1 = spheres[link.sphere1];
  const Vector3d line = s1.restLinkEnd - s0.restLinkEnd;
  const Plane across = planeAcross(s0.restLinkEnd, line.normalized());
  const PowerSites around = sitesAround(sites, {link.sphere0, link.sphere1});
  Sections sections;
  for (int k = 0; k < ElasticLink::kSections; ++k) {
    const Plane plane{s0.restLinkEnd + (k + 0.5) / ElasticLink::kSections * line, across.u, across.v};
    sections[k] = planeSection(mesh, plane, &around, {0, 1});
  }
  fillGaps(sections, std::min(s0.radius, s1.radius));

  const std::array<double, ElasticLink::kSections> taper = taperCosines(sections, line.norm());

  // Principal axes of the mean tensor, as compliances add up. Bending about an axis is resisted by the extent across
  // it.
  Eigen::Matrix2d bend = Eigen::Matrix2d::Zero();
  for (const SectionMoments& s : sections) bend += s.secondMoment.inverse();
  const SymmetricEigen principal = symmetricEigen(bend.inverse());
  const Eigen::Vector2d u = principal.vectors.col(0), v = principal.vectors.col(1);
  link.restU = (u.x() * across.u + u.y() * across.v).normalized();
  for (int k = 0; k < ElasticLink::kSections; ++k) {
    const Eigen::Matrix2d compliance = sections[k].secondMoment.inverse();
    const double two = taper[k] * taper[k], four = two * two;
    link.sections[k] = {two * sections[k].area, four / v.dot(compliance * v), four / u.dot(compliance * u),
                        sections[k].torsionConstant};
  }
}

int countHollowLinks(const TriangleMesh& mesh, const SurfaceTree& tree, const PowerSites& sites,
                     const std::vector<FillingSphere>& spheres, const std::vector<ElasticLink>& links) {
  return static_cast<int>(std::count_if(links.begin(), links.end(), [&](const ElasticLink& link) {
    const Vector3d &from = spheres[link.sphere0].restLinkEnd, &to = spheres[link.sphere1].restLinkEnd;
    const Plane plane = planeAcross((from + to) / 2, (to - from).normalized());
    if (sectionHasHole(mesh, plane)) return true;
    const PowerSites around = sitesAround(sites, {link.sphere0, link.sphere1});
    const SectionMoments s = planeSection(mesh, plane, &around, {0, 1});
    return s.area > 0 && !isInside(tree, plane.origin + s.centroid.x() * plane.u + s.centroid.y() * plane.v);
  }));
}

int countSheetLinks(const std::vector<FillingSphere>& spheres, const std::vector<ElasticLink>& links) {
  constexpr double kFlat = 6;  // of a rectangle's second moments: sides of 1 to 2.4
  constexpr int kNetwork = 3;
  const std::vector<int> counts = linkCounts(spheres.size(), links);
  return static_cast<int>(std::count_if(links.begin(), links.end(), [&](const ElasticLink& link) {
    const LinkSection& s = link.sections[ElasticLink::kSections / 2];
    const auto [thin, wide] = std::minmax(s.bendingMomentU, s.bendingMomentV);
    return wide > kFlat * thin && std::min(counts[link.sphere0], counts[link.sphere1]) >= kNetwork;
  }));
}

void measureLinks(const TriangleMesh& mesh, const PowerSites& sites, const std::vector<FillingSphere>& spheres,
                  std::vector<ElasticLink>& links) {
  for (ElasticLink& link : links) measureLink(mesh, sites, spheres, link);
}

}  // namespace medulla
