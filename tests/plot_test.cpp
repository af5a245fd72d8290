#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "app/files/log_table.h"
#include "app/files/plot_file.h"
#include "tests/program_run.h"
#include "tests/temporary_folder.h"

namespace medulla {
namespace {

const std::string kHeader =
    "t,hook.device.x,hook.device.y,hook.device.z,hook.proxy.x,hook.proxy.y,hook.proxy.z,hook.force.x,hook.force.y,"
    "hook.force.z,hook.contact,hook.held,sac.volume_ratio,sac.dynamic_nodes,energy.kinetic,energy.elastic,"
    "impulse_mismatch\n";

// Ten rows: free, in contact from the third, held from the sixth, free again from the ninth.
std::string shortLog() {
  std::string text = kHeader;
  for (int k = 1; k <= 10; ++k) {
    const int contact = k >= 3 && k < 9, held = k >= 6 && k < 9;
    text += std::to_string(0.02 * k) + ",0,0,0.01,0,0," + (contact ? "0.013" : "0.01") + ",0,3," +
            std::to_string(4 * contact) + "," + std::to_string(contact) + "," + std::to_string(held) +
            ",1.01,120,1e-6,2e-3,0\n";
  }
  return text;
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::string blockOf(const std::string& script, const std::string& name) {
  const std::string start = "$" + name + " << EOD\n";
  const std::size_t at = script.find(start);
  if (at == std::string::npos) return {};
  return script.substr(at + start.size(), script.find("EOD\n", at + start.size()) - at - start.size());
}

ProgramResult plot(const std::string& log, const std::string& picture, const ProgramOptions& options = {}) {
  return runProgram({"plot", log, "-o", picture}, options);
}

}  // namespace

TEST(Plot, DrawsMagnitudesDepthsAndShades) {
  const TemporaryFolder folder;
  folder.write("run.csv", shortLog());
  const std::string script = plotScript(readLog(folder / "run.csv"), nullptr, "run", PlotFormat::svg);
  for (const char* title : {"hook: force on the hand, N", "hook: device to proxy, mm", "volume, % of rest",
                            "energy, mJ", "surface nodes modelled"})
    EXPECT_TRUE(has(script, title)) << title;
  EXPECT_TRUE(has(script, "set xrange [0:0.2]\n"));                             // rows tell how frames ended
  EXPECT_TRUE(has(blockOf(script, "p0_0"), "0.06 5\n"));                        // |(0, 3, 4)|
  EXPECT_TRUE(has(blockOf(script, "p1_0"), "0.06 3\n"));                        // mm, in contact
  EXPECT_TRUE(has(blockOf(script, "p1_0"), "0.12 0\n"));                        // while held nothing is penetrated
  EXPECT_TRUE(has(blockOf(script, "p1_1"), "0.12 3\n"));                        // but the proxy is as far
  EXPECT_TRUE(has(blockOf(script, "p2_0"), "0.2 101\n"));                       // %
  EXPECT_TRUE(has(blockOf(script, "p3_0"), "0.2 2\n"));                         // mJ
  EXPECT_TRUE(has(script, "from first 0.04, graph 0 to first 0.16, graph 1"));  // contact
  EXPECT_TRUE(has(script, "from first 0.1, graph 0 to first 0.16, graph 1"));   // grab
}

TEST(Plot, WhatStaysZeroIsCountedInOnes) {
  const TemporaryFolder folder;
  folder.write(
      "run.csv",
      "t,sac.volume_ratio,sac.dynamic_nodes,energy.kinetic,energy.elastic\n0.02,1,0,1e-3,0\n0.04,1,0,1e-3,0\n");
  const std::string script = plotScript(readLog(folder / "run.csv"), nullptr, "run", PlotFormat::svg);
  EXPECT_TRUE(has(script, "set yrange [0:1]")) << script;
}

TEST(Plot, ThinsManyRowsWithoutLosingAPeak) {
  const TemporaryFolder folder;
  std::string text = "t,sac.volume_ratio,sac.dynamic_nodes,energy.kinetic,energy.elastic,impulse_mismatch\n";
  for (int k = 1; k <= 30000; ++k)
    text += std::to_string(k / 1200.0) + (k == 12345 ? ",1.5" : k == 20000 ? ",0.5" : ",1") + ",10,0,0,0\n";
  folder.write("long.csv", text);
  const std::string script = plotScript(readLog(folder / "long.csv"), nullptr, "long", PlotFormat::png);
  const std::string volume = blockOf(script, "p0_0");
  EXPECT_TRUE(has(volume, " 150\n") && has(volume, " 50\n"));
  EXPECT_LT(std::count(volume.begin(), volume.end(), '\n'), 2001);
}

TEST(Plot, WritesPngAndSvgOfWhatALogHolds) {
  if (std::system("gnuplot --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "gnuplot is not installed";
  const TemporaryFolder folder;
  folder.write("run.csv", shortLog());
  folder.write("one.csv", shortLog().substr(0, shortLog().find('\n', kHeader.size()) + 1));
  const ProgramResult png = plot(folder / "run.csv", folder / "force.png");
  ASSERT_EQ(png.exitCode, 0) << png.err;
  EXPECT_EQ(png.err, "");
  EXPECT_TRUE(png.out.starts_with("file ")) << png.out;
  EXPECT_TRUE(readFile(folder / "force.png").starts_with("\x89PNG"));
  ASSERT_EQ(plot(folder / "one.csv", folder / "one.svg").exitCode, 0);
  EXPECT_TRUE(has(readFile(folder / "one.svg"), "hook: force on the hand, N"));
  EXPECT_EQ(plot(folder / "run.csv", folder / "run.csv/a.png").exitCode, 1);
  folder.write("cut.csv", shortLog().substr(0, shortLog().size() - 8));
  const ProgramResult cut = plot(folder / "cut.csv", folder / "cut.svg");
  EXPECT_EQ(cut.exitCode, 0) << cut.err;
  EXPECT_TRUE(has(cut.err, "cut.csv ends in the midst of a row: the rows before it are drawn\n")) << cut.err;
  folder.write("noted.csv", "\n# my run\n" + shortLog());
  EXPECT_TRUE(runProgram({"info", folder / "noted.csv"}).out.starts_with("kind log\n"));
}

// gnuplot runs what stands between backticks, unless it is told not to.
TEST(Plot, NamesAreTextAndNothingElse) {
  const TemporaryFolder folder;
  const std::string name = "s`touch " + folder / "made" + "`'\"\\";
  folder.write("run.csv", "t," + name + ".volume_ratio," + name +
                              ".dynamic_nodes,energy.kinetic,energy.elastic\n1,1,2,3,4\n2,1,2,3,4\n");
  const std::string script = plotScript(readLog(folder / "run.csv"), nullptr, "a`b'c", PlotFormat::svg);
  EXPECT_TRUE(has(script, "set label 1 'a`b''c' noenhanced"));
  if (std::system("gnuplot --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "gnuplot is not installed";
  const ProgramResult r = plot(folder / "run.csv", folder / "a.svg");
  EXPECT_EQ(r.exitCode, 0) << r.err;
  EXPECT_EQ(folder.contents().size(), 2u);
}

TEST(Plot, RefusesInOneLineAndLeavesNothing) {
  const TemporaryFolder folder;
  folder.write("run.csv", shortLog());
  folder.write("empty.csv", kHeader);
  std::string other = shortLog();
  other.replace(other.find("hook.contact"), 12, "hook.touched");
  folder.write("other.csv", other);
  const auto refused = [&](const ProgramResult& r, const std::string& part) {
    EXPECT_EQ(r.exitCode, 1) << r.err;
    EXPECT_EQ(r.out, "");
    EXPECT_EQ(complaints(r).size(), 1) << r.err;
    EXPECT_TRUE(has(r.err, part)) << r.err;
  };
  refused(plot(folder / "none.csv", folder / "a.png"), "none.csv");
  refused(plot(folder / "empty.csv", folder / "a.png"), "empty.csv: no rows");
  refused(plot(folder / "other.csv", folder / "a.png"), "other.csv: column hook.contact is missing");
  refused(plot(folder / "run.csv", folder / "a.pdf"), "expected FILE.png or FILE.svg");
  ProgramOptions bare;
  bare.path = folder.path();
  refused(plot(folder / "run.csv", folder / "a.png", bare), "gnuplot is not installed");
  EXPECT_EQ(folder.contents().size(), 3u);
  EXPECT_EQ(runProgram({"plot", folder / "run.csv"}).exitCode, 2);
}

// What frames took is a file of its own, so that logs are equal in every run; its rows need not be the log's, but the
// time that they span should.
TEST(Plot, DrawsWhatFramesTook) {
  const TemporaryFolder folder;
  folder.write("run.csv", shortLog());
  folder.write("times.csv", "t,servo,dynamics,surface\n0.02,0.1,1.5,0.2\n0.04,0.3,2.5,0.2\n");
  const LogTable times = readLog(folder / "times.csv");
  const std::string script = plotScript(readLog(folder / "run.csv"), &times, "run", PlotFormat::svg);
  EXPECT_TRUE(has(script, "what a dynamics frame took, ms"));
  EXPECT_EQ(blockOf(script, "p5_1"), "0.02 1.5\n0.04 2.5\n");
  const ProgramResult shorter =
      runProgram({"plot", folder / "run.csv", "--frame-times", folder / "times.csv", "-o", folder / "picture.svg"});
  EXPECT_TRUE(has(shorter.err, "run.csv ends at 0.2 s, ")) << shorter.err;
  EXPECT_TRUE(has(shorter.err, "times.csv at 0.04 s: are they of one run?")) << shorter.err;
  folder.write("other.csv", "t,servo\n0.02,1\n");
  const ProgramResult r =
      runProgram({"plot", folder / "run.csv", "--frame-times", folder / "other.csv", "-o", folder / "picture.svg"});
  EXPECT_EQ(r.exitCode, 1);
  EXPECT_NE(r.err.find("other.csv: column dynamics is missing"), std::string::npos) << r.err;
}

TEST(Plot, ARunTellsWhatItsFramesTook) {
  const TemporaryFolder folder;
  const std::string scene = MEDULLA_SOURCE_DIR "/scenes/gallbladder.xml";
  const ProgramResult r = runProgram({"replay", scene, "--set", "clock.duration=0.2", "--set", "output.golden=0",
                                      "--frame-times", folder / "times.csv"});
  ASSERT_EQ(r.exitCode, 0) << r.err;
  const LogTable times = readLog(folder / "times.csv");
  ASSERT_EQ(times.value.size(), 10u);
  for (const auto& row : times.value)
    for (const double value : row) EXPECT_GT(value, 0);
}

}  // namespace medulla
