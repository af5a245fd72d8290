#include <unistd.h>

#include <filesystem>
#include <stdexcept>
#include <string>

#include "app/files/model_file.h"
#include "app/files/text_file.h"
#include "tests/fuzz/memory_file.h"

// Any bytes: one clear line, or a model that is written and read again as the same one.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace medulla;
  const MemoryFile file(data, size);
  SoftBodyModel model;
  try {
    model = readModel(file.path());
  } catch (const std::runtime_error& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) std::abort();
    return 0;
  }
  const std::string path =
      std::filesystem::temp_directory_path() / ("medulla_model_fuzz_" + std::to_string(::getpid()) + ".xml");
  writeModel(path, model);
  const std::string once = readTextFile(path);
  writeModel(path, readModel(path));
  if (readTextFile(path) != once) std::abort();
  return 0;
}
