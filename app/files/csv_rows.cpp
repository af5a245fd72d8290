#include "app/files/csv_rows.h"

#include <fmt/format.h>

#include <utility>

#include "app/files/input_error.h"
#include "app/files/number_text.h"
#include "app/files/text.h"
#include "app/files/text_lines.h"

namespace medulla {

// Spreadsheets and statistics programs put quotes around text. A separator or # within them is one all the same.
static std::string_view unquoted(std::string_view cell) {
  const bool quoted = cell.size() >= 2 && cell.front() == '"' && cell.back() == '"';
  return quoted ? trimmed(cell.substr(1, cell.size() - 2)) : cell;
}

// The next line without its comment and the white space around it; `rest` loses it.
static std::string_view takeRow(std::string_view& rest) {
  const std::string_view line = takeLine(rest);
  return trimmed(line.substr(0, line.find('#')));
}

bool CsvRows::next() {
  cells_.clear();
  while (cells_.empty() && !rest_.empty()) {
    std::string_view row = takeRow(rest_);
    ++line_;
    while (!row.empty()) {
      const std::size_t end = separator_ == ' ' ? row.find_first_of(" \t") : row.find(separator_);
      cells_.push_back(unquoted(trimmed(row.substr(0, end))));
      if (end == std::string_view::npos) break;
      row.remove_prefix(end + 1);
      if (separator_ == ' ')
        row = trimmed(row);
      else if (row.empty())
        cells_.push_back(row);  // behind a separator at the end
    }
  }
  return !cells_.empty();
}

char CsvRows::separatorOf(std::string_view text) {
  std::string_view row;
  while (row.empty() && !text.empty()) row = takeRow(text);
  for (const char separator : {',', ';'})
    if (row.find(separator) != std::string_view::npos) return separator;
  return ' ';
}

double CsvRows::number(std::size_t cell, std::string_view column) const {
  const std::optional<double> value = parseNumber<double>(cells_.at(cell));
  if (!value) fail(fmt::format("column {} is {}, expected a finite number", column, inQuotes(cells_[cell])));
  return *value;
}

int CsvRows::index(std::size_t cell, std::string_view column, std::size_t count) const {
  const std::optional<long long> value = parseNumber<long long>(cells_.at(cell));
  if (!value || *value < 0 || *value >= static_cast<long long>(count))
    fail(fmt::format("column {} is {}, expected a whole number from 0 to {}", column, inQuotes(cells_[cell]),
                     count - 1));
  return static_cast<int>(*value);
}

void CsvRows::requireCommas() const {
  if (cells_.size() != 1) return;
  for (const auto& [separator, name] : {std::pair(';', "semicolons"), {'\t', "tabs"}})
    if (cells_[0].find(separator) != std::string_view::npos)
      fail(fmt::format("columns are separated by {}, expected commas", name));
}

void CsvRows::requireCells(std::size_t count, const std::string& expected) const {
  if (cells_.size() != count) fail(fmt::format("{} columns in this row, expected {}", cells_.size(), expected));
}

void CsvRows::fail(const std::string& message) const {
  throw inputError(name_, line_, message);
}

}  // namespace medulla
