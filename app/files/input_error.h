#pragma once

#include <stdexcept>
#include <string>

namespace medulla {

// An element of an XML file by its line and its number in the file's order: programs write many in one line.
struct ElementPlace {
  int line = 0, number = 0;
  bool operator==(const ElementPlace&) const = default;
};

// Every complaint about a file starts alike: "FILE:LINE: message", without the line where none exists (line 0).
inline std::runtime_error inputError(const std::string& path, int line, const std::string& message) {
  return std::runtime_error(line > 0 ? path + ":" + std::to_string(line) + ": " + message : path + ": " + message);
}

}  // namespace medulla
