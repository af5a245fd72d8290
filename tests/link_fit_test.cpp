#include "physics/model/identify/link_fit.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "physics/model/identify/reduction.h"
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

Eigen::MatrixXd inverseOf(const Eigen::MatrixXd& positive) {
  return solvePositive(positive, Eigen::MatrixXd::Identity(positive.rows(), positive.rows()));
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
  const Eigen::MatrixXd compliance = inverseOf(stiffnessOf(meant));
  const auto errorOf = [&](LinkForm form, bool strained) {
    std::vector<IdentifiedLink> links = coupledLinks();
    fitLinks(compliance, {}, {}, 1, form, links);
    for (const IdentifiedLink& l : links) EXPECT_EQ(!l.strain0.isZero(0), strained);
    return (inverseOf(stiffnessOf(links)) - compliance).norm() / compliance.norm();
  };
  const double coupled = errorOf(LinkForm::full, true), uncoupled = errorOf(LinkForm::uncoupled, false);
  EXPECT_LT(coupled, 0.5 * uncoupled);
  EXPECT_LT(uncoupled, errorOf(LinkForm::diagonal, false));
}

// Three cells in a row from a clamp, the last of which is twisted beyond its middle: more than the network's own load
// on it, and the other way round on the one before.
TEST(LinkFit, ARowIsFoundFromLoadsOnItsEndThatAreNotItsOwn) {
  constexpr int kFrames = 3;
  const auto row = [] {
    std::vector<IdentifiedLink> links(3);
    for (int k = 0; k < 3; ++k) {
      links[k].frame0 = k == 0 ? 0 : k - 1;
      links[k].frame1 = k == 0 ? kFrames : k;
      links[k].restPoint0 = {static_cast<double>(links[k].frame0), 0, 0};
      links[k].restPoint1 = {k == 0 ? -0.5 : k, 0, 0};
      links[k].axes = Eigen::Matrix3d::Identity();
    }
    return links;
  };
  std::vector<IdentifiedLink> meant = row(), plain = row(), found = row();
  for (int k = 0; k < 3; ++k) meant[k].stiffness = Vector6d(5 + k, 2, 2, 0.5 + 0.2 * k, 0.8, 0.7).asDiagonal();
  const Eigen::MatrixXd compliance = inverseOf(networkStiffness(meant, 1, kFrames));
  LoadsOnCells ends{{2}, Eigen::MatrixXd::Zero(18, 6), {}};
  ends.loads.bottomRows<6>().setIdentity();
  ends.loads(15, 3) = 1.2;
  ends.loads(9, 3) = -0.2;
  ends.motions = compliance * ends.loads;
  // Of couples spread over cells, the cells' own turns are what no row answers.
  Eigen::MatrixXd spread = compliance;
  for (const int turn : {3, 9, 15}) spread(turn, turn) *= 0.9;
  fitLinks(spread, {}, {}, 1, LinkForm::diagonal, plain);
  fitLinks(spread, {}, ends, 1, LinkForm::diagonal, found);
  for (int k = 0; k < 3; ++k) {
    const double twist = meant[k].stiffness(3, 3);
    EXPECT_LT(std::abs(found[k].stiffness(3, 3) / twist - 1), 0.5 * std::abs(plain[k].stiffness(3, 3) / twist - 1))
        << k;
  }
  EXPECT_LT((inverseOf(networkStiffness(found, 1, kFrames)) * ends.loads - ends.motions).norm(),
            0.02 * ends.motions.norm());
}

// A bar that is clamped 10 mm along x, told of a patch whose nearest point lies aside.
TEST(LinkFit, ClampsAreCentredWithoutChangingSmallDisplacements) {
  constexpr double kClampScale = 0.015;
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
  const Eigen::MatrixXd stiffness = networkStiffness({bar}, kClampScale, 1);
  const Matrix6d motions = linkMeasures(aside, kClampScale).leftCols<6>().inverse();
  aside.stiffness = motions.transpose() * stiffness * motions;
  centreClamp(kClampScale, aside);
  EXPECT_LT((networkStiffness({aside}, kClampScale, 1) - stiffness).norm(), 1e-12 * stiffness.norm());
  EXPECT_NEAR((aside.restPoint1 - bar.restPoint1).norm(), 0, 1e-12);
}

}  // namespace medulla
