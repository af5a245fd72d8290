#include "app/files/output_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "app/files/text_file.h"
#include "render/output_folder.h"
#include "tests/complaint.h"
#include "tests/file_size_limit.h"
#include "tests/temporary_folder.h"

namespace medulla {
namespace {

std::string complaint(const std::string& path) {
  return complaintOf([&] { OutputFile file(path); });
}

TEST(OutputFile, AppearsUnderItsNameOnlyWhenWhole) {
  const TemporaryFolder folder;
  OutputFile file(folder / "a.csv");
  std::string expected;
  for (int k = 0; k < 100000; ++k) {  // more than is collected before writing
    file.write("line\n");
    expected += "line\n";
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "a.csv"));
  file.commit();
  EXPECT_EQ(readTextFile(folder / "a.csv"), expected);
  EXPECT_EQ(folder.contents().size(), 1u);
}

TEST(OutputFile, AbandonedItLeavesNothingAndTheEarlierFileStays) {
  const TemporaryFolder folder;
  folder.write("a.csv", "earlier");
  try {
    OutputFile file(folder / "a.csv");
    file.write(std::string(1 << 20, 'x'));
    EXPECT_EQ(folder.contents().size(), 2u);
    throw std::runtime_error("the run failed");
  } catch (const std::runtime_error&) {
  }
  EXPECT_EQ(readTextFile(folder / "a.csv"), "earlier");
  EXPECT_EQ(folder.contents().size(), 1u);
}

TEST(OutputFile, WhatIsReplacedKeepsItsPermissions) {
  const TemporaryFolder folder;
  using std::filesystem::perms;
  for (const perms mode : {perms(0600), perms(0664), perms(0755)}) {
    folder.write("a.csv", "earlier");
    std::filesystem::permissions(folder / "a.csv", mode);
    OutputFile file(folder / "a.csv");
    file.write("later");
    file.commit();
    EXPECT_EQ(readTextFile(folder / "a.csv"), "later");
    EXPECT_EQ(std::filesystem::status(folder / "a.csv").permissions(), mode);
  }
}

TEST(OutputFile, ReplacesTheEarlierFileAtOnce) {
  const TemporaryFolder folder;
  folder.write("a.csv", "earlier and longer");
  OutputFile file(folder / "a.csv");
  file.write("new");
  file.commit();
  EXPECT_EQ(readTextFile(folder / "a.csv"), "new");
}

TEST(OutputFile, TwoOfOneNameDoNotMix) {
  const TemporaryFolder folder;
  OutputFile first(folder / "a.csv"), second(folder / "a.csv");
  first.write("first");
  second.write("second");
  second.commit();
  EXPECT_EQ(readTextFile(folder / "a.csv"), "second");
  first.commit();
  EXPECT_EQ(readTextFile(folder / "a.csv"), "first");
}

TEST(OutputFile, NeverTouchesATemporaryFileOfAnother) {
  const TemporaryFolder folder;
  const std::string stale = "a.csv." + std::to_string(::getpid()) + "-0.part";
  folder.write(stale, "left by a killed run");
  OutputFile file(folder / "a.csv");
  file.write("new");
  file.commit();
  EXPECT_EQ(readTextFile(folder / "a.csv"), "new");
  EXPECT_EQ(readTextFile(folder / stale), "left by a killed run");
}

TEST(OutputFile, ItsNameMayBeAsLongAsNamesMayBe) {
  const TemporaryFolder folder;
  const std::string name(255, 'n');
  writeFile(folder / name, "text");
  EXPECT_EQ(readTextFile(folder / name), "text");
}

TEST(OutputFile, WritesThroughALink) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "elsewhere");
  folder.write("elsewhere/real.csv", "earlier");
  std::filesystem::create_symlink("elsewhere/real.csv", folder / "link.csv");
  OutputFile file(folder / "link.csv");
  file.write("new");
  file.commit();
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.csv"));
  EXPECT_EQ(readTextFile(folder / "elsewhere/real.csv"), "new");
}

TEST(OutputFile, MakesMissingFoldersAndLeavesNoneEmpty) {
  const TemporaryFolder folder;
  { const OutputFile dropped(folder / "a/b/run.csv"); }
  requireWritable({folder / "a/b/run.csv"});
  EXPECT_TRUE(folder.contents().empty());
  writeFile(folder / "a/b/run.csv", "text");
  EXPECT_EQ(readTextFile(folder / "a/b/run.csv"), "text");
}

