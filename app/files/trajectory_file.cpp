#include "app/files/trajectory_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "app/files/csv_rows.h"
#include "app/files/input_error.h"
#include "app/files/text_file.h"

namespace medulla {

// The first nine are required, the last three optional.
static constexpr std::array<std::string_view, 12> columnNames = {"t[s]", "x[m]", "y[m]", "z[m]",  "qw",    "qx",
                                                                 "qy",   "qz",   "grip", "fx[N]", "fy[N]", "fz[N]"};
static constexpr std::size_t requiredColumns = 9;
static constexpr std::string_view requiredHeader = "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip";
enum Column { time, x, y, z, qw, qx, qy, qz, grip };

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
  CsvRows rows(text, name);
  if (!rows.next()) throw inputError(name, 0, fmt::format("no header, expected {}", requiredHeader));
  checkHeader(rows.cells(), name, rows.line());
  const std::size_t columns = rows.cells().size();
  std::vector<double> row;
  while (rows.next()) {
    if (rows.cells().size() != columns)
      rows.fail(fmt::format("{} columns in this row, expected {} as in the header", rows.cells().size(), columns));
    row.clear();
    for (std::size_t k = 0; k < columns; ++k) row.push_back(rows.number(k, columnNames[k]));
    const ToolSample sample = sampleOfRow(row, name, rows.line());
    if (!trajectory.samples.empty() && sample.time <= trajectory.samples.back().time)
      rows.fail(fmt::format("time {} does not follow {}, expected strictly increasing t[s]", sample.time,
                            trajectory.samples.back().time));
    trajectory.samples.push_back(sample);
  }
  if (trajectory.samples.empty()) throw inputError(name, 0, "no rows after the header, expected at least one");
  return trajectory;
}

Trajectory readTrajectory(const std::string& path) {
  return parseTrajectory(readTextFile(path), path);
}

}  // namespace medulla
