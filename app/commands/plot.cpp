#include <fmt/format.h>

#include <filesystem>

#include "app/commands/commands.h"
#include "app/files/gnuplot.h"
#include "app/files/log_table.h"
#include "app/files/output_file.h"
#include "app/files/plot_file.h"

namespace medulla {

int runPlot(const PlotOptions& options) {
  const std::filesystem::path path = options.output;
  if (path.extension() != ".png" && path.extension() != ".svg")
    throw std::runtime_error(fmt::format("{}: expected FILE.png or FILE.svg", options.output));
  requireDistinctFiles({options.output}, {options.log});
  const LogTable log = readLog(options.log);
  const PlotFormat format = path.extension() == ".png" ? PlotFormat::png : PlotFormat::svg;
  const std::optional<std::string> picture =
      runGnuplot(plotScript(log, std::filesystem::path(options.log).stem().string(), format));
  if (!picture)
    throw std::runtime_error(
        fmt::format("{}: gnuplot is not installed, expected it (Debian package gnuplot-nox)", options.output));
  writeText(options.output, *picture);
  fmt::print("file {}\n", std::filesystem::absolute(path).lexically_normal().string());
  return 0;
}

}  // namespace medulla
