#include "app/files/recording_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>

#include "app/files/csv_rows.h"
#include "app/files/input_error.h"
#include "app/files/number_text.h"
#include "app/files/text.h"
#include "app/files/text_file.h"
#include "app/files/text_lines.h"
#include "app/files/trajectory_file.h"

namespace medulla {

namespace {

// A row in the units and the frame of its file.
struct Row {
  int line = 0;
  double time = 0, grip = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero(), force = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
};

// ---- Tables ----------------------------------------------------------------------------------------------

// The cells of a row that a choice of columns means.
using Cells = std::vector<std::size_t>;
struct Layout {
  Cells time, position, quaternion, matrix, grip, force;
};

// What a tracker writes while it sees nothing is no name.
bool isHeader(const CsvRows& rows) {
  const auto isNumber = [](std::string_view cell) { return parseNumber<double>(cell).has_value(); };
  const auto isName = [](std::string_view cell) {
    std::string lower(cell);
    std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
    constexpr std::string_view kNothing[] = {"nan", "-nan", "inf", "-inf", "null", "none", "na", "n/a"};
    return !lower.empty() && !isOneOf(lower, kNothing);
  };
  return std::none_of(rows.cells().begin(), rows.cells().end(), isNumber) &&
         std::any_of(rows.cells().begin(), rows.cells().end(), isName);
}

// "" where every column is found. `header`: names, empty where the file has none.
std::string locate(const ColumnChoice& choice, const std::vector<std::string>& header, std::size_t count, Cells& out) {
  out.clear();
  for (const std::string& column : choice) {
    const auto number = parseNumber<int>(column);
    const auto found = std::find(header.begin(), header.end(), column);
    if (found != header.end() && std::find(found + 1, header.end(), column) != header.end())
      return fmt::format("column {} stands more than once in the header, expected its number", inQuotes(column));
    if (found != header.end())
      out.push_back(static_cast<std::size_t>(found - header.begin()));
    else if (number && *number >= 1 && static_cast<std::size_t>(*number) <= count)
      out.push_back(static_cast<std::size_t>(*number) - 1);
    else if (number)
      return fmt::format("column {} is wanted, but there are {}", *number, count);
    else if (header.empty())
      return fmt::format("column {} is wanted, but the file has no header", inQuotes(column));
    else
      return fmt::format("no column {}; {}", inQuotes(column), hintOfNames(column, header));
    if (std::find(out.begin(), out.end() - 1, out.back()) != out.end() - 1)
      return fmt::format("column {} is wanted twice for one thing", inQuotes(column));
  }
  return "";
}

std::string locate(const RecordingColumns& columns, const std::vector<std::string>& header, std::size_t count,
                   Layout& out) {
  if (columns.count > 0 && static_cast<std::size_t>(columns.count) != count)
    return fmt::format("{} columns in this row, expected {}", count, columns.count);
  const std::pair<const ColumnChoice*, Cells*> choices[] = {
      {&columns.time, &out.time},     {&columns.position, &out.position}, {&columns.quaternion, &out.quaternion},
      {&columns.matrix, &out.matrix}, {&columns.grip, &out.grip},         {&columns.force, &out.force}};
  for (const auto& [choice, cells] : choices)
    if (std::string fault = locate(*choice, header, count, *cells); !fault.empty()) return fault;
  return "";
}

// The first layout that fits; the complaint is that of the first.
const RecordingColumns& chooseLayout(const CsvRows& rows, const std::vector<std::string>& header,
                                     const RecordingMap& map, Layout& out) {
  std::string complaint;
  for (const RecordingColumns& columns : map.layouts) {
    const std::string fault = locate(columns, header, rows.cells().size(), out);
    if (fault.empty()) return columns;
    if (complaint.empty()) complaint = fault;
  }
  rows.fail(complaint);
}

double numberAt(const CsvRows& rows, std::size_t cell) {
  return rows.number(cell, std::to_string(cell + 1));
}

Eigen::Vector3d vectorAt(const CsvRows& rows, const Cells& cells) {
  return {numberAt(rows, cells[0]), numberAt(rows, cells[1]), numberAt(rows, cells[2])};
}

Eigen::Quaterniond rotationAt(const CsvRows& rows, const Cells& cells) {
  Eigen::Matrix3d m;
  for (int k = 0; k < 9; ++k) m(k / 3, k % 3) = numberAt(rows, cells[static_cast<std::size_t>(k)]);
  const double off = (m * m.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off <= 2e-3) || !(m.determinant() > 0))
    rows.fail("columns of the matrix hold no rotation, expected right-handed orthonormal axes within 2e-3");
  return Eigen::Quaterniond(m).normalized();
}

Row rowAt(const CsvRows& rows, const Layout& at, const RecordingColumns& columns, std::size_t index) {
  Row row;
  row.line = rows.line();
  if (at.time.empty())
    row.time = static_cast<double>(index) / columns.rate;
  else if (at.time.size() == 1)
    row.time = numberAt(rows, at.time[0]) * columns.secondsPerUnit;
  else
    row.time = numberAt(rows, at.time[0]) + 1e-9 * numberAt(rows, at.time[1]);
  row.position = vectorAt(rows, at.position);
  if (!at.quaternion.empty())
    row.orientation = {numberAt(rows, at.quaternion[0]), numberAt(rows, at.quaternion[1]),
                       numberAt(rows, at.quaternion[2]), numberAt(rows, at.quaternion[3])};
  if (!at.matrix.empty()) row.orientation = rotationAt(rows, at.matrix);
  if (!at.grip.empty()) row.grip = numberAt(rows, at.grip[0]);
  if (!at.force.empty()) row.force = vectorAt(rows, at.force);
  return row;
}

std::vector<Row> readTable(std::string_view text, const std::string& name, const RecordingMap& map, bool& hasForce) {
  CsvRows rows(text, name, CsvRows::separatorOf(text));
  if (!rows.next()) throw inputError(name, 0, "no rows, expected a table of numbers");
  const std::size_t count = rows.cells().size();
  std::vector<std::string> header;
  if (isHeader(rows)) header.assign(rows.cells().begin(), rows.cells().end());
  Layout layout;
  const RecordingColumns& columns = chooseLayout(rows, header, map, layout);
  hasForce = !layout.force.empty();
  const std::string expected = fmt::format("{} as in the first", count);
  std::vector<Row> out;
  for (bool more = header.empty() || rows.next(); more; more = rows.next()) {
    rows.requireCells(count, expected);
    out.push_back(rowAt(rows, layout, columns, out.size()));
    if (const double grip = out.back().grip; !map.hasOwnGrip && (grip < 0 || grip > 1))
      rows.fail(fmt::format("grip is {}, expected 0 (open) to 1 (closed), or a <grip> in {} that says what it means",
                            grip, map.path));
  }
  if (out.empty()) throw inputError(name, 0, "no rows after the header, expected at least one");
  return out;
}

// ---- SOFA ------------------------------------------------------------------------------------------------

// WriteState's text: "T= t", then "X= x y z qx qy qz qw"; V=, F= and X0= may stand between.
std::vector<Row> readWriteState(std::string_view text, const std::string& name, double secondsPerUnit) {
  TextLines lines(text, name);
  std::vector<Row> out;
  bool complete = true;
  while (lines.next()) {
    const auto& words = lines.words();
    const std::string_view key = words[0];
    if (key.back() != '=') lines.fail(fmt::format("expected T=, X= or another NAME=, found {}", inQuotes(key)));
    if (key == "T=") {
      if (!complete) lines.fail("a second T=, expected the X= of the first");
      if (words.size() != 2) lines.fail(fmt::format("{} numbers after T=, expected one", words.size() - 1));
      out.emplace_back().time = lines.number(words[1]) * secondsPerUnit;
      complete = false;
    } else if (key == "X=") {
      if (complete) lines.fail("X= without a T= of its own before it");
      if (words.size() != 8)
        lines.fail(fmt::format("{} numbers after X=, expected 7: x y z qx qy qz qw of one rigid", words.size() - 1));
      double v[7];
      for (std::size_t k = 0; k < 7; ++k) v[k] = lines.number(words[k + 1]);
      out.back().line = lines.line();
      out.back().position = {v[0], v[1], v[2]};
      out.back().orientation = {v[6], v[3], v[4], v[5]};
      complete = true;
    }
  }
  if (out.empty()) throw inputError(name, 0, "no states, expected lines of T= and X=");
  if (!complete) throw inputError(name, 0, "ends with a T= that has no X=");
  return out;
}

// ---- From the file's frame into the scene's --------------------------------------------------------------

Eigen::Quaterniond mirrored(const Eigen::Quaterniond& q, const Eigen::Vector3d& mirror) {
  if (mirror == Eigen::Vector3d::Ones()) return q;
  // M R M for a reflection M: the axis turns over like a pseudovector, M axis times det M = -1.
  Eigen::Quaterniond out = q;
  out.vec() = -mirror.cwiseProduct(q.vec());
  return out;
}

ToolSample sampleOf(const Row& row, double start, const RecordingMap& map) {
  ToolSample sample;
  sample.time = row.time - start;
  sample.position = map.worldFromRecording * (map.scale * map.metresPerUnit * map.mirror.cwiseProduct(row.position));
  sample.worldFromTool =
      Eigen::Quaterniond(map.worldFromRecording.linear()) * mirrored(row.orientation, map.mirror) * map.deviceFromTool;
  const double grip = kGripCloses * (row.grip - map.gripOpen) / (map.gripCloses - map.gripOpen);
  sample.grip = grip > 0 ? std::min(grip, 1.0) : 0;  // overflow to no number included
  return sample;
}

// Poses averaged over a raised cosine around each time, which is narrower towards the ends: these stay, and nothing is
// delayed. Rows count by the time that they stand for. Quaternions are summed on one side of their sphere, which is
// their mean for turns that are small within a window (Markley and others 2007).
std::vector<ToolSample> smoothed(const std::vector<ToolSample>& samples, double window) {
  std::vector<ToolSample> out = samples;
  const std::size_t count = samples.size();
  std::size_t first = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double t = samples[k].time;
    const double half = std::min({window, t - samples.front().time, samples.back().time - t});
    if (!(half > 0)) continue;
    while (samples[first].time < t - window) ++first;
    double sum = 0;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector4d turn = Eigen::Vector4d::Zero();
    for (std::size_t j = first; j < count && samples[j].time < t + half; ++j) {
      if (samples[j].time <= t - half) continue;
      const double span = samples[std::min(j + 1, count - 1)].time - samples[j > 0 ? j - 1 : 0].time;
      const double weight = span * (1 + std::cos(std::numbers::pi * (samples[j].time - t) / half));
      const Eigen::Vector4d& q = samples[j].worldFromTool.coeffs();
      sum += weight;
      position += weight * samples[j].position;
      turn += (q.dot(samples[k].worldFromTool.coeffs()) < 0 ? -weight : weight) * q;
    }
    if (!(sum > 0)) continue;  // a window of less than the time's rounding
    out[k].position = position / sum;
    out[k].worldFromTool.coeffs() = turn.normalized();
  }
  return out;
}

}  // namespace

