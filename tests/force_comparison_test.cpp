#include "app/force_comparison.h"

#include <gtest/gtest.h>

#include <cmath>

namespace medulla {

using Forces = std::vector<Eigen::Vector3d>;

static Forces bumps(int count, int late, double factor) {
  Forces out;
  for (int k = 0; k < count; ++k) {
    const double t = 0.01 * (k - late), f = factor * (std::exp(-(t - 4) * (t - 4)) + std::exp(-9 * (t - 7) * (t - 7)));
    out.emplace_back(f, 0.5 * f, -f);
  }
  return out;
}

TEST(ForceComparison, FindsRmsPeaksAndLag) {
  const Forces measured = bumps(1000, 0, 1);
  const ForceMatch same = matchForces(measured, measured, 0.01);
  EXPECT_EQ(same.rms, 0);
  EXPECT_EQ(same.lag, 0);
  EXPECT_NEAR(same.correlation, 1, 1e-12);
  EXPECT_NEAR(same.peak, 1.5, 1e-3);
  const ForceMatch late = matchForces(bumps(1000, 17, 2), measured, 0.01),
                   early = matchForces(measured, bumps(1000, 17, 2), 0.01);
  EXPECT_NEAR(*late.lag, 0.17, 1e-12);
  EXPECT_NEAR(*early.lag, -0.17, 1e-12);
  EXPECT_NEAR(late.correlation, 1, 1e-3);
  EXPECT_NEAR(late.peak, 2 * late.peakMeasured, 1e-3);
}

// A lag is the least shift among those that agree alike, and shifts lose what lies beyond their ends: nothing comes
// round from the other one.
TEST(ForceComparison, TakesTheNearestOfRepeats) {
  Forces swing, ramp, late;
  for (int k = 0; k < 512; ++k) {
    const double turn = 2 * EIGEN_PI * k / 32;
    swing.emplace_back(std::sin(turn), 0, std::cos(turn));
    ramp.emplace_back(0, k < 500 ? 0 : 1, 0);
    late.emplace_back(0, k < 5 ? 1 : 0, 0);
  }
  EXPECT_EQ(matchForces(swing, swing, 0.01).lag, 0);
  const ForceMatch ends = matchForces(ramp, late, 0.01);
  EXPECT_LT(ends.correlation, 0.1);
}

TEST(ForceComparison, LagsOfTicksAreFoundAmongManyTicks) {
  const Forces measured = bumps(1000, 0, 1);
  for (const int late : {-13, 0, 2, 17})  // ticks of 0.1 ms: a millisecond has ten
    EXPECT_NEAR(*matchForces(bumps(1000, late, 2), measured, 1e-4).lag, 1e-4 * late, 1e-12);
}

TEST(ForceComparison, AConstantForceHasNoLag) {
  const Forces constant(100, Eigen::Vector3d(0, 0, 2)), zero(100, Eigen::Vector3d::Zero());
  const ForceMatch match = matchForces(zero, constant, 0.01);
  EXPECT_EQ(match.rms, 2);
  EXPECT_EQ(match.peak, 0);
  EXPECT_EQ(match.peakMeasured, 2);
  EXPECT_FALSE(match.lag);
}

}  // namespace medulla
