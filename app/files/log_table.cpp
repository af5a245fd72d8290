#include "app/files/log_table.h"

#include <fmt/format.h>

#include "app/files/csv_rows.h"
#include "app/files/input_error.h"
#include "app/files/text_file.h"

namespace medulla {

LogTable readLog(const std::string& path) {
  const std::string text = readTextFile(path);
  LogTable table;
  table.path = path;
  CsvRows rows(text, path);
  if (!rows.next()) throw inputError(path, 0, "no header, expected the names of a log's columns");
  rows.requireCommas();
  table.columns.assign(rows.cells().begin(), rows.cells().end());
  if (table.columns[0] != "t") rows.fail("this is no log: expected a header that begins with the column t");
  const std::string expected = fmt::format("{} as in the header", table.columns.size());
  while (rows.next()) {
    rows.requireCells(table.columns.size(), expected);
    std::vector<double>& value = table.value.emplace_back();
    for (std::size_t k = 0; k < table.columns.size(); ++k) value.push_back(rows.number(k, table.columns[k]));
    table.text.emplace_back(rows.cells().begin(), rows.cells().end());
    table.lines.push_back(rows.line());
  }
  return table;
}

}  // namespace medulla
