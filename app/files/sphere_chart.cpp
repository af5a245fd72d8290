#include "app/files/sphere_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "app/files/output_file.h"
#include "app/files/text.h"

namespace medulla {

void writeSphereChart(const std::string& path, const std::vector<SphereChartRow>& rows, ChartCost cost) {
  OutputFile file(path);
  file.write(fmt::format("spheres,gap_max[%],gap_mean[%],step[s],cpu[{}],error_max[%],error_rms[%]\n",
                         cost == ChartCost::ofTheCase ? "s" : "s/s"));
  for (const SphereChartRow& r : rows) {
    file.write(fmt::format("{},{:.4g},{:.4g},", r.spheres, r.gapMax, r.gapMean));
    file.write(r.step > 0 ? fmt::format("{:.6g},{:.4g},{:.4g},{:.4g}\n", r.step, r.cpu, r.errorMax, r.errorRms)
                          : ",,,\n");
  }
  file.commit();
}

std::string sphereChartScript(const std::string& title, const std::vector<SphereChartRow>& rows, ChartCost cost) {
  std::string out =
      "set terminal svg size 960,560 dynamic noenhanced font 'Helvetica,14' background 'white'\n"
      "set logscale xyy2\n"
      "set tics nomirror out\n"
      "set grid xtics ytics lc '#dddddd' lt 1 lw 1\n"
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
    data += fmt::format("{} {} {} {} {} {}\n", r.spheres, shown(r.gapMax, true), shown(r.errorMax, r.step > 0),
                        shown(r.errorRms, r.step > 0), shown(r.cpu, r.step > 0), shown(kChartRim, r.step == 0));
  }
  out += fmt::format("set xtics ({})\nset xrange [{:.6g}:{:.6g}]\n", ticks, 0.8 * rows.front().spheres,
                     1.25 * rows.back().spheres);
  out += fmt::format("set border {} lc '#555555'\n", cheapest > 0 ? 11 : 3);
  if (cheapest > 0)
    out += fmt::format(
        "set y2label '{}'\nset y2tics ({})\nset y2range [{:.6g}:{:.6g}]\n",
        cost == ChartCost::ofTheCase ? "CPU seconds of the whole load case" : "CPU seconds per simulated second",
        logTicks(cheapest / 5, 2 * dearest), cheapest / 5, 2 * dearest);
  out += "$rows << EOD\n" + data + "EOD\n";
  // Okabe and Ito (2008): told apart by all kinds of eyes. gnuplot refuses an axis on which nothing lies.
  std::vector<std::string> plots = {
      "$rows using 1:2 with linespoints lw 2 pt 5 ps 0.7 lc '#0072b2' title 'largest gap'"};
  if (cheapest > 0) {
    plots.emplace_back("$rows using 1:3 with linespoints lw 2 pt 7 ps 0.7 lc '#d55e00' title 'largest error'");
    plots.emplace_back("$rows using 1:4 with linespoints lw 2 pt 9 ps 0.7 lc '#e69f00' title 'RMS error'");
    plots.emplace_back(
        "$rows using 1:5 axes x1y2 with linespoints lw 2 pt 11 ps 0.7 lc '#009e73' title 'cost (right)'");
  }
  if (anyFailed) plots.emplace_back("$rows using 1:6 with points pt 2 ps 1 lw 2 lc '#555555' title 'failed'");
  return fmt::format("{}plot {}\n", out, joined(plots, ", \\\n  "));
}

}  // namespace medulla
