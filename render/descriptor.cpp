#include "render/descriptor.h"

#include <unistd.h>

#include <cerrno>

#include "render/partial_file.h"

namespace medulla {

bool Descriptor::close() {
  const int value = std::exchange(value_, -1);
  return value < 0 || ::close(value) == 0;
}

void writeAll(const Descriptor& to, std::string_view bytes, const std::string& path) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(to.value(), bytes.data(), bytes.size());
    if (count < 0 && errno != EINTR) throw unwritable(path);
    if (count > 0) bytes.remove_prefix(static_cast<std::size_t>(count));
  }
}

}  // namespace medulla
