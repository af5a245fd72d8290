#include "app/files/trajectory_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "app/files/csv_rows.h"
#include "app/files/input_error.h"
#include "app/files/number_text.h"
#include "app/files/text.h"
#include "app/files/text_file.h"

namespace medulla {

// The first nine are required, the last three optional.
static constexpr std::array<std::string_view, 12> columnNames = {"t[s]", "x[m]", "y[m]", "z[m]",  "qw",    "qx",
                                                                 "qy",   "qz",   "grip", "fx[N]", "fy[N]", "fz[N]"};
static constexpr std::size_t requiredColumns = 9;
static constexpr double kTimeReach = 1e9;  // s; doubles still tell 1 us apart, and no difference overflows
enum Column { time, x, y, z, qw, qx, qy, qz, grip, fx, fy, fz };

static std::string requiredHeader() {
  return joined(std::span(columnNames).first<requiredColumns>(), ",");
}

// Which column holds the same in another unit; empty: none.
static std::string_view inAnotherUnit(const std::vector<std::string_view>& cells, std::string_view column) {
  const std::string_view quantity = column.substr(0, column.find('[') + 1);
  const auto found = std::find_if(cells.begin(), cells.end(),
                                  [&](std::string_view cell) { return cell.starts_with(quantity) && cell != column; });
  return found == cells.end() || quantity.empty() ? std::string_view() : *found;
}

static void requireColumn(const CsvRows& header, std::string_view column) {
  const std::vector<std::string_view>& cells = header.cells();
  if (isOneOf(column, cells)) return;
  const std::string_view found = inAnotherUnit(cells, column);
  header.fail(
      fmt::format("column {} is missing, {}: a <recording> that names this file reads others, by its <columns> "
                  "and <units> (scenes/recording.xsd)",
                  column, found.empty() ? "expected " + requiredHeader() : "found " + inQuotes(found)));
}

static void checkHeader(const CsvRows& header) {
  const std::vector<std::string_view>& cells = header.cells();
  for (std::size_t k = 0; k < requiredColumns; ++k) requireColumn(header, columnNames[k]);
  for (std::size_t k = 0; k < std::min(cells.size(), columnNames.size()); ++k)
    if (cells[k] != columnNames[k])
      header.fail(
          fmt::format("column {} is {}, expected {}[,fx[N],fy[N],fz[N]]", k + 1, inQuotes(cells[k]), requiredHeader()));
  if (cells.size() != requiredColumns && cells.size() != columnNames.size())
    header.fail(fmt::format("{} columns, expected {}[,fx[N],fy[N],fz[N]]", cells.size(), requiredHeader()));
}

void addSample(Trajectory& trajectory, ToolSample sample, const std::string& name, int line) {
  if (!(std::abs(sample.time) <= kTimeReach))
    throw inputError(name, line, fmt::format("time is {} s, expected within {:.0e} s", sample.time, kTimeReach));
  for (int k = 0; k < 3; ++k)
    if (!(std::abs(sample.position[k]) <= kToolReach))
      throw inputError(name, line,
                       fmt::format("position {} is {} m, expected within {} m of the origin", "xyz"[k],
                                   sample.position[k], kToolReach));
  const double squaredLength = sample.worldFromTool.squaredNorm();
  if (!(std::abs(std::sqrt(squaredLength) - 1) <= 1e-3))
    throw inputError(name, line, fmt::format("quaternion has length {:.6g}, expected 1", std::sqrt(squaredLength)));
  if (std::abs(squaredLength - 1) > 1e-14) sample.worldFromTool.normalize();
  if (!trajectory.samples.empty() && !(sample.time > trajectory.samples.back().time))
    throw inputError(name, line,
                     fmt::format("time {} s does not follow {} s, expected strictly increasing times", sample.time,
                                 trajectory.samples.back().time));
  trajectory.samples.push_back(sample);
}

void addMeasuredForce(Trajectory& trajectory, const Eigen::Vector3d& force, const std::string& name, int line) {
  constexpr double kForceReach = 1e6;  // N
  for (int k = 0; k < 3; ++k)
    if (!(std::abs(force[k]) <= kForceReach))
      throw inputError(name, line,
                       fmt::format("measured force {} is {} N, expected within {} N", "xyz"[k], force[k], kForceReach));
  trajectory.measuredForces.push_back(force);
}

static ToolSample sampleOfRow(const std::vector<double>& row, const CsvRows& rows) {
  ToolSample sample;
  sample.time = row[time];
  sample.position = {row[x], row[y], row[z]};
  sample.worldFromTool = Eigen::Quaterniond(row[qw], row[qx], row[qy], row[qz]);
  sample.grip = row[grip];
  if (sample.grip < 0 || sample.grip > 1)
    rows.fail(fmt::format("column grip is {}, expected 0 (open) to 1 (closed)", sample.grip));
  return sample;
}

Trajectory parseTrajectory(std::string_view text, const std::string& name) {
  Trajectory trajectory;
  CsvRows rows(text, name);
  if (!rows.next()) throw inputError(name, 0, fmt::format("no header, expected {}", requiredHeader()));
  rows.requireCommas();
  checkHeader(rows);
  const std::size_t columns = rows.cells().size();
  const std::string expected = fmt::format("{} as in the header", columns);
  std::vector<double> row;
  while (rows.next()) {
    rows.requireCells(columns, expected);
    row.clear();
    for (std::size_t k = 0; k < columns; ++k) row.push_back(rows.number(k, columnNames[k]));
    if (std::abs(row[time]) > kTimeReach)
      rows.fail(
          fmt::format("time is {} s, expected seconds since the scene's start; a <recording> that names this file "
                      "takes stamps of any clock",
                      row[time]));
    addSample(trajectory, sampleOfRow(row, rows), name, rows.line());
    if (columns > requiredColumns) addMeasuredForce(trajectory, {row[fx], row[fy], row[fz]}, name, rows.line());
  }
  if (trajectory.samples.empty()) throw inputError(name, 0, "no rows after the header, expected at least one");
  return trajectory;
}

Trajectory readTrajectory(const std::string& path) {
  return parseTrajectory(readTextFile(path), path);
}

TrajectoryFile::TrajectoryFile(const std::string& path) : file_(path) {
  file_.write(joined(columnNames, ",") + "\n");
}

void TrajectoryFile::write(const ToolSample& sample, const Eigen::Vector3d& force) {
  const Eigen::Vector3d& p = sample.position;
  const Eigen::Quaterniond& q = sample.worldFromTool;
  line_.clear();
  for (const double value :
       {sample.time, p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(), sample.grip, force.x(), force.y(), force.z()}) {
    if (!line_.empty()) line_ += ',';
    appendNumber(line_, value);
  }
  file_.write(line_ + "\n");
}

}  // namespace medulla
