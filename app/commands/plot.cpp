#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <optional>
#include <vector>

#include "app/commands/commands.h"
#include "app/files/gnuplot.h"
#include "app/files/log_table.h"
#include "app/files/output_file.h"
#include "app/files/plot_file.h"
#include "app/standard_streams.h"

namespace medulla {

// No error: a log may be cut to what is to be seen.
static void noteOtherRun(const LogTable& log, const LogTable& frameTimes) {
  const double end = log.value.back()[0], other = frameTimes.value.back()[0];
  const double frame = other / static_cast<double>(frameTimes.value.size());
  if (std::abs(end - other) > 2 * frame)  // the log of a run against the clock is a frame behind
    tell("note: {} ends at {:.6g} s, {} at {:.6g} s: are they of one run?\n", log.path, end, frameTimes.path, other);
}

// Of a run that was killed, or goes on.
static LogTable readTable(const std::string& path) {
  LogTable table = readLog(path);
  if (table.isCut) tell("note: {} ends in the midst of a row: the rows before it are drawn\n", path);
  return table;
}

int runPlot(const PlotOptions& options) {
  const std::filesystem::path path = options.output;
  if (path.extension() != ".png" && path.extension() != ".svg")
    throw std::runtime_error(fmt::format("{}: expected FILE.png or FILE.svg", options.output));
  std::vector<std::string> inputs{options.log};
  if (!options.frameTimes.empty()) inputs.push_back(options.frameTimes);
  requireDistinctFiles({options.output}, inputs);
  const LogTable log = readTable(options.log);
  std::optional<LogTable> frameTimes;
  if (!options.frameTimes.empty()) frameTimes = readTable(options.frameTimes);
  const PlotFormat format = path.extension() == ".png" ? PlotFormat::png : PlotFormat::svg;
  const std::string script =
      plotScript(log, frameTimes ? &*frameTimes : nullptr, std::filesystem::path(options.log).stem().string(), format);
  if (frameTimes) noteOtherRun(log, *frameTimes);
  const std::optional<std::string> picture = runGnuplot(script);
  if (!picture)
    throw std::runtime_error(
        fmt::format("{}: gnuplot is not installed, expected it (Debian package gnuplot-nox)", options.output));
  writeFile(options.output, *picture);
  fmt::print("file {}\n", normalised(std::filesystem::absolute(path)).string());
  return 0;
}

}  // namespace medulla