TEST(OutputFile, TargetsThatCannotBeWrittenAreRefusedAtOnce) {
  const TemporaryFolder folder;
  folder.write("file", "earlier");
  EXPECT_EQ(complaint(folder / "file/a.csv"), folder / "file: cannot be made: Not a directory");
  EXPECT_EQ(complaint(folder.path()), folder.path() + ": is a folder, expected the name of a file to write");
  EXPECT_EQ(complaint(folder / "new/"), folder / "new/: expected the name of a file to write");
  const std::string endless = folder / std::string(256, 'x');  // what is written first has a shorter name
  EXPECT_EQ(complaint(endless), endless + ": cannot be written: File name too long");
  EXPECT_EQ(complaint(""), ": expected the name of a file to write");
  // Renaming onto a device would replace it for the whole machine.
  EXPECT_EQ(complaint("/dev/null"), "/dev/null: is not a regular file");
  // As /dev/stdout: a link whose text, "pipe:[8]", is no path.
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const std::string pipe = fmt::format("/proc/self/fd/{}", ends[1]);
  EXPECT_EQ(complaint(pipe), pipe + ": is not a regular file");
  for (const int end : ends) ::close(end);
  EXPECT_EQ(folder.contents().size(), 1u);
}

TEST(OutputFile, WhatIsForbiddenIsRefused) {
  if (::geteuid() == 0) GTEST_SKIP() << "nothing is forbidden to root";
  const TemporaryFolder folder;
  folder.write("file", "");
  ::chmod(folder.path().c_str(), 0500);
  EXPECT_EQ(complaint(folder / "a.csv"), folder / "a.csv: cannot be written: Permission denied");
  ::chmod(folder.path().c_str(), 0700);
  ::chmod((folder / "file").c_str(), 0400);
  EXPECT_EQ(complaint(folder / "file"), folder / "file: cannot be written: Permission denied");
}

TEST(OutputFile, AFullDiskIsReportedAndLeavesNothing) {
  const TemporaryFolder folder;
  folder.write("a.csv", "earlier");
  const std::string inPieces = complaintOf([&] {
    const FileSizeLimit limit(1 << 19);
    OutputFile file(folder / "a.csv");
    for (int k = 0; k < 4; ++k) file.write(std::string(1 << 18, 'x'));
    file.commit();
  });
  const std::string atOnce = complaintOf([&] {
    const FileSizeLimit limit(1 << 19);
    writeFile(folder / "a.csv", std::string(1 << 20, 'x'));
  });
  EXPECT_EQ(inPieces, folder / "a.csv: cannot be written: File too large");
  EXPECT_EQ(atOnce, inPieces);
  EXPECT_EQ(readTextFile(folder / "a.csv"), "earlier");
  EXPECT_EQ(folder.contents().size(), 1u);
}

// Nothing is there yet that the file system could say of two names that they are one.
TEST(OutputFile, OneNewFileBySeveralNamesIsRefusedForTwoOutputs) {
  const TemporaryFolder folder;
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  for (const std::string& other : {std::string("a.csv"), std::string("./a.csv"), std::string("none/../a.csv"),
                                   std::filesystem::current_path().string() + "/a.csv"}) {
    EXPECT_EQ(complaintOf([&] { requireDistinctFiles({"a.csv", other}, {}); }), other + ": named for two outputs");
    EXPECT_EQ(complaintOf([&] { requireDistinctFiles({"a.csv"}, {other}); }), "a.csv: would be written over an input");
  }
  EXPECT_EQ(complaintOf([&] { requireDistinctFiles({"a.csv", "./b.csv"}, {"c.csv"}); }), "");
  std::filesystem::current_path(before);
}

TEST(OutputFolder, ALinkThatLeadsNowhereStays) {
  const TemporaryFolder folder;
  std::filesystem::create_symlink("nowhere/dir", folder / "link");
  EXPECT_THROW(const OutputFolder made(folder / "link/deep"), std::runtime_error);
  EXPECT_THROW(const OutputFolder made(folder / "link"), std::runtime_error);
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
  { const OutputFolder made(folder / "a/b"); }
  EXPECT_FALSE(std::filesystem::exists(folder / "a"));
}

}  // namespace
}  // namespace medulla