Trajectory parseRecording(std::string_view text, const std::string& name, const RecordingMap& map) {
  bool hasForce = false;
  const std::vector<Row> rows =
      map.writeState ? readWriteState(text, name, map.layouts[0].secondsPerUnit) : readTable(text, name, map, hasForce);
  Trajectory whole, trajectory;
  for (const Row& row : rows) addSample(whole, sampleOf(row, rows[0].time, map), name, row.line);
  if (map.smooth > 0) whole.samples = smoothed(whole.samples, map.smooth);
  constexpr double slack = 1e-6;  // s; differences of times counted since 1970 are off by a quarter of that
  for (std::size_t k = 0; k < rows.size(); ++k) {
    ToolSample sample = whole.samples[k];
    if (sample.time < map.from - slack || sample.time > map.to + slack) continue;
    sample.time += map.delay - map.from;
    addSample(trajectory, sample, name, rows[k].line);
    if (hasForce)
      addMeasuredForce(trajectory, map.worldFromRecording.linear() * map.mirror.cwiseProduct(rows[k].force), name,
                       rows[k].line);
  }
  if (trajectory.samples.empty())
    throw inputError(
        map.path, map.line,
        fmt::format("no row lies from {} s{}: the recording is {} s long", map.from,
                    std::isinf(map.to) ? " on" : fmt::format(" to {} s", map.to), whole.samples.back().time));
  return trajectory;
}

Trajectory readRecording(const RecordingMap& map) {
  if (!fileExists(map.recordingPath))
    throw inputError(map.path, map.line, fmt::format("recording \"{}\" does not exist", map.recordingPath));
  return parseRecording(readTextFile(map.recordingPath), map.recordingPath, map);
}

}  // namespace medulla
