#include "app/files/output_file.h"

#include <stdexcept>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/core.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "app/files/input_error.h"
#include "render/behind_link.h"

namespace medulla {

static std::runtime_error systemError(const std::string& path, const std::string& what) {
  return inputError(path, 0, what + ": " + std::strerror(errno));
}

// Renaming onto a device would replace that.
static std::string resolveTarget(const std::string& path) {
  if (path.empty() || path.back() == '/') throw inputError(path, 0, "expected the name of a file to write");
  std::string target = behindLink(path);
  struct stat status {};
  if (::stat(target.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) throw inputError(path, 0, "is a folder, expected the name of a file to write");
    if (!S_ISREG(status.st_mode)) throw inputError(path, 0, "is not a regular file");
    if (::access(target.c_str(), W_OK) != 0) throw systemError(path, "cannot be written");
  }
  return target;
}

OutputFile::OutputFile(const std::string& path) : path_(resolveTarget(path)) {
  const mode_t readAndWrite = 0666;  // less the user's mask
  // Names left by killed runs are stepped over: O_EXCL never touches a file that somebody else made.
  for (int attempt = 0; descriptor_ < 0; ++attempt) {
    temporaryPath_ = path_ + "." + std::to_string(::getpid()) + "-" + std::to_string(attempt) + ".part";
    descriptor_ = ::open(temporaryPath_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, readAndWrite);
    if (descriptor_ < 0 && errno != EEXIST) throw systemError(path_, "cannot be written");
  }
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporaryPath_.empty()) ::unlink(temporaryPath_.c_str());
}

void OutputFile::flush() {
  for (std::size_t done = 0; done < buffer_.size();) {
    const ssize_t count = ::write(descriptor_, buffer_.data() + done, buffer_.size() - done);
    if (count < 0 && errno != EINTR) throw systemError(path_, "cannot be written");
    if (count > 0) done += static_cast<std::size_t>(count);
  }
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
  if (::close(descriptor) != 0) throw systemError(path_, "cannot be written");
  if (std::rename(temporaryPath_.c_str(), path_.c_str()) != 0) throw systemError(path_, "cannot be written");
  temporaryPath_.clear();
}

void writeText(const std::string& path, const std::string& text) {
  OutputFile file(path);
  file.write(text);
  file.commit();
}

void requireDistinctFiles(const std::vector<std::string>& outputs, const std::vector<std::string>& inputs) {
  const auto place = [](const std::string& path) {
    std::error_code error;
    const std::filesystem::path canonical = std::filesystem::weakly_canonical(path, error);
    return error ? std::filesystem::path(path) : canonical;
  };
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    if (outputs[k].empty()) continue;
    for (const std::string& input : inputs)
      if (place(input) == place(outputs[k])) throw std::runtime_error(outputs[k] + ": would be written over an input");
    for (std::size_t e = 0; e < k; ++e)
      if (place(outputs[e]) == place(outputs[k])) throw std::runtime_error(outputs[k] + ": named for two outputs");
  }
}

OutputFolder::OutputFolder(const std::string& path) : path_(path) {
  std::error_code error;
  isMade_ = std::filesystem::create_directories(path, error);
  if (error) throw std::runtime_error(fmt::format("{}: cannot be made: {}", path, error.message()));
}

OutputFolder::~OutputFolder() {
  std::error_code filled;
  if (isMade_) std::filesystem::remove(path_, filled);
}

}  // namespace medulla
