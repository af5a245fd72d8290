#include "app/files/chart_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/files/output_file.h"

namespace medulla {

namespace {

constexpr double kRim = 100;          // %: as wrong as if nothing had moved
constexpr double kLeastShown = 1e-3;  // %; smaller errors are drawn here

bool atRim(const ChartPoint& p) {
  return p.failedAt || !(p.errorMax < kRim);
}

// The points of a plot as a here-document: cost, error, and the step in ms as a label; of other programs, the nodes.
template <typename Wanted>
std::string dataBlock(const std::string& name, const std::vector<ChartPoint>& points, const Wanted& wanted) {
  std::string out = fmt::format("${} << EOD\n", name);
  for (const ChartPoint& p : points) {
    if (!wanted(p)) continue;
    const double error = atRim(p) ? kRim : std::max(kLeastShown, p.errorMax);
    const std::string label = p.nodes > 0 ? fmt::format("{}", p.nodes) : fmt::format("{:.3g}", 1e3 * p.step);
    out += fmt::format("{:.6g} {:.6g} {}\n", p.cpu, error, label);
  }
  return out + "EOD\n";
}

std::vector<std::string> curvesOf(const std::vector<ChartPoint>& points) {
  std::vector<std::string> out;
  for (const ChartPoint& p : points)
    if (std::find(out.begin(), out.end(), p.curve) == out.end()) out.push_back(p.curve);
  return out;
}

std::string axes(const std::string& title, const std::vector<ChartPoint>& points, ChartCost cost) {
  double low = points[0].cpu, high = low, least = kRim;
  for (const ChartPoint& p : points) {
    low = std::min(low, p.cpu);
    high = std::max(high, p.cpu);
    if (!atRim(p)) least = std::min(least, std::max(kLeastShown, p.errorMax));
  }
  low *= 0.7;
  high *= 1.5;
  std::string out =
      "set terminal svg size 960,640 dynamic noenhanced font 'Helvetica,14' background 'white'\n"
      "set logscale xy\n"
      "set border 3 lc '#555555'\n"
      "set tics nomirror out\n"
      "set grid xtics ytics lc '#dddddd' lt 1 lw 1\n"
      "set format '%g'\n"
      "set ytics add ('0.001 or less' 0.001)\n"
      "set key outside right top Left reverse samplen 2 spacing 1.3\n"
      "set ylabel 'largest error of a surface node, % of the largest displacement'\n";
  out += cost == ChartCost::ofTheCase ? "set xlabel 'CPU seconds of the whole load case'\n"
                                      : "set xlabel 'CPU seconds per simulated second'\n";
  out += fmt::format("set xtics ({})\n", logTicks(low, high));
  out += fmt::format("set title '{}'\n", title);
  out += fmt::format("set xrange [{:.6g}:{:.6g}]\n", low, high);
  out += fmt::format("set yrange [{:.6g}:{:.6g}]\n",
                     least > kLeastShown ? std::pow(10, std::floor(std::log10(least))) : 0.7 * kLeastShown, 1.6 * kRim);
  out += fmt::format("set arrow 1 from graph 0, first {0} to graph 1, first {0} nohead lc '#bb4444' dt 3\n", kRim);
  if (cost == ChartCost::perSimulatedSecond && low < 1 && high > 1)
    out +=
        "set arrow 2 from first 1, graph 0 to first 1, graph 1 nohead lc '#888888' dt 2\n"
        "set label 2 'real time' at first 1, graph 0.02 offset 0.5,0 tc '#888888' font ',11'\n";
  return out;
}

}  // namespace

std::string logTicks(double low, double high) {
  std::string list;
  for (int exponent = static_cast<int>(std::floor(std::log10(low))); std::pow(10, exponent) <= high; ++exponent)
    for (const int digit : {1, 2, 5}) list += fmt::format("{}{}e{}", list.empty() ? "" : ", ", digit, exponent);
  return list;
}

void markFront(std::vector<ChartPoint>& points) {
  for (ChartPoint& p : points) {
    p.onFront = !atRim(p) && std::none_of(points.begin(), points.end(), [&](const ChartPoint& other) {
      return !atRim(other) && other.cpu <= p.cpu && other.errorMax <= p.errorMax &&
             (other.cpu < p.cpu || other.errorMax < p.errorMax);
    });
  }
}

void writeChart(const std::string& path, const std::vector<ChartPoint>& points, ChartCost cost) {
  OutputFile file(path);
  const auto cell = [](const std::optional<double>& value) { return value ? fmt::format("{:.4g},", *value) : ","; };
  file.write(
      fmt::format("curve,spheres,step[s],cpu[{}],error_max[%],error_rms[%],end_error_max[%],end_error_rms[%],"
                  "loaded_error_max[%],loaded_error_rms[%],rest_error_max[%],rest_error_rms[%],volume_ratio,nodes,"
                  "failed_at[s],on_front\n",
                  cost == ChartCost::ofTheCase ? "s" : "s/s"));
  for (const ChartPoint& p : points) {
    file.write(fmt::format("{},{},{:.6g},{:.4g},", p.curve, p.spheres, p.step, p.cpu));
    if (p.failedAt) {
      file.write(fmt::format(",,,,,,,,,,{:.6g},0\n", *p.failedAt));
    } else {
      file.write(fmt::format("{:.4g},{:.4g},{:.4g},{:.4g},", p.errorMax, p.errorRms, p.endErrorMax, p.endErrorRms));
      for (const std::optional<double>& value :
           {p.loadedErrorMax, p.loadedErrorRms, p.restErrorMax, p.restErrorRms, p.volumeRatio})
        file.write(cell(value));
      file.write(fmt::format("{},,{:d}\n", p.nodes > 0 ? fmt::format("{}", p.nodes) : "", p.onFront));
    }
  }
  file.commit();
}

std::string chartScript(const std::string& title, const std::vector<ChartPoint>& points, ChartCost cost) {
  // Okabe and Ito (2008): told apart by all kinds of eyes.
  constexpr const char* kColours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                      "#e69f00", "#56b4e9", "#000000", "#999933"};
  const std::vector<std::string> curves = curvesOf(points);
  std::string out = axes(title, points, cost), plot = "plot ";
  std::vector<ChartPoint> sorted = points;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const ChartPoint& a, const ChartPoint& b) { return a.cpu < b.cpu; });
  out += dataBlock("front", sorted, [](const ChartPoint& p) { return p.onFront; });
  plot += "$front using 1:2 with lines lw 9 lc '#e8e2c8' title 'Pareto front'";
  // A curve joins its points by step, so that noise of the timing does not fold it.
  std::vector<ChartPoint> bySteps = points;
  std::stable_sort(bySteps.begin(), bySteps.end(),
                   [](const ChartPoint& a, const ChartPoint& b) { return a.step < b.step; });
  for (std::size_t k = 0; k < curves.size(); ++k) {
    const std::string colour = kColours[k % std::size(kColours)], name = fmt::format("c{}", k);
    std::string legend = curves[k];
    std::replace(legend.begin(), legend.end(), '_', ' ');
    const auto ofThis = [&](const ChartPoint& p) { return p.curve == curves[k]; };
    out += dataBlock(name, bySteps, [&](const ChartPoint& p) { return ofThis(p) && !atRim(p); });
    out += dataBlock(name + "failed", bySteps, [&](const ChartPoint& p) { return ofThis(p) && atRim(p); });
    plot += fmt::format(
        ", \\\n  NaN with linespoints lw 2 pt {2} ps 0.7 lc '{1}' title '{3}'"  // in the key even if all failed
        ", \\\n  ${0} using 1:2 with linespoints lw 2 pt {2} ps 0.7 lc '{1}' notitle"
        ", \\\n  ${0} using 1:2:(strcol(3)) with labels offset 0.4,0.7 left font ',10' tc '{1}' notitle"
        ", \\\n  ${0}failed using 1:2 with points pt 2 ps 1 lw 2 lc '{1}' notitle"
        ", \\\n  ${0}failed using 1:2:(strcol(3)) with labels offset 0,-0.9 font ',10' tc '{1}' notitle",
        name, colour, 5 + 2 * (k % 5), legend);
  }
  const bool others = std::any_of(points.begin(), points.end(), [](const ChartPoint& p) { return p.nodes > 0; });
  out += fmt::format("set label 3 'numbers: substep, ms{}' at graph 1.02, graph 0 left tc '#888888' font ',11'\n",
                     others ? "; of FEM, nodes" : "");
  plot += ", \\\n  NaN with points pt 2 ps 1 lw 2 lc '#555555' title 'failed, or 100 % wrong'";
  return out + plot + "\n";
}

}  // namespace medulla
