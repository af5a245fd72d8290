#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/commands/commands.h"
#include "app/files/log_table.h"

namespace medulla {

namespace {

// Largest magnitude of each column in either log: what a tolerance is a share of. Columns have units of their own, and
// values that pass through zero have no relative error.
std::vector<double> scales(const LogTable& a, const LogTable& b) {
  std::vector<double> out(a.columns.size(), 0);
  for (const LogTable* table : {&a, &b})
    for (const std::vector<double>& row : table->value)
      for (std::size_t k = 0; k < out.size(); ++k) out[k] = std::max(out[k], std::abs(row[k]));
  return out;
}

struct Cell {
  std::size_t row, column;
};

std::optional<Cell> firstDifference(const LogTable& a, const LogTable& b, double tolerance) {
  const std::vector<double> scale = scales(a, b);
  for (std::size_t r = 0; r < std::min(a.value.size(), b.value.size()); ++r) {
    for (std::size_t k = 0; k < a.columns.size(); ++k) {
      const bool differs =
          tolerance > 0 ? std::abs(a.value[r][k] - b.value[r][k]) > tolerance * scale[k] : a.text[r][k] != b.text[r][k];
      if (differs) return Cell{r, k};
    }
  }
  return std::nullopt;
}

int differing(std::vector<Result> results) {
  results.insert(results.begin(), {"equal", "no", ""});
  printResults(results);
  return 3;
}

}  // namespace

int runCompare(const CompareOptions& options) {
  const LogTable a = readLog(options.a), b = readLog(options.b);
  const auto [inA, inB] = std::mismatch(a.columns.begin(), a.columns.end(), b.columns.begin(), b.columns.end());
  if (inA != a.columns.end() || inB != b.columns.end())
    return differing({{"column", fmt::format("{}", inA - a.columns.begin() + 1), ""},
                      {"a", inA != a.columns.end() ? *inA : "none", ""},
                      {"b", inB != b.columns.end() ? *inB : "none", ""}});
  if (const std::optional<Cell> cell = firstDifference(a, b, options.tolerance)) {
    const auto [row, column] = *cell;
    return differing({{"row", fmt::format("{}", row + 1), ""},
                      {"t", a.text[row][0], "s"},
                      {"field", a.columns[column], ""},
                      {"a", a.text[row][column], ""},
                      {"b", b.text[row][column], ""},
                      {"line_a", fmt::format("{}", a.lines[row]), ""},
                      {"line_b", fmt::format("{}", b.lines[row]), ""}});
  }
  if (a.value.size() != b.value.size())
    return differing(
        {{"rows_a", fmt::format("{}", a.value.size()), ""}, {"rows_b", fmt::format("{}", b.value.size()), ""}});
  printResults({{"equal", "yes", ""}, {"rows", fmt::format("{}", a.value.size()), ""}});
  return 0;
}

}  // namespace medulla
