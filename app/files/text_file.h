#pragma once

#include <string>

namespace medulla {

// Whether there is something of that name, or the system does not say: then reading it tells why.
bool fileExists(const std::string& path);

// The whole of a file, or of a pipe up to 1 GiB, which gives the same each time, though it can be read but once. Throws
// std::runtime_error "FILE: ..." where it is missing, a folder, a device, or cannot be read, and Interrupted after a
// signal, also while nobody writes into the pipe.
std::string readBytes(const std::string& path);
std::string readTextFile(const std::string& path);  // without a mark before it; UTF-16 is refused

}  // namespace medulla
