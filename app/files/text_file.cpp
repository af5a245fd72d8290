#include "app/files/text_file.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string_view>

#include "app/files/input_error.h"
#include "app/interrupt.h"

namespace medulla {

namespace {

class Descriptor {
 public:
  // Not blocking: opening a pipe would wait for its writer, whatever signals come.
  explicit Descriptor(const std::string& path) : value_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {}
  ~Descriptor() {
    if (value_ >= 0) ::close(value_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int value() const { return value_; }

 private:
  int value_;
};

// Whether the file is a pipe. Anything but that and a regular file is refused: a device may have no end.
bool isPipe(const Descriptor& file, const std::string& path) {
  struct stat status {};
  if (::fstat(file.value(), &status) != 0) throw inputError(path, 0, std::strerror(errno));
  if (S_ISDIR(status.st_mode)) throw inputError(path, 0, "is a folder, expected a file");
  if (!S_ISREG(status.st_mode) && !S_ISFIFO(status.st_mode))
    throw inputError(path, 0, "is a device, expected a file or a pipe");
  return S_ISFIFO(status.st_mode);
}

void waitForInput(const Descriptor& pipe) {
  constexpr int kPatience = 100;  // ms, until interrupts are looked for again
  pollfd waiting{pipe.value(), POLLIN, 0};
  while (::poll(&waiting, 1, kPatience) <= 0) checkInterrupt();
}

}  // namespace

std::string readTextFile(const std::string& path) {
  const Descriptor file(path);
  if (file.value() < 0) throw inputError(path, 0, std::string("cannot be opened: ") + std::strerror(errno));
  const bool pipe = isPipe(file, path);
  constexpr std::size_t kPipeMost = 1U << 30;
  std::string text;
  char block[1 << 16];
  for (;;) {
    if (pipe) waitForInput(file);
    const ssize_t count = ::read(file.value(), block, sizeof(block));
    if (count == 0) break;
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (count < 0) throw inputError(path, 0, std::string("cannot be read: ") + std::strerror(errno));
    text.append(block, static_cast<std::size_t>(count));
    if (pipe && text.size() > kPipeMost) throw inputError(path, 0, "is a pipe of more than 1 GiB");
    checkInterrupt();
  }
  constexpr std::string_view mark = "\xef\xbb\xbf";  // before UTF-8, as spreadsheets write it
  if (text.starts_with(mark)) text.erase(0, mark.size());
  return text;
}

}  // namespace medulla
