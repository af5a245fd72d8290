#include "physics/model/link_sections.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>

#include "physics/model/plane_section.h"

namespace medulla {

using Eigen::Vector3d;

static constexpr int stations = 9;
static constexpr double pi = 3.141592653589793;

static double torsionConstant(const SectionMoments& s) {
  const double squared = s.area * s.area;
  return squared * squared / (4 * pi * pi * s.secondMoment.trace());
}

static SectionMoments disc(double radius) {
  SectionMoments s;
  const double squared = radius * radius;
  s.area = pi * squared;
  s.secondMoment = pi * squared * squared / 4 * Eigen::Matrix2d::Identity();
  return s;
}

static std::vector<SectionMoments> sectionsAlong(const TriangleMesh& mesh, const PowerSites& sites,
                                                 const Vector3d& start, const Vector3d& end, const Plane& across) {
  std::vector<SectionMoments> sections;
  double largest = 0;
  for (int k = 0; k < stations; ++k) {
    const Plane plane{start + (k + 0.5) / stations * (end - start), across.u, across.v};
    sections.push_back(planeSection(mesh, plane, &sites, {0, 1}));
    largest = std::max(largest, sections.back().area);
  }
  std::erase_if(sections, [&](const SectionMoments& s) { return s.area <= 0.01 * largest; });
  return sections;
}

static void measureLink(const TriangleMesh& mesh, const PowerSites& sites, const std::vector<FillingSphere>& spheres,
                        ElasticLink& link) {
  const FillingSphere &s0 = spheres[link.sphere0], &s1 = spheres[link.sphere1];
  const Vector3d line = s1.restLinkEnd - s0.restLinkEnd;
  const Plane across = planeAcross(s0.restLinkEnd, line.normalized());
  const PowerSites around = sitesAround(sites, {link.sphere0, link.sphere1});
  std::vector<SectionMoments> sections = sectionsAlong(mesh, around, s0.restLinkEnd, s1.restLinkEnd, across);
  if (sections.empty()) sections.push_back(disc(std::min(s0.radius, s1.radius)));

  double stretch = 0, twist = 0;
  Eigen::Matrix2d bend = Eigen::Matrix2d::Zero();
  for (const SectionMoments& s : sections) {
    stretch += 1 / s.area;
    twist += 1 / torsionConstant(s);
    bend += s.secondMoment.inverse();
  }
  const auto count = static_cast<double>(sections.size());
  link.area = count / stretch;
  link.torsionConstant = count / twist;
  // Principal axes of the mean tensor. Bending about an axis is resisted by the extent across it.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> principal((count * bend.inverse()).eval());
  const Eigen::Vector2d axis = principal.eigenvectors().col(0);
  link.restU = (axis.x() * across.u + axis.y() * across.v).normalized();
  link.bendingMomentU = principal.eigenvalues()[1];
  link.bendingMomentV = principal.eigenvalues()[0];
}

void measureLinks(const TriangleMesh& mesh, const PowerSites& sites, const std::vector<FillingSphere>& spheres,
                  std::vector<ElasticLink>& links) {
  for (ElasticLink& link : links) measureLink(mesh, sites, spheres, link);
}

}  // namespace medulla
