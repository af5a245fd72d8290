#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace medulla {

// A log as read back: a header of column names, then rows of numbers.
struct LogTable {
  std::string path;
  std::vector<std::string> columns;
  std::vector<int> lines;  // of each row in the file
  std::shared_ptr<const std::string> content;
  std::vector<std::vector<std::string_view>> text;  // [row][column] of the content
  std::vector<std::vector<double>> value;           // the same as numbers
  bool isCut = false;                               // the file ends in the midst of one more row
};

// Throws std::runtime_error "FILE:LINE: ..." where it is missing or has no header, and on rows that have not as many
// cells as the header or a cell that is no finite number, or whose time goes back. A last row without its end, as a
// full disk or a killed copy leaves it, is no fault: see isCut.
LogTable readLog(const std::string& path);

// Where a column stands in each row; as many as there are columns where none has that name.
std::size_t columnOf(const LogTable& log, std::string_view name);

}  // namespace medulla
