#include "app/files/text_file.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>

#include "app/files/input_error.h"
#include "app/interrupt.h"
#include "render/descriptor.h"

namespace medulla {

namespace {

using FileNumber = std::pair<dev_t, ino_t>;

// What came out of pipes: a run reads its files again for the hash that tells it from others.
std::mutex pipesGuard;
std::map<FileNumber, std::string> pipesRead;

std::optional<std::string> remembered(const FileNumber& pipe) {
  const std::lock_guard lock(pipesGuard);
  const auto found = pipesRead.find(pipe);
  return found == pipesRead.end() ? std::nullopt : std::optional(found->second);
}

void remember(const FileNumber& pipe, const std::string& bytes) {
  const std::lock_guard lock(pipesGuard);
  pipesRead[pipe] = bytes;
}

// The file's number where it is a pipe. Anything but that and a regular file is refused: a device may have no end.
std::optional<FileNumber> pipeNumber(const Descriptor& file, const std::string& path) {
  struct stat status {};
  if (::fstat(file.value(), &status) != 0) throw inputError(path, 0, std::strerror(errno));
  if (S_ISDIR(status.st_mode)) throw inputError(path, 0, "is a folder, expected a file");
  if (!S_ISREG(status.st_mode) && !S_ISFIFO(status.st_mode))
    throw inputError(path, 0, "is a device, expected a file or a pipe");
  return S_ISFIFO(status.st_mode) ? std::optional<FileNumber>({status.st_dev, status.st_ino}) : std::nullopt;
}

void waitForInput(const Descriptor& pipe) {
  constexpr int kPatience = 100;  // ms, until interrupts are looked for again
  pollfd waiting{pipe.value(), POLLIN, 0};
  while (::poll(&waiting, 1, kPatience) <= 0) checkInterrupt();
}

// To its end.
std::string readAll(const Descriptor& file, bool pipe, const std::string& path) {
  constexpr std::size_t kPipeMost = 1U << 30;  // also of what is trusted of a file's size
  std::string bytes;
  struct stat status {};
  if (!pipe && ::fstat(file.value(), &status) == 0)
    bytes.reserve(std::min(static_cast<std::size_t>(status.st_size), kPipeMost));
  char block[1 << 16];
  for (;;) {
    if (pipe) waitForInput(file);
    const ssize_t count = ::read(file.value(), block, sizeof(block));
    if (count == 0) break;
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (count < 0) throw inputError(path, 0, std::string("cannot be read: ") + std::strerror(errno));
    bytes.append(block, static_cast<std::size_t>(count));
    if (pipe && bytes.size() > kPipeMost) throw inputError(path, 0, "is a pipe of more than 1 GiB");
    checkInterrupt();
  }
  return bytes;
}

}  // namespace

bool fileExists(const std::string& path) {
  std::error_code error;
  return std::filesystem::status(path, error).type() != std::filesystem::file_type::not_found;
}

std::string readBytes(const std::string& path) {
  // Not blocking: opening a pipe would wait for its writer, whatever signals come.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file.isOpen()) throw inputError(path, 0, std::string("cannot be opened: ") + std::strerror(errno));
  const std::optional<FileNumber> pipe = pipeNumber(file, path);
  if (pipe)
    if (std::optional<std::string> known = remembered(*pipe)) return *known;
  std::string bytes = readAll(file, pipe.has_value(), path);
  if (pipe) remember(*pipe, bytes);
  return bytes;
}

std::string readTextFile(const std::string& path) {
  std::string text = readBytes(path);
  constexpr std::string_view mark = "\xef\xbb\xbf";  // before UTF-8, as spreadsheets write it
  if (text.starts_with(mark)) text.erase(0, mark.size());
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff"))
    throw inputError(path, 0, "is written in UTF-16, expected UTF-8 or ASCII");
  return text;
}

}  // namespace medulla
