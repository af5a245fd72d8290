#include <stdexcept>

#include "app/scene.h"
#include "tests/fuzz/memory_file.h"

// Any bytes: a scene or one clear line. The first line may be an override, PATH=VALUE, behind a '#'.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  std::vector<medulla::SceneOverride> overrides;
  std::size_t start = 0;
  if (text.starts_with('#')) {
    start = std::min(text.find('\n'), size);
    const std::size_t equals = std::min(text.find('='), start);
    const std::size_t value = std::min(equals + 1, start);
    overrides.push_back({text.substr(1, equals - 1), text.substr(value, start - value)});
  }
  const medulla::MemoryFile file(data + start, size - start);
  try {
    medulla::readScene(file.path(), overrides);
  } catch (const std::runtime_error& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) std::abort();
  }
  return 0;
}
