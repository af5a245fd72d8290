#include "render/gl_functions.h"

#include <mutex>
#include <stdexcept>
#include <string>

namespace medulla {

#define MEDULLA_DEFINE(name) decltype(&::name) name = nullptr;  // NOLINT(bugprone-macro-parentheses)
MEDULLA_GL_FUNCTIONS(MEDULLA_DEFINE)
#undef MEDULLA_DEFINE

void useGlFunctionsOf(GlAddress address) {
  static std::mutex mutex;
  static GlAddress last = nullptr;
  const std::lock_guard lock(mutex);
  if (address == last) return;
  last = nullptr;  // where one is missing the table is of neither
  const auto find = [address](const char* name) {
    void (*function)() = address(name);
    if (function == nullptr) throw std::runtime_error(std::string("OpenGL has no ") + name);
    return function;
  };
#define MEDULLA_FIND(name) name = reinterpret_cast<decltype(&::name)>(find(#name));
  MEDULLA_GL_FUNCTIONS(MEDULLA_FIND)
#undef MEDULLA_FIND
  last = address;
}

}  // namespace medulla
