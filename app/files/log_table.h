#pragma once

#include <string>
#include <vector>

namespace medulla {

// A log as read back: a header of column names, then rows of numbers.
struct LogTable {
  std::string path;
  std::vector<std::string> columns;
  std::vector<int> lines;                      // of each row in the file
  std::vector<std::vector<std::string>> text;  // [row][column]
  std::vector<std::vector<double>> value;      // the same as numbers
};

// Throws std::runtime_error "FILE:LINE: ..." where it is missing or has no header, and on rows that have not as many
// cells as the header or a cell that is no finite number.
LogTable readLog(const std::string& path);

}  // namespace medulla
