#include "app/files/sphere_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "app/files/chart_style.h"
#include "app/files/output_file.h"
#include "app/files/text.h"

namespace medulla {

void writeSphereChart(const std::string& path, const std::vector<SphereChartRow>& rows, ChartCost cost) {
  OutputFile file(path);
  file.write(fmt::format("spheres,gap_max[%],gap_mean[%],step[s],cpu[{}],error_max[%],error_rms[%]\n", costUnit(cost)));
  for (const SphereChartRow& r : rows) {
    file.write(fmt::format("{},{:.4g},{:.4g},", r.spheres, r.gapMax, r.gapMean));
    const std::string errors = r.isReference ? "," : fmt::format("{:.4g},{:.4g}", r.errorMax, r.errorRms);
    file.write(r.step > 0 ? fmt::format("{:.6g},{:.4g},{}\n", r.step, r.cpu, errors) : ",,,\n");
  }
  file.commit();
}

std::string sphereChartScript(const std::string& title, const std::vector<SphereChartRow>& rows, ChartCost cost) {
  std::string out = chartHead(960, 560, 14);
  out +=
      "set logscale xyy2\n"
      "set format '%g'\n"
      "set format y2 '%g'\n"
      "set key outside top center horizontal samplen 2\n"
      "set xlabel 'filling spheres'\n"
      "set ylabel '% of the diagonal, % of the largest displacement'\n";
  out += fmt::format("set title '{}'\n", title);
  std::string ticks, data;
  double cheapest = 0, dearest = 0;
  bool anyFailed = false;
  for (const SphereChartRow& r : rows) {
    anyFailed = anyFailed || r.step == 0;
    if (r.step > 0) {
      cheapest = cheapest > 0 ? std::min(cheapest, r.cpu) : r.cpu;
      dearest = std::max(dearest, r.cpu);
    }
    ticks += fmt::format("{}{}", ticks.empty() ? "" : ", ", r.spheres);
    // gnuplot leaves out what is no number, and zeros have no logarithm.
    const auto shown = [&](double value, bool any) { return any && value > 0 ? fmt::format("{:.6g}", value) : "NaN"; };
    const bool hasError = r.step > 0 && !r.isReference;
    data += fmt::format("{} {} {} {} {} {}\n", r.spheres, shown(r.gapMax, true), shown(r.errorMax, hasError),
                        shown(r.errorRms, hasError), shown(r.cpu, r.step > 0), shown(kChartRim, r.step == 0));
  }
  out += fmt::format("set xtics ({})\nset xrange [{:.6g}:{:.6g}]\n", ticks, 0.8 * rows.front().spheres,
                     1.25 * rows.back().spheres);
  if (cheapest > 0)
    out += fmt::format("set border 11 lc '{}'\nset y2label '{}'\nset y2tics ({})\nset y2range [{:.6g}:{:.6g}]\n", kGrey,
                       costLabel(cost), logTicks(cheapest / 5, 2 * dearest), cheapest / 5, 2 * dearest);
  out += dataBlock("rows", data);
  std::vector<std::string> plots;
  const auto addCurve = [&](const char* columns, int points, const char* colour, const char* meaning) {
    plots.push_back(fmt::format("$rows using {} with linespoints lw 2 pt {} ps 0.7 lc '{}' title '{}'", columns, points,
                                colour, meaning));
  };
  addCurve("1:2", 5, kBlue, "largest gap");
  if (cheapest > 0) {  // gnuplot refuses an axis on which nothing lies
    addCurve("1:3", 7, kVermilion, "largest error");
    addCurve("1:4", 9, kOrange, "RMS error");
    addCurve("1:5 axes x1y2", 11, kGreen, "cost (right)");
  }
  if (anyFailed)
    plots.push_back(fmt::format("$rows using 1:6 with points pt 2 ps 1 lw 2 lc '{}' title 'failed'", kGrey));
  return fmt::format("{}plot {}\n", out, joined(plots, ", \\\n  "));
}

}  // namespace medulla
