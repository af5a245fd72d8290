#include "app/files/reference_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "app/files/input_error.h"
#include "app/files/text_file.h"
#include "app/files/text_lines.h"

namespace medulla {

// The line "# unit NUMBER m", a remark to the reader of rows.
static double unitOf(std::string_view text, const std::string& name) {
  constexpr std::string_view kStart = "# unit ";
  int line = 1;
  for (std::size_t at = 0; at < text.size(); ++line) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string_view whole = text.substr(at, end - at);
    at = end + 1;
    if (!whole.starts_with(kStart)) continue;
    TextLines words(whole.substr(kStart.size()), name);
    const bool any = words.next();
    const auto refuse = [&] {
      throw inputError(name, line, "expected # unit NUMBER m, with a number of metres greater than 0");
    };
    if (!any || words.words().size() != 2 || words.words()[1] != "m") refuse();
    double unit = 0;
    try {
      unit = words.number(words.words()[0]);
    } catch (const std::runtime_error&) {
      refuse();
    }
    if (!(unit > 0)) refuse();
    return unit;
  }
  return 1;
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
      lines.fail("expected numbers greater than 0");
    runs.push_back(run);
  }
  return runs;
}

Reference readReference(const std::string& path, const SoftBodyModel& model) {
  Reference out = parseReference(readTextFile(path), path, model);
  const std::string times = std::filesystem::path(path).replace_extension(".time").string();
  if (std::filesystem::exists(times)) out.runs = parseReferenceRuns(readTextFile(times), times);
  return out;
}

}  // namespace medulla
