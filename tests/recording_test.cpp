#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "app/files/recording_file.h"
#include "tests/complaint.h"
#include "tests/temporary_folder.h"
#include "tests/tool_run.h"

namespace medulla {

using Eigen::Quaterniond, Eigen::Vector3d;

class Recording : public testing::Test {
 protected:
  // `inside`: what stands in <recording file="r.txt" ...> after the file.
  Trajectory read(const std::string& attributes, const std::string& inside, const std::string& text) const {
    folder.write("r.xml", fmt::format("<recording file=\"r.txt\" {}>\n{}\n</recording>\n", attributes, inside));
    folder.write("r.txt", text);
    return readRecording(readRecordingMap(folder / "r.xml"));
  }
  std::string complaint(const std::string& attributes, const std::string& inside, const std::string& text) const {
    return complaintOf([&] { read(attributes, inside, text); }, folder.path());
  }
  TemporaryFolder folder;
};

// Two rows of 76 columns; every arm somewhere else, the slave's right turned about z by 90 degrees.
static std::string jigsawsRow(double move) {
  std::string row;
  for (int arm = 0; arm < 4; ++arm)
    row += fmt::format("   {:.6f} {:.6f} {:.6f}  0 -1 0  1 0 0  0 0 1  9 9 9  9 9 9  {:.6f} ", 0.1 * arm + move,
                       0.2 * arm, -0.01 * arm, arm == 3 ? 1 - 10 * move : 9.0);
  return row + "\n";
}

TEST_F(Recording, JigsawsHasNinetenColumnsPerArmAndNoTime) {
  const Trajectory t =
      read("map=\"jigsaws\" part=\"slave_right\"", "", jigsawsRow(0) + jigsawsRow(0.04) + jigsawsRow(0.1));
  ASSERT_EQ(t.samples.size(), 3u);
  EXPECT_EQ(t.samples[1].time, 1.0 / 30);
  EXPECT_NEAR((t.samples[1].position - Vector3d(0.34, 0.6, -0.03)).norm(), 0, 1e-15);
  const Quaterniond quarter(std::sqrt(0.5), 0, 0, std::sqrt(0.5));
  EXPECT_LT(t.samples[0].worldFromTool.angularDistance(quarter), 1e-7);
  // Open at 1 rad, closing at 0.2, and no more than closed beyond.
  EXPECT_EQ(t.samples[0].grip, 0);
  EXPECT_NEAR(t.samples[1].grip, 0.25, 1e-12);
  EXPECT_NEAR(t.samples[2].grip, 0.625, 1e-12);
  EXPECT_TRUE(t.measuredForces.empty());
  EXPECT_EQ(read("map=\"jigsaws\" part=\"master_right\"", "", jigsawsRow(0)).samples[0].position.x(), 0.1);
  EXPECT_EQ(read("map=\"jigsaws\" part=\"master_right\"", "<columns rate=\"60\"/>", jigsawsRow(0) + jigsawsRow(1))
                .samples[1]
                .time,
            1.0 / 60);
}

TEST_F(Recording, TimesAreInAnyUnit) {
  for (const auto& [unit, seconds] : {std::pair("s", 1.0), {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}}) {
    const std::string inside = fmt::format("<columns time=\"1\" position=\"2 3 4\"/><units time=\"{}\"/>", unit);
    const std::string text = fmt::format("{} 0 0 0\n{} 1 0 0\n", std::lround(2 / seconds), std::lround(5 / seconds));
    const Trajectory t = read("", inside, text);
    ASSERT_EQ(t.samples.size(), 2u);
    EXPECT_NEAR(t.samples[1].time - t.samples[0].time, 3, 1e-9) << unit;
  }
}

TEST_F(Recording, SofaWritesStatesOfOneRigid) {
  const std::string text =
      "# written by WriteState\nT= 0.5\n  X0= 1 2 3 0 0 0 1 \n  X= 10 20 30 0 0 0 1 \n  V= 0 0 0 0 0 0\n"
      "T= 0.75\n  X= 11 20 30 0.70711 0 0 0.70711\n";
  const Trajectory t = read("map=\"sofa\"", "<units length=\"mm\"/>", text);
  ASSERT_EQ(t.samples.size(), 2u);
  EXPECT_EQ(t.samples[1].time, 0.25);
  EXPECT_NEAR((t.samples[1].position - Vector3d(0.011, 0.02, 0.03)).norm(), 0, 1e-15);
  EXPECT_LT(t.samples[1].worldFromTool.angularDistance(Quaterniond(std::sqrt(0.5), std::sqrt(0.5), 0, 0)), 1e-7);
}

TEST_F(Recording, RosPosesOfThreeProgramsAreTheSame) {
  const std::string echo =
      "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.pose.position.x,field.pose.position.y,"
      "field.pose.position.z,field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,"
      "field.pose.orientation.w\n"
      "1700000000600000000,1,1700000000500000000,base,0.1,0.2,0.3,0,0,0,1\n"
      "1700000000800000000,2,1700000000750000000,base,0.1,0.2,0.4,0,1,0,0\n";
  const std::string bag =
      "Time,header.seq,header.stamp.secs,header.stamp.nsecs,header.frame_id,pose.position.x,pose.position.y,"
      "pose.position.z,pose.orientation.x,pose.orientation.y,pose.orientation.z,pose.orientation.w\n"
      "1700000000.6,1,1700000000,500000000,base,0.1,0.2,0.3,0,0,0,1\n"
      "1700000000.8,2,1700000000,750000000,base,0.1,0.2,0.4,0,1,0,0\n";
  const std::string second =
      "1700000000,500000000,base,0.1,0.2,0.3,0,0,0,1\n1700000000,750000000,base,0.1,0.2,0.4,0,1,0,0\n";
  for (const std::string& text : {echo, bag, second}) {
    const Trajectory t = read("map=\"ros\"", "", text);
    ASSERT_EQ(t.samples.size(), 2u);
    EXPECT_EQ(t.samples[0].time, 0);
    EXPECT_NEAR(t.samples[1].time, 0.25, 1e-6);
    EXPECT_EQ(t.samples[1].position, Vector3d(0.1, 0.2, 0.4));
    EXPECT_EQ(t.samples[1].worldFromTool.coeffs(), Quaterniond(0, 0, 1, 0).coeffs());
  }
}

TEST_F(Recording, ColumnsByNameOrNumberWithUnitsSeparatorsAndForces) {
  const std::string inside =
      "<columns time=\"stamp\" position=\"px py 4\" quaternion=\"qw qx qy qz\" grip=\"jaw\" force=\"10 11 12\"/>"
      "<units length=\"micron\" time=\"ms\"/><grip open=\"60\" closes=\"20\"/>";
  const std::string comma =
      "stamp,px,py,pz,qw,qx,qy,qz,jaw,a,b,c\n5,1000,2000,3000,1,0,0,0,60,1,2,3\n15,1000,2000,4000,1,0,0,0,10,4,5,6\n";
  std::string semicolon = comma, blank = comma, tab = comma;
  std::replace(semicolon.begin(), semicolon.end(), ',', ';');
  std::replace(blank.begin(), blank.end(), ',', ' ');
  std::replace(tab.begin(), tab.end(), ',', '\t');
  const std::string commented = "# recorded 2026-01-02, lab 3; metres\n" + blank, late = "\r\n# t x y z; m\n" + comma;
  for (const std::string& text : {comma, semicolon, blank, tab, commented, late}) {
    const Trajectory t = read("", inside, text);
    ASSERT_EQ(t.samples.size(), 2u);
    EXPECT_NEAR(t.samples[1].time, 0.01, 1e-15);
    EXPECT_NEAR((t.samples[1].position - Vector3d(0.001, 0.002, 0.004)).norm(), 0, 1e-15);
    EXPECT_EQ(t.samples[0].grip, 0);
    EXPECT_NEAR(t.samples[1].grip, 0.625, 1e-12);
    ASSERT_EQ(t.measuredForces.size(), 2u);
    EXPECT_EQ(t.measuredForces[1], Vector3d(4, 5, 6));
  }
  const std::string plain = "<columns rate=\"100\" position=\"1 2 3\"/><units length=\"inch\"/>";
  EXPECT_NEAR(read("", plain, "1 2 3\n").samples[0].position.z(), 0.0762, 1e-15);
}

TEST_F(Recording, TheFrameMirrorsScalesTurnsAndMoves) {
  // A left-handed recording, z turned over: at (1, 2, 3) cm, a quarter turn about its y.
  const std::string inside =
      "<columns rate=\"10\" position=\"1 2 3\" quaternion=\"4 5 6 7\" force=\"8 9 10\"/><units length=\"cm\"/>"
      "<frame mirror=\"z\" scale=\"2\" orientation=\"0.7071 0.7071 0 0\" position=\"0 0 1\" tool=\"0 1 0 0\"/>";
  const Trajectory t = read("", inside, "1 2 3 0.7071067811865476 0 0.7071067811865476 0 0 0 5\n");
  // Mirrored (1, 2, -3), twice as large (2, 4, -6), a quarter turn about x takes y to z and z to -y.
  EXPECT_LT((t.samples[0].position - Vector3d(0.02, 0.06, 1.04)).norm(), 1e-12);
  // As matrices: R M A M T, with a reflection M.
  const Eigen::Matrix3d mirror = Vector3d(1, 1, -1).asDiagonal();
  const auto matrix = [](double w, double x, double y, double z) {
    return Quaterniond(w, x, y, z).normalized().toRotationMatrix();
  };
  const Eigen::Matrix3d expected = matrix(1, 1, 0, 0) * mirror * matrix(1, 0, 1, 0) * mirror * matrix(0, 1, 0, 0);
  EXPECT_LT((t.samples[0].worldFromTool.toRotationMatrix() - expected).norm(), 1e-12);
  EXPECT_LT((t.measuredForces[0] - Vector3d(0, 5, 0)).norm(), 1e-12);
}

TEST_F(Recording, ASpanIsCutOutAndPlayedWithADelay) {
  std::string text;
  for (int k = 0; k < 10; ++k) text += fmt::format("{} 0 0\n", 0.01 * k);
  const Trajectory t =
      read("", "<columns rate=\"10\" position=\"1 2 3\"/><span from=\"0.2\" to=\"0.61\" delay=\"1.5\"/>", text);
  ASSERT_EQ(t.samples.size(), 5u);
  EXPECT_NEAR(t.samples[0].time, 1.5, 1e-12);
  EXPECT_NEAR(t.samples[0].position.x(), 0.02, 1e-15);
  EXPECT_NEAR(t.samples[4].time, 1.9, 1e-12);
  EXPECT_NE(complaint("", "<columns rate=\"10\" position=\"1 2 3\"/>\n<span from=\"3\"/>", text).find("0.9 s long"),
            std::string::npos);
}

// Doubles tell times since 1970 apart by a quarter of a microsecond: 0.1 s later is 0.0999999 s later to them, 0.3 s
// later 0.3000002.
TEST_F(Recording, ASpanHoldsTheRowsAtItsEndsWhereverTimeBegins) {
  const auto played = [this](const char* span, const char* rows) {
    return read("", fmt::format("<columns time=\"1\" position=\"2 3 4\"/><span {}/>", span), rows).samples;
  };
  const char* rows = "1700000000.4,0,0,0\n1700000000.5,1,0,0\n1700000000.6,2,0,0\n1700000000.7,3,0,0\n";
  EXPECT_EQ(played("from=\"0.1\"", rows).size(), 3u);
  EXPECT_EQ(played("from=\"0.2\"", rows).size(), 2u);
  EXPECT_NEAR(played("from=\"0.1\"", rows)[0].time, 0, 1e-6);
  EXPECT_EQ(played("to=\"0.3\"", "1700000000.1,0,0,0\n1700000000.4,1,0,0\n1700000000.5,2,0,0\n").size(), 2u);
}

// A window wider than the tremor's period takes it out, keeps a steady motion and both ends, and delays nothing.
TEST_F(Recording, SmoothingTakesOutTremorAndNothingElse) {
  std::string text;
  const double tremor = 0.0005;
  for (int k = 0; k <= 120; ++k) {
    const double t = k / 60.0, s = tremor * std::sin(2 * std::numbers::pi * 10 * t), a = 0.1 * t + s;
    text += fmt::format("{:.12g} {:.12g} 0 {:.12g} 0 0 {:.12g}\n", 0.05 * t, s, std::cos(a), std::sin(a));
  }
  const Trajectory t =
      read("", "<columns rate=\"60\" position=\"1 2 3\" quaternion=\"4 5 6 7\"/><span smooth=\"0.2\"/>", text);
  EXPECT_NEAR(t.samples.front().position.x(), 0, 1e-15);
  EXPECT_NEAR(t.samples.back().position.x(), 0.1, 1e-15);
  for (std::size_t k = 12; k + 12 < t.samples.size(); ++k) {
    const ToolSample& sample = t.samples[k];
    EXPECT_NEAR(sample.position.x(), 0.05 * sample.time, 1e-12);
    EXPECT_LT(std::abs(sample.position.y()), 0.02 * tremor);
    EXPECT_NEAR(2 * std::atan2(sample.worldFromTool.z(), sample.worldFromTool.w()), 0.2 * sample.time, 0.04 * tremor);
  }
}

// 2 s and less 1e-20 s are one number: no row would be inside.
TEST_F(Recording, SmoothingByLessThanTimesTellChangesNothing) {
  const Trajectory t = read("", "<columns time=\"1\" position=\"2 3 4\"/><span smooth=\"1e-20\"/>",
                            "0 0 0 0\n1 1 0 0\n2 5 0 0\n3 2 0 0\n");
  ASSERT_EQ(t.samples.size(), 4u);
  EXPECT_EQ(t.samples[2].position, Eigen::Vector3d(5, 0, 0));
}

TEST_F(Recording, EveryMistakeInTheFileIsNamedWithItsRow) {
  const std::string xyz = "<columns rate=\"10\" position=\"1 2 3\"/>", ros = "map=\"ros\"", sofa = "map=\"sofa\"";
  const std::string named = "<columns time=\"t\" position=\"x y z\"/>";
  const std::string quaternion = "<columns time=\"1\" position=\"2 3 4\" quaternion=\"5 6 7 8\"/>";
  const std::string matrix = "<columns rate=\"9\" position=\"1 2 3\" matrix=\"1 2 3 4 5 6 7 8 9\"/>";
  struct Case {
    std::string attributes, inside, text, expected;
  };
  const Case cases[] = {
      {"", xyz, "", "r.txt: no rows"},
      {"", named, "t x y z\n", "r.txt: no rows after the header"},
      {"", "<columns rate=\"30\" position=\"1 2 3\"/>", "nan nan nan\n0 0 0\n", "r.txt:1: column 1 is 'nan'"},
      {"", xyz, "1 2 3\n1 2\n", "r.txt:2: 2 columns in this row, expected 3 as in the first"},
      {"", xyz, "1 2\n", "r.txt:1: column 3 is wanted, but there are 2"},
      {"", xyz, "1 2 3\n1 nan 3\n", "r.txt:2: column 2 is 'nan', expected a finite number"},
      {"", xyz, "1 2 3\n1 1e999 3\n", "r.txt:2: column 2 is '1e999', expected a finite number"},
      {"", xyz, "1 2 30\n", "r.txt:1: position z is 30 m, expected within 20 m of the origin"},
      {"", "<columns rate=\"10\" position=\"1 2 3\" grip=\"4\"/>", "1 2 3 0.2\n1 2 3 40\n",
       "r.txt:2: grip is 40, expected 0 (open) to 1 (closed), or a <grip> in "},
      {"", named, "t,x,yy,z\n0,1,2,3\n", "r.txt:1: no column 'y'; expected one of t, x, yy, z"},
      {"", named, "t,x,y\x1b[31m,z\n0,1,2,3\n", "r.txt:1: no column 'y'; expected one of t, x, y?[31m, z"},
      {"", named, "t,x,y,z,x\n0,1,2,3,4\n", "r.txt:1: column 'x' stands more than once in the header"},
      {"", "<columns rate=\"10\" position=\"1 2 1\"/>", "1 2 3\n", "r.txt:1: column '1' is wanted twice"},
      {"", "<columns rate=\"10\" position=\"1 2 3\" force=\"4 5 6\"/>", "1 2 3 0 -2e6 0\n",
       "r.txt:1: measured force y is -2000000 N, expected within 1000000 N"},
      {"", named, "0 1 2 3\n", "r.txt:1: column 't' is wanted, but the file has no header"},
      {"", named, "t x y z\n0 1 2 3\n0 1 2 3\n", "r.txt:3: time 0 s does not follow 0 s"},
      {"", named, "t x y z\n7 1 2 3\n6 1 2 3\n", "r.txt:3: time -1 s does not follow 0 s"},
      {"", quaternion, "0 1 2 3 1 0 0 0\n1 1 2 3 1.01 0 0 0\n", "r.txt:2: quaternion has length 1.01, expected 1"},
      {"", matrix, "1 0 0  0 1 0  0 0 1\n1 0 0  0 1 0  0 0 -1\n", "r.txt:2: columns of the matrix hold no rotation"},
      {"", matrix, "1 0 0  0 1.1 0  0 0 1\n", "r.txt:1: columns of the matrix hold no rotation"},
      {"map=\"jigsaws\" part=\"slave_left\"", "", "1 2 3\n", "r.txt:1: 3 columns in this row, expected 76"},
      {ros, "", "x,y\n1,2\n", "r.txt:1: no column 'field.header.stamp'; expected one of x, y"},
      {sofa, "", "", "r.txt: no states"},
      {sofa, "", "T= 0\n X= 1 2 3\n", "r.txt:2: 3 numbers after X=, expected 7"},
      {sofa, "", "X= 0 0 0 0 0 0 1\n", "r.txt:1: X= without a T="},
      {sofa, "", "T= 0\nT= 1\n", "r.txt:2: a second T="},
      {sofa, "", "T= 0 1\n", "r.txt:1: 2 numbers after T="},
      {sofa, "", "T= 0\n", "r.txt: ends with a T="},
      {sofa, "", "0 1 2\n", "r.txt:1: expected T=, X= or another NAME=, found '0'"},
      {sofa, "", "T= 0\nX= 0 nan 0 0 0 0 1\n", "r.txt:2: expected a finite number, found 'nan'"},
      {sofa, "", "T= 0\nX= 0 0 0 0 0 0 2\n", "r.txt:2: quaternion has length 2"},
  };
  for (const Case& c : cases) {
    const std::string message = complaint(c.attributes, c.inside, c.text);
    EXPECT_TRUE(message.starts_with(c.expected)) << message << "\nexpected " << c.expected;
  }
}

TEST_F(Recording, EveryMistakeInTheDescriptionIsNamedWithTheNearestName) {
  const std::string columns = "<columns rate=\"10\" position=\"1 2 3\"/>";
  struct Case {
    std::string attributes, inside, expected;
  };
  const Case cases[] = {
      {"map=\"jigsaw\" part=\"slave_left\"", "",
       "r.xml:1: <recording> map=\"jigsaw\": did you mean \"jigsaws\"? known: table, jigsaws, ros, sofa"},
      {"map=\"jigsaws\"", "",
       "r.xml:1: <recording> map=\"jigsaws\": part=\"master_left|master_right|slave_left|slave_right\" is missing"},
      {"map=\"ros\" part=\"slave_left\"", "", "r.xml:1: <recording> part=\"slave_left\": part="},
      {"map=\"jigsaws\" part=\"slave_rigth\"", "",
       "r.xml:1: <recording> part=\"slave_rigth\": did you mean \"slave_right\"?"},
      {"", columns + "<units length=\"mikron\"/>",
       "r.xml:2: <units> length=\"mikron\": did you mean \"micron\"? known: m, cm, mm, micron, inch"},
      {"", "<columns time=\"1\" position=\"1 2 3\"/><units time=\"sec\"/>",
       "r.xml:2: <units> time=\"sec\": expected one of s, ms, us, ns"},
      {"", columns + "<units time=\"s\"/>", "r.xml:2: <units> time=\"s\": there is a rate"},
      {"", "<columns time=\"sec nsec\" position=\"x y z\"/><units time=\"ms\"/>",
       "r.xml:2: <units> time=\"ms\": times are in columns of seconds and nanoseconds, expected no unit of time"},
      {"map=\"ros\"", "<units time=\"ms\"/>", "r.xml:2: <units> time=\"ms\": times are in columns of seconds"},
      {"", columns + "<frame mirror=\"w\"/>", "r.xml:2: <frame> mirror=\"w\": expected one of x, y, z"},
      {"", columns + "<frame scale=\"0\"/>", "r.xml:2: <frame> scale=\"0\": expected 1 number > 0"},
      {"", columns + "<frame tool=\"1 1 0 0\"/>", "r.xml:2: <frame> tool=\"1 1 0 0\": expected a unit quaternion"},
      {"", columns + "<grip open=\"1\" closes=\"0\"/>", "r.xml:2: <grip>: there is no grip column"},
      {"", "<columns rate=\"10\" position=\"1 2 3\" grip=\"4\"/><grip open=\"1\" closes=\"1\"/>",
       "r.xml:2: <grip> closes=\"1\": the grip is open there"},
      {"", columns + "<span from=\"2\" to=\"1\"/>", "r.xml:2: <span> to=\"1\": expected from < to"},
      {"", columns + "<span smooth=\"2\"/>", "r.xml:2: <span> smooth=\"2\": expected 1 number >= 0 and <= 1"},
      {"", columns + "<spam/>", "r.xml:2: <recording> has no child <spam>; did you mean \"span\"?"},
      {"", "<columns rate=\"10\" position=\"1 2\"/>", "r.xml:2: <columns> position=\"1 2\": 2 columns, expected 3"},
      {"", "<columns rate=\"10\"/>", "r.xml:2: <columns>: expected <columns position="},
      {"", "<columns position=\"1 2 3\"/>", "r.xml:2: <columns>: expected <columns time="},
      {"", "", "r.xml:1: <recording>: expected <columns position="},
      {"", "<columns rate=\"1\" time=\"4\" position=\"1 2 3\"/>", "r.xml:2: <columns> rate=\"1\": expected either"},
      {"", "<columns rate=\"1\" position=\"1 2 3\" quaternion=\"1 2 3 4\" matrix=\"1 2 3 4 5 6 7 8 9\"/>",
       "r.xml:2: <columns> matrix="},
      {"map=\"sofa\"", columns, "r.xml:2: <columns>: map=\"sofa\" is no table"},
      {"map=\"sofa\"", "<grip open=\"1\" closes=\"0\"/>", "r.xml:2: <grip>: map=\"sofa\" has no grip"},
  };
  for (const Case& c : cases) {
    const std::string message = complaint(c.attributes, c.inside, "1 2 3 4\n");
    EXPECT_TRUE(message.starts_with(c.expected)) << message << "\nexpected " << c.expected;
  }
  folder.write("lone.xml", "<recording file=\"none.txt\" map=\"ros\"/>");
  const std::string message = complaintOf([&] { readRecording(readRecordingMap(folder / "lone.xml")); }, folder.path());
  EXPECT_TRUE(message.starts_with("lone.xml:1: recording \"")) << message;
}

// Rows that lie ten times as close in one half of the window do not draw the mean there.
TEST_F(Recording, SmoothingWeighsRowsByTheTimeThatTheyStandFor) {
  std::string text;
  for (int k = 0; k <= 1000; ++k)
    if (k % 10 == 0 || (k > 500 && k < 600)) text += fmt::format("{} {} 0 0\n", 1e-3 * k, 1e-3 * k);
  const Trajectory t = read("", "<columns time=\"1\" position=\"2 3 4\"/><span smooth=\"0.2\"/>", text);
  ASSERT_EQ(t.samples.size(), 191u);
  for (const ToolSample& sample : t.samples) EXPECT_NEAR(sample.position.x(), sample.time, 5e-4);
}

// The shipped recording undoes its tracker's frame: the hand rests where its maker's first pose is, turned as there.
TEST(RecordingFile, TheShippedOneLiesWhereItsMakerPutIt) {
  const Trajectory t = readRecording(readRecordingMap(std::string(MEDULLA_SOURCE_DIR) + "/scenes/recorded/hand.xml"));
  const Quaterniond rest(0.928064, 0.162212, 0.335238, 0);
  const ToolSample start = sampleTrajectory(t, 0.2), press = sampleTrajectory(t, 2.45), hold = sampleTrajectory(t, 5.6);
  EXPECT_LT((start.position - Vector3d(-0.02, -0.062, 0.066)).norm(), 2e-4);
  EXPECT_LT((press.position - Vector3d(-0.0525, -0.0385, 0.02)).norm(), 1e-4);
  EXPECT_LT(press.worldFromTool.angularDistance(rest), 1e-4);
  EXPECT_GT(press.grip, 0.55);  // with shut jaws
  EXPECT_LT(sampleTrajectory(t, 4.9).grip, 0.1);
  EXPECT_GT(hold.grip, 0.55);
  EXPECT_LT(t.samples.back().grip, 0.1);
}

// ---- 30 Hz ------------------------------------------------------------------------------------------------

// A press of 12 mm as a hand does it, minimum jerk (Flash and Hogan 1985), seen 30 times a second.
static Trajectory pressAt30Hz() {
  Trajectory t;
  for (int k = 0; k <= 45; ++k) {
    const double s = std::clamp((k / 30.0 - 0.2) / 1.0, 0.0, 1.0);
    ToolSample sample = deviceAt({0.012, 0.004, 0.0585 - 0.016 * s * s * s * (10 + s * (6 * s - 15))});
    sample.time = k / 30.0;
    t.samples.push_back(sample);
  }
  return t;
}

static ToolSample straightBetween(const Trajectory& t, double time) {
  const auto k = std::min(static_cast<std::size_t>(time * 30), t.samples.size() - 2);
  const double s = std::min(1.0, time * 30 - double(k));
  return deviceAt(t.samples[k].position + s * (t.samples[k + 1].position - t.samples[k].position));
}

struct Steps {
  double velocity = 0;  // m/s per tick, the device's
  double force = 0;     // N: how much the force's change from tick to tick changes
};

static Steps stepsOf(const std::function<ToolSample(double)>& device) {
  // Fast dynamics: what is looked for is the recording's rate.
  ToolRun run{SpringBody(ellipsoid(24, 20, 7, 0.3)), {}, device, 6, 1.0 / 1200, {}};
  run.tool.staticFriction = run.tool.dynamicFriction = 0;
  Steps steps;
  std::vector<double> force;
  run.run(1.5, [&](double t, const ToolState& tool) {
    if (tool.inContact) force.push_back(tool.force.norm());
    const double dt = run.tickDuration;
    const Vector3d before = device(t).position - device(t - dt).position,
                   after = device(t + dt).position - device(t).position;
    steps.velocity = std::max(steps.velocity, (after - before).norm() / dt);
  });
  EXPECT_GT(force.size(), 600u);
  // Contact begins with a step of its own, and with one where its second frame tells how far tissue follows.
  for (std::size_t i = 18; i + 1 < force.size(); ++i)
    steps.force = std::max(steps.force, std::abs(force[i + 1] - 2 * force[i] + force[i - 1]));
  return steps;
}

TEST(Trajectory, ThirtyHertzLeavesNoStepsInVelocityAndForce) {
  const Trajectory recorded = pressAt30Hz();
  const Steps smooth = stepsOf([&](double t) { return sampleTrajectory(recorded, t); });
  const Steps straight = stepsOf([&](double t) { return straightBetween(recorded, t); });
  RecordProperty("velocity_step_smooth", std::to_string(smooth.velocity));
  RecordProperty("velocity_step_straight", std::to_string(straight.velocity));
  RecordProperty("force_step_smooth", std::to_string(smooth.force));
  RecordProperty("force_step_straight", std::to_string(straight.force));
  EXPECT_LT(smooth.velocity, 0.1 * straight.velocity);
  EXPECT_LT(smooth.force, 0.4 * straight.force);
}

}  // namespace medulla
