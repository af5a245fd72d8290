#include "render/output_folder.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <stdexcept>

namespace medulla {

void requireName(const std::string& path) {
  if (path == "-") throw std::runtime_error("-: is no file; standard output holds the results, name a file");
}

OutputFolder::OutputFolder(const std::string& path) {
  requireName(path);
  std::error_code error;
  std::filesystem::path missing = path;
  // A link that leads nowhere is there, and not ours to remove.
  const auto isMissing = [&](const std::filesystem::path& p) {
    return std::filesystem::symlink_status(p, error).type() == std::filesystem::file_type::not_found;
  };
  for (; !missing.empty() && isMissing(missing); missing = missing.parent_path()) made_.push_back(missing.string());
  std::filesystem::create_directories(path, error);
  if (!error) return;
  removeEmpty();
  throw std::runtime_error(fmt::format("{}: cannot be made: {}", path, error.message()));
}

OutputFolder::~OutputFolder() {
  removeEmpty();
}

void OutputFolder::removeEmpty() const {
  for (const std::string& folder : made_) rmdir(folder.c_str());
}

}  // namespace medulla
