#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>

#include "app/files/log_table.h"
#include "tests/program_run.h"
#include "tests/temporary_folder.h"

// What a run prints at its end against what its log says of every tick, and that against what a hand knows of the run.
namespace medulla {
namespace {

struct Log {
  explicit Log(const std::string& path) : table(readLog(path)) {}
  std::vector<double> column(const std::string& name) const {
    const std::size_t place = columnOf(table, name);
    EXPECT_LT(place, table.columns.size()) << name;
    std::vector<double> out;
    for (const std::vector<double>& row : table.value) out.push_back(row.at(place));
    return out;
  }
  // N on the hand, per row.
  std::vector<Eigen::Vector3d> force(const std::string& tool) const {
    const std::vector<double> x = column(tool + ".force.x"), y = column(tool + ".force.y"),
                              z = column(tool + ".force.z");
    std::vector<Eigen::Vector3d> out;
    for (std::size_t k = 0; k < x.size(); ++k) out.emplace_back(x[k], y[k], z[k]);
    return out;
  }
  LogTable table;
};

double least(const std::vector<double>& values) {
  return *std::min_element(values.begin(), values.end());
}
double most(const std::vector<double>& values) {
  return *std::max_element(values.begin(), values.end());
}
double longest(const std::vector<Eigen::Vector3d>& vectors) {
  double out = 0;
  for (const Eigen::Vector3d& v : vectors) out = std::max(out, v.norm());
  return out;
}
double sum(const std::vector<double>& values) {
  double out = 0;
  for (const double v : values) out += v;
  return out;
}

// A probe that starts inside of one body, is pushed out and presses again, and a grasper that tears another one until
// it slips; a third body stands between.
class RunResults : public testing::Test {
 protected:
  RunResults() {
    const auto body = [](const char* name, double x) {
      return fmt::format(
          "<body name=\"{}\" tissue=\"t\" look=\"liver\" position=\"{} 0 0\" model=\"{}/assets/gallbladder/"
          "gallbladder.model.xml\"><fix spheres=\"1 2 4 5\"/></body>\n",
          name, x, MEDULLA_SOURCE_DIR);
    };
    folder.write(
        "scene.xml",
        "<scene name=\"s\"><clock duration=\"0.8\" dynamics=\"200\"/><dynamics gravity=\"0 0 0\"/>\n"
        "<tissue name=\"t\" young=\"5e3\"/>\n" +
            body("pressed", 0) + body("still", 0.6) + body("pulled", 0.3) +
            "<tool name=\"probe\" trajectory=\"probe.csv\" force_max=\"0.1\"/>\n"
            "<tool name=\"grasper\" trajectory=\"grasper.csv\" grip_radius=\"0.009\" grip_force_max=\"0.2\"/>\n"
            "<camera position=\"0 0 1\" target=\"0 0 0\"/></scene>\n");
    writeMotion("probe.csv", -0.0525, {{0, 0.019, 0}, {0.1, 0.04, 0}, {0.5, 0.016, 0}, {0.8, 0.04, 0}});
    writeMotion("grasper.csv", 0.2475, {{0, 0.03, 0}, {0.3, 0.019, 0}, {0.35, 0.017, 1}, {0.6, 0.1, 1}, {0.8, 0.1, 1}});
    writeMotion("slow.csv", -0.0525, {{0, 0.03, 0}, {2, 0.016, 0}, {3, 0.016, 0}});
    writeMotion("away.csv", -0.9, {{0, 0.03, 0}, {3, 0.03, 0}});
  }
  struct Key {
    double time, z, grip;
  };
  void writeMotion(const std::string& name, double x, const std::vector<Key>& keys) const {
    std::string text = "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n";
    for (const Key& k : keys) text += fmt::format("{},{},-0.0385,{},1,0,0,0,{}\n", k.time, x, k.z, k.grip);
    folder.write(name, text);
  }
  ProgramResult replay(std::vector<std::string> options) const {
    options.insert(options.begin(), {"replay", folder / "scene.xml"});
    ProgramResult r = runProgram(options);
    EXPECT_EQ(r.exitCode, 0) << r.err;
    return r;
  }
  TemporaryFolder folder;
};

TEST_F(RunResults, AreWhatTheLogSaysOfEveryTick) {
  const ProgramResult r = replay({"--log", folder / "log.csv", "--log-rate", "tick"});
  const Log log(folder / "log.csv");
  ASSERT_EQ(log.table.value.size(), 960u);
  double clamped = 0, slips = 0, energy = 0, force = 0;
  for (const std::string tool : {"probe", "grasper"}) {
    clamped += sum(log.column(tool + ".clamped"));
    const std::vector<double> slipped = log.column(tool + ".slipped");
    for (std::size_t k = 1; k < slipped.size(); ++k) slips += slipped[k] > slipped[k - 1];
    energy = std::max(energy, most(log.column(tool + ".energy")));
    force = std::max(force, longest(log.force(tool)));
  }
  EXPECT_GT(clamped, 20);
  EXPECT_EQ(slips, 1);
  EXPECT_GT(sum(log.column("grasper.slipped")), 100);  // a tick of slipping is not a slip
  EXPECT_GT(energy, 1e-4);
  EXPECT_GT(force, 0.15);
  EXPECT_LT(force, 0.2);
  EXPECT_NEAR(longest(log.force("probe")), 0.1, 1e-12);
  EXPECT_EQ(valueOf(r.out, "force_clamped"), fmt::format("{} ticks", clamped));
  EXPECT_EQ(valueOf(r.out, "grip_slips"), fmt::format("{}", slips));
  EXPECT_EQ(valueOf(r.out, "user_energy_max"), fmt::format("{:.4g} J", energy));
  EXPECT_EQ(valueOf(r.out, "force_max"), fmt::format("{:.5g} N", force));
  EXPECT_EQ(valueOf(r.out, "ticks"), "960");
}

// Now the first body changes its volume most, now the last one alone.
TEST_F(RunResults, VolumesAreThoseOfEachBodyByItself) {
  for (const char* probe : {"probe.csv", "away.csv"}) {
    const ProgramResult r = replay({"--log", folder / "log.csv", "--trajectory", "probe=" + (folder / probe)});
    const Log log(folder / "log.csv");
    const std::vector<double> pressed = log.column("pressed.volume_ratio"), still = log.column("still.volume_ratio"),
                              pulled = log.column("pulled.volume_ratio");
    const bool isPressed = std::string(probe) == "probe.csv";
    EXPECT_NEAR(least(still), 1, 1e-9);
    EXPECT_NEAR(most(still), 1, 1e-9);
    EXPECT_EQ(least(pressed) < 0.999, isPressed);
    EXPECT_LT(least(pulled), 0.999);
    EXPECT_GT(most(pulled), 1.001);
    EXPECT_EQ(valueOf(r.out, "volume_ratio_min"),
              fmt::format("{:.5g}", std::min({1.0, least(pressed), least(still), least(pulled)})));
    EXPECT_EQ(valueOf(r.out, "volume_ratio_max"),
              fmt::format("{:.5g}", std::max({1.0, most(pressed), most(still), most(pulled)})));
  }
}

// A frame's mismatch is in percent of what the hand got in it; weighted so, frames make up the run's.
TEST_F(RunResults, TheMismatchOfImpulsesIsThatOfItsFramesAndSmallWhereAToolPressesSlowly) {
  const ProgramResult r =
      replay({"--log", folder / "log.csv", "--log-rate", "tick", "--set", "clock.duration=3", "--trajectory",
              "probe=" + (folder / "slow.csv"), "--trajectory", "grasper=" + (folder / "away.csv")});
  const Log log(folder / "log.csv");
  const std::vector<double> mismatch = log.column("impulse_mismatch");
  const std::vector<Eigen::Vector3d> force = log.force("probe");
  constexpr std::size_t kTicks = 6;  // of a frame
  ASSERT_EQ(mismatch.size(), 3 * 200 * kTicks);
  double different = 0, whole = 0;
  for (std::size_t first = 0; first < mismatch.size(); first += kTicks) {
    Eigen::Vector3d impulse = Eigen::Vector3d::Zero();
    for (std::size_t k = first; k < first + kTicks; ++k) impulse += force[k];
    different += mismatch[first] * impulse.norm();
    whole += impulse.norm();
  }
  const double told = std::stod(valueOf(r.out, "impulse_mismatch"));
  EXPECT_GT(told, 0.01);
  EXPECT_LT(told, 10);
  EXPECT_NEAR(told, different / whole, 1e-3 * told);
  EXPECT_GT(std::stod(valueOf(r.out, "force_max")), 0.03);
}

// Without a tool neither the servo nor the surface that it touches has anything to do.
TEST_F(RunResults, FrameTimesStandInTheirOwnColumns) {
  folder.write("alone.xml", fmt::format("<scene name=\"s\"><clock duration=\"0.4\"/><dynamics substeps=\"400\"/>\n"
                                        "<tissue name=\"t\"/><body name=\"b\" tissue=\"t\" look=\"liver\" model=\"{}/"
                                        "assets/gallbladder/gallbladder.model.xml\"><fix spheres=\"1\"/></body>\n"
                                        "<camera position=\"0 0 1\" target=\"0 0 0\"/></scene>\n",
                                        MEDULLA_SOURCE_DIR));
  const ProgramResult r = runProgram({"replay", folder / "alone.xml", "--frame-times", folder / "times.csv"});
  ASSERT_EQ(r.exitCode, 0) << r.err;
  const Log times(folder / "times.csv");
  EXPECT_EQ(times.table.columns, (std::vector<std::string>{"t", "servo", "dynamics", "surface"}));
  ASSERT_EQ(times.table.value.size(), 20u);
  EXPECT_GT(sum(times.column("dynamics")), 0);
  EXPECT_GT(sum(times.column("dynamics")), sum(times.column("servo")) + sum(times.column("surface")));
}

}  // namespace
}  // namespace medulla
