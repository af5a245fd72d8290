#include "app/files/log_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/files/csv_rows.h"
#include "app/files/input_error.h"
#include "app/files/number_text.h"
#include "app/files/text_file.h"
#include "app/interrupt.h"

namespace medulla {

// Of the line that no line end follows; 0 where there is none.
static std::ptrdiff_t openLine(const std::string& text) {
  return text.ends_with('\n') ? 0 : std::count(text.begin(), text.end(), '\n') + 1;
}

// Whether the file can have ended within the row: no line end, and a number or more is missing. A whole last row may
// have lost its line end in an editor.
static bool endsWithin(const CsvRows& rows, std::ptrdiff_t open, std::size_t columns) {
  if (rows.line() != open) return false;
  return rows.cells().size() < columns || (rows.cells().size() == columns && !parseNumber<double>(rows.cells().back()));
}

LogTable readLog(const std::string& path) {
  LogTable table;
  table.path = path;
  table.content = std::make_shared<const std::string>(readTextFile(path));
  const std::string& text = *table.content;
  CsvRows rows(text, path);
  if (!rows.next()) throw inputError(path, 0, "no header, expected the names of a log's columns");
  rows.requireCommas();
  table.columns.assign(rows.cells().begin(), rows.cells().end());
  if (table.columns[0] != "t") rows.fail("this is no log: expected a header that begins with the column t");
  const std::string expected = fmt::format("{} as in the header", table.columns.size());
  const std::ptrdiff_t open = openLine(text);
  while (rows.next()) {
    checkInterrupt();
    table.isCut = endsWithin(rows, open, table.columns.size());
    if (table.isCut) break;
    rows.requireCells(table.columns.size(), expected);
    std::vector<double>& value = table.value.emplace_back();
    for (std::size_t k = 0; k < table.columns.size(); ++k) value.push_back(rows.number(k, table.columns[k]));
    if (const std::size_t n = table.value.size(); n > 1 && value[0] < table.value[n - 2][0])
      rows.fail(fmt::format("t goes back from {} to {}: expected rows in the order of time", table.value[n - 2][0],
                            value[0]));
    table.text.push_back(rows.cells());
    table.lines.push_back(rows.line());
  }
  return table;
}

std::size_t columnOf(const LogTable& log, std::string_view name) {
  return static_cast<std::size_t>(std::find(log.columns.begin(), log.columns.end(), name) - log.columns.begin());
}

}  // namespace medulla
