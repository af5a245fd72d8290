#pragma once

#include <filesystem>
#include <string>

namespace medulla {

// The file that a symbolic link stands for, also where there is none yet, so that what is renamed to it replaces the
// file and not the link; `path` itself where it is no link.
inline std::string behindLink(const std::string& path) {
  constexpr int kMost = 40;  // as many as Linux follows: a circle ends
  std::filesystem::path target = path;
  std::error_code error;
  for (int k = 0; k < kMost && std::filesystem::is_symlink(target, error); ++k)
    target = target.parent_path() / std::filesystem::read_symlink(target, error);
  return target.string();
}

}  // namespace medulla
