#pragma once

#include <stdexcept>
#include <string>

namespace medulla {

// Every complaint about a file starts alike: "FILE:LINE: message", without the line where none exists (line 0).
inline std::runtime_error inputError(const std::string& path, int line, const std::string& message) {
  return std::runtime_error(line > 0 ? path + ":" + std::to_string(line) + ": " + message : path + ": " + message);
}

}  // namespace medulla
