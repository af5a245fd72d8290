#include "app/files/csv_rows.h"

#include <fmt/format.h>

#include "app/files/input_error.h"
#include "app/files/number_text.h"
#include "app/files/text_lines.h"

namespace medulla {

static std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

bool CsvRows::next() {
  cells_.clear();
  while (cells_.empty() && !rest_.empty()) {
    const std::size_t end = rest_.find('\n');
    std::string_view row = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    ++line_;
    row = trimmed(row.substr(0, row.find('#')));
    while (!row.empty()) {
      const std::size_t comma = row.find(',');
      cells_.push_back(trimmed(row.substr(0, comma)));
      if (comma == std::string_view::npos) break;
      row.remove_prefix(comma + 1);
      if (row.empty()) cells_.push_back(row);  // behind a comma at the end
    }
  }
  return !cells_.empty();
}

double CsvRows::number(std::size_t cell, std::string_view column) const {
  const std::optional<double> value = parseNumber<double>(cells_.at(cell));
  if (!value) fail(fmt::format("column {} is {}, expected a finite number", column, quoted(cells_[cell])));
  return *value;
}

int CsvRows::index(std::size_t cell, std::string_view column, std::size_t count) const {
  const std::optional<long long> value = parseNumber<long long>(cells_.at(cell));
  if (!value || *value < 0 || *value >= static_cast<long long>(count))
    fail(fmt::format("column {} is {}, expected a whole number from 0 to {}", column, quoted(cells_[cell]), count - 1));
  return static_cast<int>(*value);
}

void CsvRows::fail(const std::string& message) const {
  throw inputError(name_, line_, message);
}

}  // namespace medulla
