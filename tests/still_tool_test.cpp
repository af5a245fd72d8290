#include <Eigen/Geometry>
#include <algorithm>

#include "app/files/log_table.h"
#include "tests/own_scene.h"

namespace medulla {

// Held still deep in a liver's dent of many walls, whose shares of the push change from frame to frame: the force comes
// to rest. Without the damper of a still tool (haptics/hand_over.cpp) it goes from 0.2 to 4 N and back for ever.
TEST_F(OwnScene, AStillToolComesToRestDeepInADent) {
  const Eigen::Vector3d start(0.03957, 0.0203, 0.02298), end(0.02609, 0.03121, 0.00904);
  std::string motion = "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n";
  for (int k = 0; k <= 12; ++k) {
    const double x = k / 12.0, share = x * x * x * (10 - 15 * x + 6 * x * x);
    const Eigen::Vector3d at = start + share * (end - start);
    motion += fmt::format("{:.1f},{:.6f},{:.6f},{:.6f},1,0,0,0,0\n", 0.1 * k, at.x(), at.y(), at.z());
  }
  folder.write("own/liver.csv", motion);
  folder.write("own/liver.xml", fmt::format(R"(<scene name="liver"><clock servo="1200" dynamics="200" duration="4"/>
<dynamics gravity="0 0 0"/><tissue name="t" young="5000" damping="0.2"/>
<body name="liver" model="{}/assets/liver/liver.model.xml" tissue="t" look="liver" links="springs" surface="contact">
<fix box="-0.13 0.02 -0.08 -0.02 0.12 -0.038"/><fix box="-0.012 0.06 -0.05 0.016 0.12 0.01"/></body>
<tool name="tool" radius="0.0135" stiffness="400" friction="0 0" trajectory="liver.csv"/>
<camera position="0 0.1 0.4" target="0 0 0"/></scene>)",
                                            MEDULLA_SOURCE_DIR));
  const ProgramResult r = run({"replay", "own/liver.xml", "--log", "log.csv", "--log-rate", "tick"});
  ASSERT_EQ(r.exitCode, 0) << r.err;
  const LogTable log = readLog(folder / "log.csv");
  const std::size_t column = columnOf(log, "tool.force.x");
  Eigen::AlignedBox3d forces;
  for (const std::vector<double>& row : log.value)
    if (row[0] > 3) forces.extend(Eigen::Vector3d(row[column], row[column + 1], row[column + 2]));
  EXPECT_GT(forces.center().norm(), 1.5);
  EXPECT_LT(forces.diagonal().norm(), 0.02 * forces.center().norm());
}

// What tissue answers is known from the first tick on: without a frame before the first, 0.9 N, and 0.1 in the next
// tick.
TEST_F(OwnScene, AToolThatPressesFromTheStartMeetsNoWall) {
  folder.write("own/organ.csv",
               "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n0,-0.0525,-0.0385,0.0285,1,0,0,0,0\n"
               "0.1,-0.0525,-0.0385,0.0185,1,0,0,0,0\n");
  const ProgramResult r =
      run({"replay", "own/organ.xml", "--set", "tool.probe.stiffness=400", "--log", "log.csv", "--log-rate", "tick"});
  ASSERT_EQ(r.exitCode, 0) << r.err;
  const LogTable log = readLog(folder / "log.csv");
  const std::size_t column = columnOf(log, "probe.force.x");
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  double most = 0, step = 0;
  for (const std::vector<double>& row : log.value) {
    const Eigen::Vector3d force(row[column], row[column + 1], row[column + 2]);
    most = std::max(most, force.norm());
    step = std::max(step, (force - last).norm());
    last = force;
  }
  EXPECT_GT(most, 0.1);
  EXPECT_LT(most, 0.25);
  EXPECT_LT(step, 0.05);
}

}  // namespace medulla
