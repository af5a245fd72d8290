#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace medulla {

// The next line, without what ends it (LF, CRLF, or CR alone, as spreadsheets on a Macintosh write); `rest` loses both.
std::string_view takeLine(std::string_view& rest);

// Walks a text line by line and splits it into words, for formats whose errors must name the line. # starts a
// comment.
class TextLines {
 public:
  // `text` must outlive this object; `name` is the path that errors begin with. `joined`: a backslash at the end of a
  // line joins the next one.
  TextLines(std::string_view text, std::string name, bool joined = false)
      : rest_(text), name_(std::move(name)), joined_(joined) {}

  // Moves to the next line that holds a word. False at the end.
  bool next();

  const std::vector<std::string_view>& words() const { return words_; }
  int line() const { return line_; }  // 1-based

  // The whole word, exact; NaN, infinity and what does not fit are refused.
  double number(std::string_view word) const;
  long long integer(std::string_view word) const;

  // Throws "NAME:LINE: message".
  [[noreturn]] void fail(const std::string& message) const;

 private:
  bool splitLine();

  std::string_view rest_;
  std::string name_;
  bool joined_;
  int line_ = 0;
  std::vector<std::string_view> words_;
};

}  // namespace medulla
