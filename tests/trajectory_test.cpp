#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "app/files/trajectory_file.h"
#include "haptics/tool_input.h"
#include "tests/complaint.h"
#include "tests/temporary_folder.h"

namespace medulla {

static const std::string header = "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n";

static std::string complaintAbout(const std::string& text) {
  return complaintOf([&] { parseTrajectory(text, "file.csv"); });
}

static void expectComplaint(const std::string& text, const std::string& start, const std::string& part) {
  const std::string complaint = complaintAbout(text);
  EXPECT_EQ(complaint.rfind(start, 0), 0U) << complaint;
  EXPECT_NE(complaint.find(part), std::string::npos) << complaint;
}

TEST(TrajectoryFile, ReadsRowsCommentsAndForeignLineEnds) {
  const Trajectory trajectory = parseTrajectory(
      "# made by hand\r\n" + header + "0, 0.1,-0.2,3e-1, 1,0,0,0, 0 # start\r\n\r\n0.5,0,0,0,0.9995,0,0,0,1",
      "file.csv");
  ASSERT_EQ(trajectory.samples.size(), 2U);
  EXPECT_EQ(trajectory.samples[0].position, Eigen::Vector3d(0.1, -0.2, 0.3));
  EXPECT_EQ(trajectory.samples[1].time, 0.5);
  EXPECT_EQ(trajectory.samples[1].grip, 1);
  EXPECT_NEAR(trajectory.samples[1].worldFromTool.w(), 1, 1e-15);
}

// As spreadsheets write it.
TEST(TrajectoryFile, AMarkBeforeTheFirstLineIsNoPartOfIt) {
  const TemporaryFolder folder;
  folder.write("marked.csv", "\xef\xbb\xbf" + header + "0,0.1,0,0,1,0,0,0,0\n");
  EXPECT_EQ(readTrajectory(folder / "marked.csv").samples.size(), 1U);
}

TEST(TrajectoryFile, AnotherEncodingIsNamed) {
  const TemporaryFolder folder;
  folder.write("wide.csv", std::string("\xff\xfet\0[\0", 6));
  try {
    readTrajectory(folder / "wide.csv");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(error.what(), folder / "wide.csv" + ": is written in UTF-16, expected UTF-8 or ASCII");
  }
}

TEST(TrajectoryFile, ReadsMeasuredForces) {
  const Trajectory trajectory = parseTrajectory(
      "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip,fx[N],fy[N],fz[N]\n"
      "1,0,0,0,1,0,0,0,0,1,2,3\n3,0,0,0,1,0,0,0,0,2,2,-3\n",
      "file.csv");
  ASSERT_EQ(trajectory.samples.size(), 2U);
  EXPECT_EQ(measuredForceAt(trajectory, 1), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(measuredForceAt(trajectory, 1.5), Eigen::Vector3d(1.25, 2, 1.5));
  EXPECT_EQ(measuredForceAt(trajectory, 3), Eigen::Vector3d(2, 2, -3));
  EXPECT_FALSE(measuredForceAt(trajectory, 0.99));
  EXPECT_FALSE(measuredForceAt(trajectory, 3.01));
  EXPECT_FALSE(measuredForceAt(parseTrajectory(header + "0,0,0,0,1,0,0,0,0\n", "file.csv"), 0));
}

// What is written is read back to the bit, quaternions that are unit up to rounding among it.
TEST(TrajectoryFile, ReadsBackWhatItWrites) {
  const TemporaryFolder folder;
  std::vector<ToolSample> samples(200);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const double t = double(k) / 1200;
    samples[k].time = t;
    samples[k].position = {std::sin(t), 0.1 * t, -std::cos(t) / 3};
    samples[k].worldFromTool = Eigen::Quaterniond(std::cos(t), std::sin(3 * t), t, 0.3 * t).normalized();
    samples[k].grip = std::abs(std::sin(t));
  }
  TrajectoryFile file(folder / "record.csv");
  for (const ToolSample& sample : samples) file.write(sample, sample.position / 7);
  file.commit();
  const Trajectory read = readTrajectory(folder / "record.csv");
  ASSERT_EQ(read.samples.size(), samples.size());
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const ToolSample at = sampleTrajectory(read, samples[k].time);
    EXPECT_EQ(at.time, samples[k].time);
    EXPECT_EQ(at.position, samples[k].position);
    EXPECT_EQ(at.worldFromTool.coeffs(), samples[k].worldFromTool.coeffs());
    EXPECT_EQ(at.grip, samples[k].grip);
    EXPECT_EQ(read.measuredForces[k], samples[k].position / 7);
  }
}

