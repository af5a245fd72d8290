#include "physics/dynamics/thinning.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

// How skins thin: against the neo-Hookean bar, solved by bisection.
namespace medulla {
namespace {

double barVolume(double poisson, double stretch) {
  const double l = 1 + stretch, c = (1 - 2 * poisson) / (2 * (1 + poisson));
  double low = 0.2, high = 3;
  for (int k = 0; k < 60; ++k) {
    const double j = 0.5 * (low + high);
    (j - 1 > c * (l * l - j / l) * std::pow(j, -5. / 3) ? high : low) = j;
  }
  return low;
}

Spare spareAt(double poisson, double stretch) {
  return spareOf(thinningOf(poisson), splat(stretch));
}

TEST(Thinning, SkinsKeepTheVolumeOfANeoHookeanBar) {
  for (const double poisson : {0.3, 0.38, 0.45, 0.49, 0.4999}) {
    for (const double stretch : {-0.25, -0.1, -1e-3, 1e-3, 0.1, 0.25}) {
      const double thinness = 1 - poisson * (stretch - spareAt(poisson, stretch).value[0]);
      EXPECT_NEAR(thinness * thinness * (1 + stretch), barVolume(poisson, stretch), stretch < 0 ? 0.006 : 0.001)
          << poisson << " " << stretch;
    }
  }
}

TEST(Thinning, SlopesAreThoseOfTheValues) {
  constexpr double step = 1e-6;
  for (const double poisson : {0., 1e-9, 0.1, 0.19, 0.2, 0.45, 0.499999}) {
    for (const double stretch : {-0.9, -0.25, -0.1, 0., 0.3, 2.}) {
      const double rate =
          (spareAt(poisson, stretch + step).value[0] - spareAt(poisson, stretch - step).value[0]) / (2 * step);
      EXPECT_NEAR(spareAt(poisson, stretch).slope[0], rate, 1e-5) << poisson << " " << stretch;
    }
    EXPECT_NEAR(spareAt(poisson, 0).value[0], 0, 1e-15);
    EXPECT_NEAR(spareAt(poisson, 0).slope[0], 0, 1e-12);
  }
  for (const double stretch : {-0.2, 0.3, 2.}) EXPECT_NEAR(spareAt(0, stretch).value[0], 0, 1e-12) << "nothing thins";
}

// Of the line to a frame: whole along its direction, half of it aside; smooth where it vanishes.
TEST(Thinning, StretchIsHalfOfLengthAndHalfOfWhatLiesAlong) {
  const Eigen::Vector3d way = Eigen::Vector3d(0.3, -0.8, 0.4).normalized(), aside = way.unitOrthogonal();
  const auto lanes = [](const Eigen::Vector3d& a) { return Lanes3{splat(a.x()), splat(a.y()), splat(a.z())}; };
  const auto stretchAt = [&](const Eigen::Vector3d& line) { return stretchOf(lanes(line), lanes(way)); };
  for (const double length : {0.8, 1., 1.7}) EXPECT_NEAR(stretchAt(length * way).value[0], length - 1, 1e-15);
  EXPECT_NEAR(stretchAt(std::cos(0.5) * way + std::sin(0.5) * aside).value[0], 0.5 * (std::cos(0.5) - 1), 1e-15);
  EXPECT_NEAR(stretchAt(way + 0.5 * aside).value[0], 0.5 * (std::sqrt(1.25) - 1), 1e-15);
  EXPECT_LT(stretchAt(0.5 * way).value[0], -0.25);
  constexpr double step = 1e-6;
  for (const double length : {0., 0.4, 0.75, 0.8, 1.7}) {
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d at = length * (way + 0.3 * aside), to = step * Eigen::Vector3d::Unit(k);
      const double rate = (stretchAt(at + to).value[0] - stretchAt(at - to).value[0]) / (2 * step);
      EXPECT_NEAR(vectorOf(stretchAt(at).slope, 0)[k], rate, 1e-6) << length;
    }
  }
}

}  // namespace
}  // namespace medulla
