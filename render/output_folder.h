#pragma once

#include <string>
#include <vector>

namespace medulla {

// Other programs take - for standard output, which carries results alone here. Throws std::runtime_error of that name.
void requireName(const std::string& path);

// A folder for outputs, made where it is missing, with those above it. What was made here and is empty at the end,
// since what was to fill it failed, goes again. Throws std::runtime_error with path and reason where the system
// refuses.
class OutputFolder {
 public:
  explicit OutputFolder(const std::string& path);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

 private:
  void removeEmpty() const;

  std::vector<std::string> made_;  // the innermost first
};

}  // namespace medulla
