#include "app/files/reference_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "app/files/input_error.h"
#include "app/files/number_text.h"
#include "app/files/text.h"
#include "app/files/text_file.h"
#include "app/files/text_lines.h"

namespace medulla {

// The number of a remark "# unit NUMBER m"; nothing of other remarks.
static std::optional<double> unitOfRemark(std::string_view remark, const std::string& name, int line) {
  TextLines lines(remark, name);
  if (!lines.next()) return {};
  const auto& words = lines.words();
  const std::string first = lowered(words[0]);
  if (!first.starts_with("unit")) return {};
  const std::optional<double> unit = words.size() == 3 ? parseNumber<double>(words[1]) : std::nullopt;
  if (first != "unit" || !unit || !(*unit > 0) || words[2] != "m")
    throw inputError(name, line, "expected # unit NUMBER m, with a number of metres greater than 0");
  return unit;
}

// What rows are in, m.
static double unitOf(std::string_view text, const std::string& name) {
  std::optional<double> unit;
  for (int line = 1; !text.empty(); ++line) {
    const std::string_view whole = takeLine(text);
    if (!whole.starts_with('#')) continue;
    const std::optional<double> found = unitOfRemark(whole.substr(1), name, line);
    if (found && unit) throw inputError(name, line, "a second unit, expected one for all rows");
    if (found) unit = found;
  }
  return unit.value_or(1);
}

Reference parseReference(std::string_view text, const std::string& name, const SoftBodyModel& model) {
  const double unit = unitOf(text, name);
  const std::size_t vertices = model.nodeOfInputVertex.size();
  Reference out;
  out.displacement.resize(model.restNodes.size());
  std::size_t vertex = 0;
  bool moves = false;
  for (TextLines lines(text, name); lines.next(); ++vertex) {
    if (lines.words().size() != 3)
      lines.fail(fmt::format("{} words in this row, expected a displacement: x y z", lines.words().size()));
    if (vertex == vertices) lines.fail(fmt::format("more rows than the mesh has vertices: {}", vertices));
    Eigen::Vector3d moved;
    for (int k = 0; k < 3; ++k) moved[k] = unit * lines.number(lines.words()[k]);
    if (!moved.allFinite()) lines.fail("a displacement beyond all numbers");
    moves = moves || !moved.isZero(0);
    const int node = model.nodeOfInputVertex[vertex];
    if (node >= 0) out.displacement[node] = moved;
  }
  if (vertex < vertices)
    throw inputError(name, 0,
                     fmt::format("{} rows, expected one for each of the mesh's {} vertices", vertex, vertices));
  if (!moves) throw inputError(name, 0, "nothing moves: no error can be stated in % of it");
  return out;
}

std::vector<ReferenceRun> parseReferenceRuns(std::string_view text, const std::string& name) {
  std::vector<ReferenceRun> runs;
  for (TextLines lines(text, name); lines.next();) {
    const auto& words = lines.words();
    if (words.size() != 5)
      lines.fail(
          fmt::format("{} words in this row, expected case nodes seconds largest-error RMS-error", words.size()));
    const long long nodes = lines.integer(words[1]);
    const ReferenceRun run{static_cast<int>(std::clamp<long long>(nodes, 0, 1 << 30)), lines.number(words[2]),
                           lines.number(words[3]), lines.number(words[4])};
    if (!(nodes > 0 && run.cpu > 0 && run.errorMax >= 0 && run.errorRms >= 0))
      lines.fail("expected nodes and seconds greater than 0, and errors of 0 or more");
    runs.push_back(run);
  }
  return runs;
}

Reference readReference(const std::string& path, const SoftBodyModel& model) {
  Reference out = parseReference(readTextFile(path), path, model);
  const std::string times = std::filesystem::path(path).replace_extension(".time").string();
  if (fileExists(times)) out.runs = parseReferenceRuns(readTextFile(times), times);
  return out;
}

}  // namespace medulla