TEST(TrajectoryFile, EveryMistakeIsNamedWithItsLine) {
  const std::string good = "0,0,0,0,1,0,0,0,0\n";
  expectComplaint("", "file.csv: ", "no header");
  expectComplaint("# nothing\n", "file.csv: ", "no header");
  expectComplaint(header, "file.csv: ", "no rows");
  expectComplaint("t[s],x[m],y[m],z[m],qw,qx,qy,qz\n" + good, "file.csv:1: ", "column grip is missing");
  expectComplaint("t[s],y[m],x[m],z[m],qw,qx,qy,qz,grip\n" + good, "file.csv:1: ", "column 2 is 'y[m]'");
  expectComplaint("t[s],\x1b[31m,y[m],x[m],z[m],qw,qx,qy,qz,grip\n" + good, "file.csv:1: ", "column 2 is '?[31m'");
  expectComplaint("t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip,colour\n" + good, "file.csv:1: ", "'colour'");
  expectComplaint("t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip,fx[N]\n" + good, "file.csv:1: ", "10 columns");
  expectComplaint("t[s];x[m];y[m];z[m];qw;qx;qy;qz;grip\n",
                  "file.csv:1: ", "columns are separated by semicolons, expected commas");
  expectComplaint("t[s]\tx[m]\ty[m]\tz[m]\tqw\tqx\tqy\tqz\tgrip\n", "file.csv:1: ", "separated by tabs");
  expectComplaint("0,0,0,0,1,0,0,0,0\n" + good, "file.csv:1: ", "column t[s] is missing");
  expectComplaint("stamp,px,py\n" + good,
                  "file.csv:1: ", "expected t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip: a <recording>");
  expectComplaint("t[s],x[mm],y[mm],z[mm],qw,qx,qy,qz,grip\n" + good,
                  "file.csv:1: ", "column x[m] is missing, found 'x[mm]': a <recording>");
  expectComplaint("t[ms],x[m],y[m],z[m],qw,qx,qy,qz,grip\n" + good, "file.csv:1: ", "found 't[ms]': a <recording>");
  expectComplaint(header + "0,0,0,0,1,0,0,0\n", "file.csv:2: ", "8 columns");
  expectComplaint(header + good + "1,0,nan,0,1,0,0,0,0\n", "file.csv:3: ", "column y[m] is 'nan'");
  expectComplaint(header + good + "1,0,inf,0,1,0,0,0,0\n", "file.csv:3: ", "column y[m] is 'inf'");
  expectComplaint(header + "0,0,1e999,0,1,0,0,0,0\n", "file.csv:2: ", "column y[m] is '1e999'");
  expectComplaint(header + "0,0,zero,0,1,0,0,0,0\n", "file.csv:2: ", "'zero'");
  expectComplaint(header + "0,0,0.1x,0,1,0,0,0,0\n", "file.csv:2: ", "'0.1x'");
  expectComplaint(header + "0,0,,0,1,0,0,0,0\n", "file.csv:2: ", "column y[m] is ''");
  expectComplaint(header + "0,0,0,300,1,0,0,0,0\n", "file.csv:2: ", "position z is 300 m");
  expectComplaint(header + good + good, "file.csv:3: ", "strictly increasing");
  expectComplaint(header + good + "-1,0,0,0,1,0,0,0,0\n", "file.csv:3: ", "strictly increasing");
  expectComplaint(header + "1e10,0,0,0,1,0,0,0,0\n", "file.csv:2: ", "time is 10000000000 s");
  expectComplaint(header + "1700000000.25,0,0,0,1,0,0,0,0\n",
                  "file.csv:2: ", "a <recording> that names this file takes");
  expectComplaint(header + good + "1,0,0,0,1.0011,0,0,0,0\n", "file.csv:3: ", "length 1.0011");
  expectComplaint(header + "0,0,0,0,0.9,0,0,0,0\n", "file.csv:2: ", "length 0.9");
  expectComplaint(header + "0,0,0,0,0,0,0,0,0\n", "file.csv:2: ", "length 0");
  expectComplaint(header + "0,0,0,0,1,0,0,0,1.5\n", "file.csv:2: ", "column grip is 1.5");
}

