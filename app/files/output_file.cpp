#include "app/files/output_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <set>

#include "app/files/input_error.h"

namespace medulla {

void writeAll(int descriptor, std::string_view text, const std::string& path) {
  while (!text.empty()) {
    const ssize_t count = ::write(descriptor, text.data(), text.size());
    if (count < 0 && errno != EINTR) throw unwritable(path);
    if (count > 0) text.remove_prefix(static_cast<std::size_t>(count));
  }
}

FolderLock::FolderLock(const std::string& folder, const std::string& name, const std::string& taken)
    : descriptor_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (descriptor_ >= 0 && ::flock(descriptor_, LOCK_EX | LOCK_NB) == 0) return;
  const int error = errno;
  if (descriptor_ >= 0) ::close(descriptor_);
  throw inputError(name, 0, error == EWOULDBLOCK ? taken : std::string("cannot be locked: ") + std::strerror(error));
}

FolderLock::~FolderLock() {
  ::close(descriptor_);
}

OutputFile::OutputFile(const std::string& path)
    : path_(path), file_(path), descriptor_(::open(file_.path().c_str(), O_WRONLY | O_CLOEXEC)) {
  if (descriptor_ < 0) throw unwritable(path_);
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void OutputFile::flush() {
  writeAll(descriptor_, buffer_, path_);
  buffer_.clear();
}

void OutputFile::write(const std::string& text) {
  constexpr std::size_t flushAt = 1 << 18;  // bytes: few system calls, little memory
  buffer_ += text;
  if (buffer_.size() >= flushAt) flush();
}

void OutputFile::commit() {
  flush();
  const int descriptor = descriptor_;
  descriptor_ = -1;
  // Some file systems report a full disk only here.
  if (::close(descriptor) != 0) throw unwritable(path_);
  file_.commit();
}

void writeTextFile(const std::string& path, const std::string& text) {
  OutputFile file(path);
  file.write(text);
  file.commit();
}

// Absolute first: of a path that starts with nothing that exists, weakly_canonical() leaves "a.csv" and "./a.csv" two.
std::filesystem::path placeOf(const std::string& path) {
  std::error_code error;
  const std::filesystem::path absolute = std::filesystem::absolute(path, error);
  std::filesystem::path place = std::filesystem::weakly_canonical(absolute, error);
  if (error) place = path;
  return place.has_filename() ? place : place.parent_path();
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
