#include <gtest/gtest.h>

#include "tests/program_run.h"
#include "tests/temporary_folder.h"

// `medulla compare`: the first field in which two logs differ.
namespace medulla {
namespace {

class Compare : public testing::Test {
 protected:
  ProgramResult compare(const std::string& a, const std::string& b, const std::vector<std::string>& more = {}) const {
    folder.write("a.csv", a);
    folder.write("b.csv", b);
    std::vector<std::string> words{"compare", folder / "a.csv", folder / "b.csv"};
    words.insert(words.end(), more.begin(), more.end());
    return runProgram(words);
  }
  TemporaryFolder folder;
};

constexpr const char* kLog = "t,tool.force.x,energy.kinetic\n0.02,0.5,0\n0.04,-2,1e-3\n0.06,1,2e-3\n";

std::string edited(const std::string& from, const std::string& to) {
  std::string text = kLog;
  return text.replace(text.find(from), from.size(), to);
}

TEST_F(Compare, LogsOfOneRunAreEqual) {
  const ProgramResult r = compare(kLog, kLog);
  EXPECT_EQ(r.exitCode, 0) << r.err;
  EXPECT_EQ(r.out, "equal yes\nrows 3\n");
}

TEST_F(Compare, TheFirstFieldThatDiffersIsNamed) {
  std::string later = edited("-2,1e-3", "-2,0.00100000001");
  later.replace(later.find("0.06,1"), 6, "0.06,7");
  const ProgramResult r = compare(kLog, later);
  EXPECT_EQ(r.exitCode, 3);
  EXPECT_EQ(r.out, "equal no\nrow 2\nt 0.04 s\nfield energy.kinetic\na 1e-3\nb 0.00100000001\nline_a 3\nline_b 3\n");
  // Without a tolerance another way to write a number is a difference, too.
  EXPECT_EQ(compare(kLog, edited("0.5", "0.50")).exitCode, 3);
}

TEST_F(Compare, ToleranceIsAShareOfTheColumnsLargestValue) {
  // 0.5 becomes 0.51: half a percent of the 2 N that the column has at most.
  const std::string other = edited("0.5", "0.51");
  EXPECT_EQ(compare(kLog, other, {"--tolerance", "0.006"}).exitCode, 0);
  EXPECT_EQ(compare(kLog, other, {"--tolerance", "0.004"}).exitCode, 3);
  EXPECT_EQ(compare(kLog, edited("0.5", "0.50"), {"--tolerance", "1e-12"}).exitCode, 0);
  EXPECT_EQ(compare(kLog, edited("0.02,0.5,0", "0.02,0.5,1e-5"), {"--tolerance", "0.004"}).exitCode, 3);
}

TEST_F(Compare, LogsOfOtherShapeDiffer) {
  const ProgramResult columns = compare(kLog, edited("energy.kinetic", "energy.elastic"));
  EXPECT_EQ(columns.exitCode, 3);
  EXPECT_EQ(columns.out, "equal no\ncolumn 3\na energy.kinetic\nb energy.elastic\n");
  const ProgramResult fewer = compare(kLog, "t,tool.force.x\n0.02,0.5\n");
  EXPECT_EQ(fewer.out, "equal no\ncolumn 3\na energy.kinetic\nb none\n");
  const ProgramResult rows = compare(kLog, edited("0.06,1,2e-3\n", ""));
  EXPECT_EQ(rows.exitCode, 3);
  EXPECT_EQ(rows.out, "equal no\nrows_a 3\nrows_b 2\n");
}

TEST_F(Compare, OfALogThatIsCutTheWholeRowsAreCompared) {
  const std::string log = kLog;
  const std::size_t whole = log.find("0.06");
  for (const std::size_t left :
       {std::string("0.0").size(), std::string("0.06,").size(), std::string("0.06,1,2e-").size()}) {
    const ProgramResult r = compare(kLog, log.substr(0, whole + left));
    EXPECT_EQ(r.exitCode, 3) << left;
    EXPECT_EQ(r.out, "equal no\nrows_a 3\nrows_b 2\n") << left;
    EXPECT_EQ(complaints(r), (std::vector<std::string>{"note: " + folder / "b.csv" +
                                                       " ends in the midst of row 3: only the rows before it are "
                                                       "compared"}));
  }
  const std::string cut = log.substr(0, whole + 4);
  EXPECT_EQ(compare(cut, cut).exitCode, 3);
  EXPECT_NE(compare(cut, edited("0.5", "0.51")).out.find("row 1\n"), std::string::npos);
  EXPECT_EQ(compare(kLog, log.substr(0, log.size() - 1)).exitCode, 0);  // whole but for its line end
  EXPECT_EQ(compare(kLog, cut + "\n").exitCode, 1);                     // a row that somebody has ended
}

TEST_F(Compare, WhatIsNoLogIsRefused) {
  const auto refused = [&](const ProgramResult& r, int exitCode, const std::string& words) {
    EXPECT_EQ(r.exitCode, exitCode);
    EXPECT_EQ(r.out, "");
    EXPECT_EQ(complaints(r).size(), 1) << r.err;
    EXPECT_NE(r.err.find(words), std::string::npos) << r.err;
  };
  refused(compare(kLog, edited("-2", "nan")), 1, "b.csv:3: column tool.force.x is 'nan', expected a finite number");
  refused(compare(edited("-2,", ""), kLog), 1, "a.csv:3: 2 columns in this row, expected 3 as in the header");
  refused(compare(kLog, edited("0.04", "0.01")), 1, "b.csv:3: t goes back from 0.02 to 0.01");
  refused(compare(kLog, ""), 1, "b.csv: no header");
  refused(compare(kLog, "vertex,fx\n1,2\n"), 1, "b.csv:1: this is no log");
  refused(compare(kLog, "t;x\n1;2\n"), 1, "b.csv:1: columns are separated by semicolons, expected commas");
  refused(runProgram({"compare", folder / "a.csv", folder / "none.csv"}), 1, "none.csv");
  refused(runProgram({"compare", folder / "a.csv"}), 2, "B");
  refused(compare(kLog, kLog, {"--tolerance", "-1"}), 2, "--tolerance");
  refused(compare(kLog, kLog, {"--tolerance", "nan"}), 2, "--tolerance");
}

}  // namespace
}  // namespace medulla