TEST(TrajectoryFile, LinesEndAsAnyComputerWritesThem) {
  const std::string rows = "\n0,0,0,0,1,0,0,0,0\n\n# a tool\n1,2,0,0,1,0,0,0,0\n";
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    std::string text = header.substr(0, header.size() - 1);
    for (const char c : rows) {
      if (c == '\n')
        text += end;
      else
        text += c;
    }
    const Trajectory read = parseTrajectory(text, "file.csv");
    ASSERT_EQ(read.samples.size(), 2u);
    EXPECT_EQ(read.samples[1].position.x(), 2);
    text += "1,0,0,0,1,0,0,0,0";
    expectComplaint(text, "file.csv:6: ", "strictly increasing");
  }
}

TEST(TrajectoryFile, MissingFilesAndFoldersAreRefused) {
  EXPECT_THROW(readTrajectory("/no/such/file.csv"), std::runtime_error);
  EXPECT_THROW(readTrajectory(std::filesystem::temp_directory_path().string()), std::runtime_error);
}

static Trajectory keys(const std::vector<std::pair<double, double>>& timeAndX) {
  Trajectory trajectory;
  for (const auto& [time, x] : timeAndX) {
    ToolSample sample;
    sample.time = time;
    sample.position = {x, 2 * x, 0.3};
    trajectory.samples.push_back(sample);
  }
  return trajectory;
}

static double xAt(const Trajectory& trajectory, double time) {
  return sampleTrajectory(trajectory, time).position.x();
}

TEST(Trajectory, PassesThroughItsKeysAndStandsStillOutside) {
  const Trajectory trajectory = keys({{1, 0.1}, {1.5, 0.4}, {4, -0.2}});
  EXPECT_EQ(xAt(trajectory, 0), 0.1);
  for (const ToolSample& key : trajectory.samples) EXPECT_NEAR(xAt(trajectory, key.time), key.position.x(), 1e-15);
  EXPECT_EQ(xAt(trajectory, 9), -0.2);
  EXPECT_EQ(sampleTrajectory(trajectory, 2.5).time, 2.5);
}

TEST(Trajectory, NeverLeavesTheRangeOfItsTwoKeysAndRestsBetweenEqualOnes) {
  const Trajectory trajectory = keys({{0, 0}, {0.1, 0.5}, {1.3, 0.5}, {1.4, 0.2}, {3, 0.21}, {3.01, 1}});
  for (std::size_t k = 0; k + 1 < trajectory.samples.size(); ++k) {
    const ToolSample &a = trajectory.samples[k], &b = trajectory.samples[k + 1];
    for (int i = 0; i <= 50; ++i) {
      const double x = xAt(trajectory, a.time + (b.time - a.time) * i / 50.0);
      EXPECT_GE(x, std::min(a.position.x(), b.position.x()) - 1e-15);
      EXPECT_LE(x, std::max(a.position.x(), b.position.x()) + 1e-15);
    }
  }
  EXPECT_EQ(xAt(trajectory, 0.7), 0.5);
}

TEST(Trajectory, HasNoVelocityStepAtUnevenKeys) {
  const Trajectory trajectory = keys({{0, 0}, {0.4, 0.1}, {0.5, 0.2}, {1.5, 0.3}, {2, 0.9}});
  const double h = 1e-6;
  for (const double key : {0.0, 0.4, 0.5, 1.5, 2.0}) {
    const double before = (xAt(trajectory, key) - xAt(trajectory, key - h)) / h,
                 after = (xAt(trajectory, key + h) - xAt(trajectory, key)) / h;
    EXPECT_NEAR(before, after, 1e-4);
  }
}

