#include "render/ffmpeg.h"

#include <mutex>
#include <stdexcept>
#include <string>

#include "render/shared_library.h"

namespace medulla {

#define MEDULLA_DEFINE(name) decltype(&::name) name = nullptr;  // NOLINT(bugprone-macro-parentheses)
MEDULLA_AVUTIL_FUNCTIONS(MEDULLA_DEFINE)
MEDULLA_AVCODEC_FUNCTIONS(MEDULLA_DEFINE)
MEDULLA_AVFORMAT_FUNCTIONS(MEDULLA_DEFINE)
MEDULLA_AVFILTER_FUNCTIONS(MEDULLA_DEFINE)
#undef MEDULLA_DEFINE

// What is found under a version's name has the structures that the headers describe.
static SharedLibrary libraryOf(const std::string& name, int version) {
  return SharedLibrary((name + ".so." + std::to_string(version)).c_str());
}

#define MEDULLA_FIND(name) library.find(#name, name);

void loadEncoders() {
  static std::once_flag once;
  std::call_once(once, [] {
    SharedLibrary library = libraryOf("libavutil", LIBAVUTIL_VERSION_MAJOR);
    MEDULLA_AVUTIL_FUNCTIONS(MEDULLA_FIND)
    library = libraryOf("libavcodec", LIBAVCODEC_VERSION_MAJOR);
    MEDULLA_AVCODEC_FUNCTIONS(MEDULLA_FIND)
    library = libraryOf("libavformat", LIBAVFORMAT_VERSION_MAJOR);
    MEDULLA_AVFORMAT_FUNCTIONS(MEDULLA_FIND)
  });
}

void loadFilters() {
  static std::once_flag once;
  std::call_once(once, [] {
    const SharedLibrary library = libraryOf("libavfilter", LIBAVFILTER_VERSION_MAJOR);
    MEDULLA_AVFILTER_FUNCTIONS(MEDULLA_FIND)
  });
}

#undef MEDULLA_FIND

int checkedAv(int code) {
  if (code >= 0) return code;
  char words[AV_ERROR_MAX_STRING_SIZE] = {};
  av_strerror(code, words, sizeof words);
  throw std::runtime_error(words);
}

}  // namespace medulla
