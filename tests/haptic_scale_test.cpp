#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "app/files/log_table.h"
#include "tests/own_scene.h"

namespace medulla {
namespace {

std::string motionOf(double scale, double deeper) {
  const double poses[][4] = {{0, -0.0525, -0.0385, 0.04},     {0.5, -0.0525, -0.0385, 0.019},
                             {1, -0.0525, -0.0385, 0.019},    {2, -0.0569, -0.0473, 0.0209},
                             {2.5, -0.0569, -0.0473, 0.0209}, {3, -0.055, -0.056, 0.045}};
  std::string motion = "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n";
  for (const auto& [t, x, y, z] : poses)
    motion += fmt::format("{},{},{},{},1,0,0,0,0\n", t, scale * x, scale * y, scale * (z - deeper));
  return motion;
}

// N over scale^4, the tool's force in each tick.
using Forces = std::vector<Eigen::Vector3d>;
class HapticScale : public OwnScene {
 protected:
  Forces feltAt(double scale, const std::string& unit, double deeper) const {
    const std::string mesh = MEDULLA_SOURCE_DIR "/assets/gallbladder/gallbladder.obj";
    const ProgramResult built = run({"build", mesh, "--unit", unit, "--spheres", "7", "-o", "own/organ.model.xml"});
    EXPECT_EQ(built.exitCode, 0) << built.err;
    folder.write("own/organ.csv", motionOf(scale, deeper));
    const double area = scale * scale, volume = area * scale;
    folder.write("own/organ.xml", fmt::format(R"(<scene name="organ"><clock servo="1200" dynamics="50" duration="3"/>
<dynamics gravity="0 0 0"/><tissue name="t" young="{}" damping="0.15"/>
<body name="organ" tissue="t" look="liver" model="organ.model.xml" surface="contact"><fix sphere="{} {} {} {}"/></body>
<tool name="tool" trajectory="organ.csv" radius="{}" stiffness="{}" damping="{}" friction="0.3 0.2" force_max="{}"/>
<camera position="0 0 {}" target="0 0 0"/></scene>)",
                                              9e3 * area, -0.025 * scale, -0.008 * scale, -0.017 * scale, 0.016 * scale,
                                              0.003 * scale, 400 * volume, volume, 8 * volume * scale, scale));
    const ProgramResult r = run({"replay", "own/organ.xml", "--log", "log.csv", "--log-rate", "tick"});
    EXPECT_EQ(r.exitCode, 0) << r.err;
    const LogTable log = readLog(folder / "log.csv");
    const std::size_t column = columnOf(log, "tool.force.x");
    Forces out;
    for (const std::vector<double>& row : log.value)
      out.push_back(Eigen::Vector3d(row[column], row[column + 1], row[column + 2]) / (volume * scale));
    return out;
  }
};

// Lengths by s, Young's modulus by s^2 and a tool's stiffness by s^3 leave all times as they are and forces go by s^4.
// With lengths of its own, in micrometres, the proxy felt a body of 1 mm otherwise, by 3 % of the largest force. What
// swings to and fro before the tool may touch it a tick later by rounding alone, which is a percent: the median of some
// motions tells, deep ones, that graze it less.
TEST_F(HapticScale, WhatIsFeltAsksForNoSize) {
  std::vector<double> shares;  // of the largest force, RMS
  for (const double deeper : {0.5e-4, 1e-4, 1.5e-4, 2e-4, 2.5e-4}) {
    const Forces large = feltAt(1, "m", deeper), small = feltAt(0.01, "cm", deeper);
    ASSERT_EQ(large.size(), small.size());
    double most = 0, apart = 0;
    for (std::size_t k = 0; k < large.size(); ++k) {
      most = std::max(most, large[k].squaredNorm());
      apart += (large[k] - small[k]).squaredNorm() / static_cast<double>(large.size());
    }
    EXPECT_GT(most, 0.05 * 0.05);
    // Of tissue that swings away rounding left 1e-17 N, or none, and with it a tool at rest that steadies the tissue.
    const auto isRounding = [&](const Eigen::Vector3d& f) { return !f.isZero(0) && f.squaredNorm() < 1e-20 * most; };
    EXPECT_EQ(std::count_if(large.begin(), large.end(), isRounding), 0);
    shares.push_back(std::sqrt(apart / most));
  }
  std::sort(shares.begin(), shares.end());
  EXPECT_LT(shares[shares.size() / 2], 0.002);
}

}  // namespace
}  // namespace medulla
