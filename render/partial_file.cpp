#include "render/partial_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "render/descriptor.h"

namespace medulla {

std::runtime_error unwritable(const std::string& path) {
  return std::runtime_error(path + ": cannot be written: " + std::strerror(errno));
}

std::string behindLink(const std::string& path) {
  constexpr int kMost = 40;  // as many as Linux follows: a circle ends
  std::filesystem::path target = path;
  std::error_code error;
  for (int k = 0; k < kMost && std::filesystem::is_symlink(target, error); ++k)
    target = target.parent_path() / std::filesystem::read_symlink(target, error);
  return target.string();
}

// What was written to the stream before, and is still to come, would be in the file that is replaced.
static bool isStandardStream(const struct stat& file) {
  for (const int descriptor : {STDOUT_FILENO, STDERR_FILENO}) {
    struct stat stream {};
    if (::fstat(descriptor, &stream) == 0 && stream.st_dev == file.st_dev && stream.st_ino == file.st_ino) return true;
  }
  return false;
}

// Renaming onto a device would replace that.
static std::string resolveTarget(const std::string& path) {
  requireName(path);
  if (path.empty() || path.back() == '/') throw std::runtime_error(path + ": expected the name of a file to write");
  std::string target = behindLink(path);
  struct stat status {};
  // Asked by the name that was given: the link behind /dev/stdout says "pipe:[8]", which is the name of no file.
  if (::stat(path.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) throw std::runtime_error(path + ": is a folder, expected the name of a file to write");
    if (!S_ISREG(status.st_mode)) throw std::runtime_error(path + ": is not a regular file");
    if (isStandardStream(status)) throw std::runtime_error(path + ": is where results or notes go");
    if (::access(target.c_str(), W_OK) != 0) throw unwritable(path);
  } else if (errno == ENAMETOOLONG) {
    throw unwritable(path);  // only what is written first, beside it, has a shorter name
  }
  return target;
}

// TARGET + ending, in the target's folder.
static std::string besideTarget(const std::filesystem::path& target, const std::string& ending) {
  const std::string name = target.filename().string();
  return (target.parent_path() / (name.substr(0, NAME_MAX - ending.size()) + ending)).string();
}

static std::string folderOf(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

// Of what is replaced. Where that fails the file is as new ones are.
static void takePermissions(const std::string& target, const Descriptor& to) {
  constexpr mode_t readWriteAndRun = 0777;
  struct stat earlier {};
  if (::stat(target.c_str(), &earlier) == 0) (void)::fchmod(to.value(), (earlier.st_mode & readWriteAndRun) | S_IWUSR);
}

PartialFile::PartialFile(const std::string& target) : target_(resolveTarget(target)), made_(folderOf(target)) {
  const mode_t readAndWrite = 0666;  // less the user's mask
  // Names left by killed runs are stepped over: O_EXCL never touches a file that somebody else made.
  for (int attempt = 0;; ++attempt) {
    path_ = besideTarget(target_, fmt::format(".{}-{}.part", ::getpid(), attempt));
    const Descriptor made(::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, readAndWrite));
    if (made.isOpen()) {
      takePermissions(target_, made);
      return;
    }
    if (errno != EEXIST) throw unwritable(target);
  }
}

PartialFile::~PartialFile() {
  if (!path_.empty()) ::unlink(path_.c_str());
}

void PartialFile::commit() {
  if (std::rename(path_.c_str(), target_.c_str()) != 0) throw unwritable(target_);
  path_.clear();
}

void writeFile(const std::string& path, std::string_view bytes) {
  PartialFile file(path);
  Descriptor to(::open(file.path().c_str(), O_WRONLY | O_CLOEXEC));
  if (!to.isOpen()) throw unwritable(path);
  writeAll(to, bytes, path);
  if (!to.close()) throw unwritable(path);  // some file systems report a full disk only here
  file.commit();
}

}  // namespace medulla
