#include "render/gl_context.h"

#include <sched.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <vector>

namespace medulla {

namespace {

struct ContextKind {
  const char* name;
  const char* package;
  std::unique_ptr<GlContext> (*make)();  // nullptr: not built in
};
constexpr ContextKind kKinds[] = {
#ifdef MEDULLA_HAVE_OSMESA
    {"osmesa", "libosmesa6-dev", makeOsmesaContext},
#else
    {"osmesa", "libosmesa6-dev", nullptr},
#endif
#ifdef MEDULLA_HAVE_EGL
    {"egl", "libegl-dev", makeEglContext},
#else
    {"egl", "libegl-dev", nullptr},
#endif
};

// Mesa keeps compiled shaders on disk by keys that leave out how wide its vectors are: where another width was asked
// for before, it would run code for buffers of another size (22.3.6 overruns the heap).
void keepNoShadersOfOtherWidths() {
  if (std::getenv("LP_NATIVE_VECTOR_WIDTH")) setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
}

// Mesa dies of these by a signal, without a word.
void refuseWhatCrashesMesa(const std::string& kind) {
  const auto refuse = [](const char* variable, const std::vector<std::string>& allowed, const std::string& expected) {
    const char* value = std::getenv(variable);
    if (!value || !*value || std::find(allowed.begin(), allowed.end(), value) != allowed.end()) return;
    throw std::runtime_error(std::string("the environment has ") + variable + "=" + value + ", expected " + expected);
  };
  if (kind == "osmesa") refuse("GALLIUM_DRIVER", {"llvmpipe", "softpipe"}, "llvmpipe, softpipe or nothing");
  refuse("LP_NATIVE_VECTOR_WIDTH", {"128", "256"}, "128, 256 or nothing");
}

}  // namespace

std::unique_ptr<GlContext> makeGlContext(const std::string& name) {
  keepNoShadersOfOtherWidths();
  std::string reasons;
  for (const ContextKind& kind : kKinds) {
    if (name != "auto" && name != kind.name) continue;
    std::string reason = std::string("not built in: install ") + kind.package + " and rebuild";
    try {
      if (kind.make) {
        refuseWhatCrashesMesa(kind.name);
        return kind.make();
      }
    } catch (const std::runtime_error& error) {
      reason = error.what();
    }
    reasons += (reasons.empty() ? "" : "; ") + std::string(kind.name) + ": " + reason;
  }
  if (reasons.empty()) throw std::runtime_error("unknown context '" + name + "', expected auto, osmesa or egl");
  throw std::runtime_error("no OpenGL context to draw with: " + reasons);
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
