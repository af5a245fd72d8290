#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace medulla {

// Walks a table in text row by row, for formats whose errors must name the line. Cells come without the white space
// and the double quotes around them (which do not keep a separator from being one); # starts a comment; rows without
// content are skipped.
class CsvRows {
 public:
  // `text` must outlive this object; `name` is the path that errors begin with. A blank as separator stands for any run
  // of blanks and tabs.
  CsvRows(std::string_view text, std::string name, char separator = ',')
      : rest_(text), name_(std::move(name)), separator_(separator) {}

  // Moves to the next row with content. False at the end.
  bool next();

  // A table of this text goes by: comma, semicolon or blank, the first of these that its first row holds.
  static char separatorOf(std::string_view text);

  const std::vector<std::string_view>& cells() const { return cells_; }
  int line() const { return line_; }  // 1-based

  // The whole cell as a finite number, or as a whole one from 0 to `count` - 1; `column` is what errors call it.
  double number(std::size_t cell, std::string_view column) const;
  int index(std::size_t cell, std::string_view column, std::size_t count) const;

  // Of a header: refuses one that another separator divides, which would be one cell of all its names.
  void requireCommas() const;
  // `expected`: how errors say the count.
  void requireCells(std::size_t count, const std::string& expected) const;
  // Throws "NAME:LINE: message".
  [[noreturn]] void fail(const std::string& message) const;

 private:
  std::string_view rest_;
  std::string name_;
  char separator_;
  int line_ = 0;
  std::vector<std::string_view> cells_;
};

}  // namespace medulla
