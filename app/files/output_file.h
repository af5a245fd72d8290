#pragma once

#include <string>
#include <vector>

namespace medulla {

// Throws std::runtime_error when a command would write one file twice, or over a file that it reads. Links and "./"
// are seen through; empty names are skipped.
void requireDistinctFiles(const std::vector<std::string>& outputs, const std::vector<std::string>& inputs);

// A text file that appears under its name only when whole: it is collected beside the target under a name of its own
// (TARGET.PID-N.part) and renamed by commit(). Destroyed before that, it leaves nothing and an earlier file stays as it
// was; ^C becomes an exception (app/interrupt.h) and so comes here too.
// The constructor throws std::runtime_error at once where the target cannot be written (no such folder, not permitted,
// a folder or device of that name), write() and commit() where the system fails (disk full), with path and reason.
class OutputFile {
 public:
  explicit OutputFile(const std::string& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  void write(const std::string& text);
  void commit();  // once, last

 private:
  void flush();

  std::string path_, temporaryPath_;
  int descriptor_ = -1;
  std::string buffer_;
};

// A whole OutputFile in one call.
void writeText(const std::string& path, const std::string& text);

// A folder for outputs, made where it is missing, with those above it, which stay. One that was made here and is empty
// at the end, since what was to fill it failed, goes again. Throws std::runtime_error with path and reason where the
// system refuses.
class OutputFolder {
 public:
  explicit OutputFolder(const std::string& path);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

 private:
  std::string path_;
  bool isMade_ = false;
};

}  // namespace medulla
