#include "render/shared_library.h"

#include <dlfcn.h>

#include <stdexcept>

namespace medulla {

static void* existing(void* p) {
  if (p == nullptr) throw std::runtime_error(dlerror());
  return p;
}

SharedLibrary::SharedLibrary(const char* name) : handle_(existing(dlopen(name, RTLD_NOW | RTLD_LOCAL))) {}

void* SharedLibrary::address(const char* symbol) const {
  return existing(dlsym(handle_, symbol));
}

}  // namespace medulla
