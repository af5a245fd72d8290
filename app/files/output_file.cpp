#include "app/files/output_file.h"

#include <fcntl.h>
#include <sys/file.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <set>

#include "app/files/input_error.h"

namespace medulla {

FolderLock::FolderLock(const std::string& folder, const std::string& name, const std::string& taken)
    : folder_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (folder_.isOpen() && ::flock(folder_.value(), LOCK_EX | LOCK_NB) == 0) return;
  throw inputError(name, 0, errno == EWOULDBLOCK ? taken : std::string("cannot be locked: ") + std::strerror(errno));
}

OutputFile::OutputFile(const std::string& path)
    : path_(path), file_(path), to_(::open(file_.path().c_str(), O_WRONLY | O_CLOEXEC)) {
  if (!to_.isOpen()) throw unwritable(path_);
}

void OutputFile::flush() {
  writeAll(to_, buffer_, path_);
  buffer_.clear();
}

void OutputFile::write(const std::string& bytes) {
  constexpr std::size_t flushAt = 1 << 18;  // bytes: few system calls, little memory
  buffer_ += bytes;
  if (buffer_.size() >= flushAt) flush();
}

void OutputFile::finish() {
  if (!to_.isOpen()) return;
  flush();
  if (!to_.close()) throw unwritable(path_);
}

void OutputFile::commit() {
  finish();
  file_.commit();
}

// Absolute first: of a path that starts with nothing that exists, weakly_canonical() leaves "a.csv" and "./a.csv" two.
// Behind its link: weakly_canonical() leaves one alone that stands for nothing yet.
std::filesystem::path placeOf(const std::string& path) {
  std::error_code error;
  const std::filesystem::path absolute = std::filesystem::absolute(behindLink(path), error);
  std::filesystem::path place = std::filesystem::weakly_canonical(absolute, error);
  if (error) place = path;
  return place.has_filename() ? place : place.parent_path();
}

std::filesystem::path normalised(const std::filesystem::path& path) {
  std::filesystem::path called = path.lexically_normal();
  if (placeOf(called.string()) == placeOf(path.string())) return called;
  return placeOf(path.parent_path().string()) / path.filename();
}

void requireDistinctFiles(const std::vector<std::string>& outputs, const std::vector<std::string>& inputs) {
  std::set<std::filesystem::path> read, written;
  for (const std::string& input : inputs)
    if (!input.empty()) read.insert(placeOf(input));
  for (const std::string& output : outputs) {
    if (output.empty()) continue;
    const std::filesystem::path place = placeOf(output);
    if (read.count(place) > 0) throw std::runtime_error(output + ": would be written over an input");
    if (!written.insert(place).second) throw std::runtime_error(output + ": named for two outputs");
  }
}

void requireWritable(const std::vector<std::string>& paths) {
  for (const std::string& path : paths)
    if (!path.empty()) const OutputFile writableAtAll(path);
}

}  // namespace medulla
