#include <fmt/format.h>

#include "app/commands/commands.h"
#include "haptics/buckets.h"

namespace medulla {

int printVersion() {
  fmt::print("medulla {}\n", MEDULLA_VERSION);
  fmt::print("compiler {}\n", MEDULLA_COMPILER);
  fmt::print("embree {}\n", embreeVersion());
  std::string context;
  try {
    context = Renderer({.width = kPictureSideMin, .height = kPictureSideMin}).description();
  } catch (const std::runtime_error& error) {
    context = error.what();
  }
  fmt::print("renderer {}\n", context);
  return 0;
}

}  // namespace medulla
