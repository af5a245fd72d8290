#include "physics/model/identify/link_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "tests/dynamics_states.h"

namespace medulla {

namespace {

// Four cells at a tetrahedron's corners, the first of them held, and links that a strain of each cell couples.
std::vector<IdentifiedLink> coupledLinks() {
  const Eigen::Vector3d at[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}};
  std::vector<IdentifiedLink> links;
  const auto link = [&](int from, int to) {
    IdentifiedLink l;
    l.frame0 = from;
    l.frame1 = to;
    l.restPoint0 = at[from];
    l.restPoint1 = at[to];
    l.axes.row(0) = (at[to] - at[from]).normalized();
    l.axes.row(1) = l.axes.row(0).unitOrthogonal();
    l.axes.row(2) = l.axes.row(0).cross(l.axes.row(1));
    links.push_back(l);
  };
  for (int a = 0; a < 4; ++a)
    for (int b = a + 1; b < 4; ++b) link(a, b);
  link(0, 4);
  return links;
}

}  // namespace

TEST(LinkFit, StrainsOfCellsAreTheFullFormsAloneAndBringItNearer) {
  constexpr int kFrames = 4;
  const auto stiffnessOf = [](const std::vector<IdentifiedLink>& links) { return networkStiffness(links, 1, kFrames); };
  std::vector<IdentifiedLink> meant = coupledLinks();
  states::Random random(5);
  for (IdentifiedLink& l : meant) {
    l.stiffness = Vector6d(2, 1, 1, 0.5, 0.3, 0.3).asDiagonal();
    for (int i = 0; i < 3; ++i) {
      l.strain0[i] = 1 + random.uniform();
      if (l.frame1 < kFrames) l.strain1[i] = 1 + random.uniform();
    }
  }
  const Eigen::MatrixXd compliance = stiffnessOf(meant).inverse();
  const auto errorOf = [&](LinkForm form, bool strained) {
    std::vector<IdentifiedLink> links = coupledLinks();
    fitLinks(compliance, {}, {}, 1, form, links, {});
    for (const IdentifiedLink& l : links) EXPECT_EQ(!l.strain0.isZero(0), strained);
    return (stiffnessOf(links).inverse() - compliance).norm() / compliance.norm();
  };
  const double coupled = errorOf(LinkForm::full, true), uncoupled = errorOf(LinkForm::uncoupled, false);
  EXPECT_LT(coupled, 0.5 * uncoupled);
  EXPECT_LT(uncoupled, errorOf(LinkForm::diagonal, false));
}

// A bar that is clamped 10 mm along x, told of a patch whose nearest point lies aside.
TEST(LinkFit, ClampsAreCentredWithoutChangingSmallDisplacements) {
  constexpr double kScale = 0.015;
  const auto clampedAt = [](const Eigen::Vector3d& point) {
    IdentifiedLink l;
    l.frame1 = 1;
    l.restPoint1 = point;
    l.axes.row(0) = point.normalized();
    l.axes.row(1) = l.axes.row(0).unitOrthogonal();
    l.axes.row(2) = l.axes.row(0).cross(l.axes.row(1));
    return l;
  };
  IdentifiedLink bar = clampedAt({0.01, 0, 0}), aside = clampedAt({0.006, 0.004, -0.006});
  bar.stiffness = Vector6d(3, 1, 1, 0.2, 0.4, 0.4).asDiagonal();
  const Eigen::MatrixXd stiffness = networkStiffness({bar}, kScale, 1);
  const Matrix6d motions = linkMeasures(aside, kScale).leftCols<6>().inverse();
  aside.stiffness = motions.transpose() * stiffness * motions;
  centreClamp(kScale, aside);
  EXPECT_LT((networkStiffness({aside}, kScale, 1) - stiffness).norm(), 1e-12 * stiffness.norm());
  EXPECT_NEAR((aside.restPoint1 - bar.restPoint1).norm(), 0, 1e-12);
}

}  // namespace medulla
