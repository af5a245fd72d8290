#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

#include "render/output_folder.h"

namespace medulla {

// Of what the system has just refused to write.
std::runtime_error unwritable(const std::string& path);

// What a symbolic link stands for, whether there is something yet or not; any other path itself.
std::string behindLink(const std::string& path);

// A file beside its target that takes the target's name only when it is whole: TARGET.PID-N.part up to commit(), or
// as much of the target's name as a name has room for. That holds against whatever ends a program, not against a power
// cut, for which every picture of a film would have to wait for the disk.
// Destroyed before that it is removed, and an earlier file of that name stays as it was. What a symbolic link stands
// for is replaced, not the link, also where there is nothing yet. The mode of a file that is replaced stays.
class PartialFile {
 public:
  // There at once, and empty; so are folders in the target's path that are missing, which go again with a file that
  // never came. Throws std::runtime_error with path and reason where the target cannot be written: not permitted, a
  // folder or a device of that name, or where standard output or standard error goes.
  explicit PartialFile(const std::string& target);
  ~PartialFile();
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  const std::string& path() const { return path_; }  // where to write
  void commit();                                     // once, last; throws likewise

 private:
  std::string target_;
  OutputFolder made_;
  std::string path_;
};

// A whole PartialFile in one call. Throws what that throws, and unwritable() where the system fails (disk full).
void writeFile(const std::string& path, std::string_view bytes);

}  // namespace medulla