TEST(Trajectory, ADenseRecordingIsReproduced) {
  std::vector<std::pair<double, double>> recording;
  for (int k = 0; k <= 1000; ++k) recording.emplace_back(k * 0.01, std::sin(k * 0.01));
  const Trajectory trajectory = keys(recording);
  for (int k = 0; k < 719; ++k) {
    const double t = 0.05 + 0.0137 * k;
    EXPECT_NEAR(xAt(trajectory, t), std::sin(t), 1e-5);
  }
}

static Eigen::Quaterniond turned(double angle, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
}

TEST(Trajectory, TurnsTheShortWayAsItMovesAndClosesLinearly) {
  Trajectory trajectory = keys({{0, 0}, {2, 1}});
  trajectory.samples[1].worldFromTool = Eigen::Quaterniond(-turned(1, {0, 0, 1}).coeffs());
  trajectory.samples[1].grip = 1;
  for (const double t : {0.1, 0.5, 1.3, 1.9}) {
    const ToolSample sample = sampleTrajectory(trajectory, t);
    EXPECT_NEAR(sample.worldFromTool.angularDistance(Eigen::Quaterniond::Identity()), sample.position.x(), 1e-7);
    EXPECT_NEAR(sample.worldFromTool.norm(), 1, 1e-15);
    EXPECT_NEAR(sample.grip, t / 2, 1e-15);
  }
}

// The angle about one axis goes the cubic's way through uneven keys, without overshoot; equal keys rest to the bit.
TEST(Trajectory, TurnsAboutAnAxisLikeThePositionAlongOne) {
  Trajectory trajectory = keys({{0, 0}, {0.4, 0.5}, {0.5, 0.9}, {1.5, 0.9}, {2, -0.4}, {3, -0.3}});
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, -2) / 3;
  for (ToolSample& key : trajectory.samples) key.worldFromTool = turned(key.position.x(), axis);
  trajectory.samples[3].worldFromTool = trajectory.samples[2].worldFromTool;
  for (int i = 0; i <= 300; ++i) {
    const ToolSample sample = sampleTrajectory(trajectory, 0.01 * i);
    // Per axis of the tool's frame the same limits act on the same secants, scaled.
    EXPECT_LT((sample.worldFromTool.vec() - turned(sample.position.x(), axis).vec()).norm(), 1e-12) << i;
  }
  EXPECT_EQ(sampleTrajectory(trajectory, 1.1).worldFromTool.coeffs(), trajectory.samples[2].worldFromTool.coeffs());
}

TEST(Trajectory, HasNoStepOfAngularVelocityAtItsKeys) {
  Trajectory trajectory = keys({{0, 0}, {0.4, 0}, {0.5, 0}, {1.5, 0}, {2, 0}});
  const double angles[] = {0, 0.7, 1.3, 2.4, 2.9};
  for (int k = 0; k < 5; ++k) trajectory.samples[k].worldFromTool = turned(angles[k], {1, 0.5 + 0.2 * k, -0.4 * k});
  const auto velocity = [&](double a, double b) {
    const Eigen::AngleAxisd turn(sampleTrajectory(trajectory, a).worldFromTool.conjugate() *
                                 sampleTrajectory(trajectory, b).worldFromTool);
    return Eigen::Vector3d(turn.angle() / (b - a) * turn.axis());
  };
  const double h = 1e-5;
  for (const double key : {0.4, 0.5, 1.5}) {
    const Eigen::Vector3d before = velocity(key - h, key), after = velocity(key, key + h);
    EXPECT_GT(before.norm(), 0.2);
    EXPECT_LT((after - before).norm(), 1e-2 * before.norm());
  }
}

TEST(Trajectory, EndsWhereNothingChangesAnyMore) {
  EXPECT_EQ(motionEnd(keys({{1, 0}})), 1);
  EXPECT_EQ(motionEnd(keys({{1, 0}, {2, 0}, {3, 0.1}})), 3);
  EXPECT_EQ(motionEnd(keys({{1, 0}, {2, 0.1}, {3, 0.1}, {4, 0.1}})), 2);
  Trajectory trajectory = keys({{1, 0}, {2, 0.1}, {3, 0.1}, {4, 0.1}});
  trajectory.samples[2].grip = 1;
  EXPECT_EQ(motionEnd(trajectory), 4);
}

}  // namespace medulla
