#include "app/files/text_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string_view>

#include "app/files/input_error.h"

namespace medulla {

std::string readTextFile(const std::string& path) {
  std::error_code ignored;
  // fopen() opens a folder without complaint and only reading fails, with "Is a directory" on some systems alone.
  if (std::filesystem::is_directory(path, ignored)) throw inputError(path, 0, "is a folder, expected a file");
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) throw inputError(path, 0, std::string("cannot be opened: ") + std::strerror(errno));
  std::string text;
  char block[1 << 16];
  while (const std::size_t count = std::fread(block, 1, sizeof(block), file.get())) text.append(block, count);
  if (std::ferror(file.get())) throw inputError(path, 0, std::string("cannot be read: ") + std::strerror(errno));
  constexpr std::string_view mark = "\xef\xbb\xbf";  // before UTF-8, as spreadsheets write it
  if (text.starts_with(mark)) text.erase(0, mark.size());
  return text;
}

}  // namespace medulla
