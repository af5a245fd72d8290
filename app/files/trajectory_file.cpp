#include "app/files/trajectory_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "app/files/input_error.h"
#include "app/files/number_text.h"
#include "app/files/text_file.h"

namespace medulla {

// The first nine are required, the last three optional.
static constexpr std::array<std::string_view, 12> columnNames = {"t[s]", "x[m]", "y[m]", "z[m]",  "qw",    "qx",
                                                                 "qy",   "qz",   "grip", "fx[N]", "fy[N]", "fz[N]"};
static constexpr std::size_t requiredColumns = 9;
static constexpr std::string_view requiredHeader = "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip";
enum Column { time, x, y, z, qw, qx, qy, qz, grip };

static std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

static void splitRow(std::string_view row, std::vector<std::string_view>& cells) {
  cells.clear();
  while (true) {
    const std::size_t comma = row.find(',');
    cells.push_back(trimmed(row.substr(0, comma)));
    if (comma == std::string_view::npos) return;
    row.remove_prefix(comma + 1);
  }
}

static void checkHeader(const std::vector<std::string_view>& cells, const std::string& name, int line) {
  for (std::size_t k = 0; k < requiredColumns; ++k)
    if (std::find(cells.begin(), cells.end(), columnNames[k]) == cells.end())
      throw inputError(name, line, fmt::format("column {} is missing, expected {}", columnNames[k], requiredHeader));
  for (std::size_t k = 0; k < std::min(cells.size(), columnNames.size()); ++k)
    if (cells[k] != columnNames[k])
      throw inputError(
          name, line,
          fmt::format("column {} is '{}', expected {}[,fx[N],fy[N],fz[N]]", k + 1, cells[k], requiredHeader));
  if (cells.size() != requiredColumns && cells.size() != columnNames.size())
    throw inputError(name, line,
                     fmt::format("{} columns, expected {}[,fx[N],fy[N],fz[N]]", cells.size(), requiredHeader));
}

static double numberIn(std::string_view cell, std::string_view column, const std::string& name, int line) {
  const std::optional<double> value = parseNumber<double>(cell);
  if (!value) throw inputError(name, line, fmt::format("column {} is '{}', expected a finite number", column, cell));
  return *value;
}

static ToolSample sampleOfRow(const std::vector<double>& row, const std::string& name, int line) {
  ToolSample sample;
  sample.time = row[time];
  sample.position = {row[x], row[y], row[z]};
  for (std::size_t k = x; k <= z; ++k)
    if (std::abs(row[k]) > toolReach)
      throw inputError(
          name, line,
          fmt::format("column {} is {}, expected metres within {} of the origin", columnNames[k], row[k], toolReach));
  const Eigen::Quaterniond orientation(row[qw], row[qx], row[qy], row[qz]);
  if (!(std::abs(orientation.norm() - 1) <= 1e-3))
    throw inputError(name, line, fmt::format("quaternion qw,qx,qy,qz has length {}, expected 1", orientation.norm()));
  sample.worldFromTool = orientation.normalized();
  sample.grip = row[grip];
  if (sample.grip < 0 || sample.grip > 1)
    throw inputError(name, line, fmt::format("column grip is {}, expected 0 (open) to 1 (closed)", sample.grip));
  return sample;
}

Trajectory parseTrajectory(std::string_view text, const std::string& name) {
  Trajectory trajectory;
  std::vector<std::string_view> cells;
  std::vector<double> row;
  std::size_t columns = 0;  // 0 until the header was read
  for (int line = 1; !text.empty(); ++line) {
    const std::size_t end = text.find('\n');
    std::string_view content = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    content = trimmed(content.substr(0, content.find('#')));
    if (content.empty()) continue;
    splitRow(content, cells);
    if (columns == 0) {
      checkHeader(cells, name, line);
      columns = cells.size();
      continue;
    }
    if (cells.size() != columns)
      throw inputError(name, line,
                       fmt::format("{} columns in this row, expected {} as in the header", cells.size(), columns));
    row.clear();
    for (std::size_t k = 0; k < columns; ++k) row.push_back(numberIn(cells[k], columnNames[k], name, line));
    const ToolSample sample = sampleOfRow(row, name, line);
    if (!trajectory.samples.empty() && sample.time <= trajectory.samples.back().time)
      throw inputError(name, line,
                       fmt::format("time {} does not follow {}, expected strictly increasing t[s]", sample.time,
                                   trajectory.samples.back().time));
    trajectory.samples.push_back(sample);
  }
  if (columns == 0) throw inputError(name, 0, fmt::format("no header, expected {}", requiredHeader));
  if (trajectory.samples.empty()) throw inputError(name, 0, "no rows after the header, expected at least one");
  return trajectory;
}

Trajectory readTrajectory(const std::string& path) {
  return parseTrajectory(readTextFile(path), path);
}

}  // namespace medulla
