#include "render/gl_context.h"

#include <sched.h>

#include <charconv>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <vector>

namespace medulla {

std::unique_ptr<GlContext> makeGlContext(const std::string& name) {
#ifdef MEDULLA_HAVE_OSMESA
  if (name == "auto" || name == "osmesa") return makeOsmesaContext();
#endif
#ifdef MEDULLA_HAVE_EGL
  if (name == "auto" || name == "egl") return makeEglContext();
#endif
  if (name == "osmesa") throw std::runtime_error("context osmesa is not built in: install libosmesa6-dev and rebuild");
  if (name == "egl") throw std::runtime_error("context egl is not built in: install libegl-dev and rebuild");
  throw std::runtime_error("unknown context '" + name + "', expected auto, osmesa or egl");
}

void spreadRasterThreads() {
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0) return;
  std::vector<int> cores;
  for (int c = 0; c < CPU_SETSIZE; ++c)
    if (CPU_ISSET(c, &allowed)) cores.push_back(c);

  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task", error)) {
    std::string name;
    std::getline(std::ifstream(entry.path() / "comm") >> std::ws, name);
    const std::string prefix = "llvmpipe-";
    if (!name.starts_with(prefix)) continue;
    unsigned worker = 0;
    std::from_chars(name.data() + prefix.size(), name.data() + name.size(), worker);
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(cores[worker % cores.size()], &one);
    sched_setaffinity(std::stoi(entry.path().filename()), sizeof one, &one);
  }
}

}  // namespace medulla
