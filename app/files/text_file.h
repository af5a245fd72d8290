#pragma once

#include <string>

namespace medulla {

// The whole file. Throws std::runtime_error "FILE: ..." where it is missing, a folder, or cannot be read.
std::string readTextFile(const std::string& path);

}  // namespace medulla
