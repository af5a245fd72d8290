#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <utility>

// Standard output, which has results and nothing else, and standard error, which has all else.
namespace medulla {

// Before any file is opened: a file that took the number of a standard stream that is closed would get what is meant
// for that. Writing to a closed standard output fails afterwards.
void openStandardStreams();

// Notes, warnings, complaints, progress. Where they cannot be written (a full disk, a reader who left) they are lost,
// and the run goes on.
template <class... T>
void tell(fmt::format_string<T...> format, T&&... values) {
  const std::string text = fmt::format(format, std::forward<T>(values)...);
  std::fwrite(text.data(), 1, text.size(), stderr);
}

// Throws std::runtime_error where standard output cannot be written.
void flushResults();

// What a failed write left in errno: where a reader has left it ends the process by SIGPIPE, as who reads the first
// lines alone expects of any program.
void endWhereReaderLeft(int error);

}  // namespace medulla
