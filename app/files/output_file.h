#pragma once

#include <string>

namespace medulla {

// A text file that appears under its name only when whole: it is collected beside the target under a name of its own
// and renamed by commit(). Destroyed before that, it leaves nothing and an earlier file stays as it was.
// Both throw std::runtime_error with the path and the system's reason.
class OutputFile {
 public:
  explicit OutputFile(std::string path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  void write(const std::string& text);
  void commit();

 private:
  std::string path_, temporaryPath_;
  int descriptor_ = -1;
  std::string buffer_;
};

}  // namespace medulla
