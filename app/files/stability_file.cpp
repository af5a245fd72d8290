#include "app/files/stability_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "app/files/chart_file.h"
#include "app/files/chart_style.h"
#include "app/files/output_file.h"

namespace medulla {

namespace {

template <class T, class Of>
std::vector<T> distinct(const std::vector<StabilityPoint>& points, const Of& of) {
  std::vector<T> out;
  for (const StabilityPoint& p : points)
    if (std::find(out.begin(), out.end(), of(p)) == out.end()) out.push_back(of(p));
  return out;
}

// Recovered, survived, failed.
int gradeOf(const StabilityPoint& p) {
  return !p.survived ? 2 : p.recoveredAt ? 0 : 1;
}

// Points of a method and a grade: step in ms and a height.
template <class Height>
std::string block(const std::string& name, const std::vector<StabilityPoint>& points, const std::string& method,
                  int grade, const Height& height) {
  std::string rows;
  for (const StabilityPoint& p : points)
    if (p.method == method && gradeOf(p) == grade) rows += fmt::format("{:.6g} {:.6g}\n", 1e3 * p.step, height(p));
  return dataBlock(name, rows);
}

struct Grade {
  const char *points, *colour, *meaning;
};
constexpr Grade kGrades[] = {
    {"pt 5", kGreen, "back at rest within 1 %"}, {"pt 5", kOrange, "survived"}, {"pt 2 lw 2", kVermilion, "failed"}};

std::string plotOf(const std::string& name, double size) {
  std::string out;
  for (std::size_t k = 0; k < std::size(kGrades); ++k)
    out += fmt::format("{}${}{} using 1:2 with points {} lc '{}' ps {} notitle", k == 0 ? "" : ", \\\n  ", name, k,
                       kGrades[k].points, kGrades[k].colour, size);
  return out;
}

// An axis of few decades may show none of them.
bool isNarrow(double low, double high) {
  return high < 100 * low;
}

std::string ticks(double low, double high) {
  return isNarrow(low, high) ? fmt::format("({})", logTicks(low, high)) : "auto";
}

// By hand: a key of gnuplot's has room in one panel only.
std::string keyLabels(bool oneLimit) {
  std::string out;
  double x = 0.2;
  for (const Grade& g : kGrades) {
    out += fmt::format("set label '{}' at screen {:.2f}, 0.012 left point {} lc '{}' ps 1.1 offset 1,-0.35\n",
                       g.meaning, x, g.points, g.colour);
    x += 0.22;
  }
  return out +
         fmt::format("set label '{}: explicit limit' at screen 0.72, 0.012 left\n", oneLimit ? "cross" : "dashed");
}

}  // namespace

std::string stabilityRow(const StabilityPoint& p) {
  return fmt::format("{},{},{:.12g},{:.12g},{:d},{},{:.4g}\n", p.method, p.trial, p.young, p.step, p.survived,
                     p.recoveredAt ? fmt::format("{:.4g}", *p.recoveredAt) : "", p.energyRatio);
}

void writeStability(const std::string& path, const std::vector<StabilityPoint>& points) {
  OutputFile file(path);
  file.write("method,trial,young[Pa],step[s],survived,recovered_at[s],largest_energy[of start]\n");
  for (const StabilityPoint& p : points) file.write(stabilityRow(p));
  file.commit();
}

std::string stabilityScript(const std::string& title, const std::vector<StabilityPoint>& map,
                            const std::vector<StabilityPoint>& trials, const std::vector<StableStep>& limit) {
  const auto methods = distinct<std::string>(map, [](const StabilityPoint& p) { return p.method; });
  const auto names = distinct<std::string>(trials, [](const StabilityPoint& p) { return p.trial; });
  const auto rowOf = [&](const StabilityPoint& p) {
    return static_cast<double>(std::find(names.begin(), names.end(), p.trial) - names.begin());
  };
  std::string out = chartHead(1100, 1000, 13) + "set logscale x\nset xlabel 'step, ms'\nset key off\n";
  std::string limits;
  for (const StableStep& s : limit) limits += fmt::format("{:.6g} {:.6g}\n", 1e3 * s.step, s.young);
  out += dataBlock("limit", limits);
  for (std::size_t m = 0; m < methods.size(); ++m)
    for (int grade = 0; grade < 3; ++grade) {
      out += block(fmt::format("map{}_{}", m, grade), map, methods[m], grade,
                   [](const StabilityPoint& p) { return p.young; });
      out += block(fmt::format("trial{}_{}", m, grade), trials, methods[m], grade, rowOf);
    }
  double low = map[0].step, high = low;
  for (const auto* points : {&map, &trials})
    for (const StabilityPoint& p : *points) {
      low = std::min(low, p.step);
      high = std::max(high, p.step);
    }
  const auto [softest, stiffest] = std::minmax_element(
      map.begin(), map.end(), [](const StabilityPoint& a, const StabilityPoint& b) { return a.young < b.young; });
  out += fmt::format("set xrange [{:.6g}:{:.6g}]\nset xtics {}\nset multiplot title '{}'\n", 500 * low, 2000 * high,
                     ticks(500 * low, 2000 * high), title);
  const double least = 0.4 * softest->young, most = 2.5 * stiffest->young;
  const double width = 0.84 / static_cast<double>(methods.size());
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const double left = 0.15 + width * static_cast<double>(m);
    const std::string y = m == 0 ? fmt::format("set ylabel \"Young's modulus, Pa\"\nset format y '{}'\n",
                                               isNarrow(least, most) ? "%g" : "1e%T")
                                 : "unset ylabel\nset format y ''\n";
    out += fmt::format(
        "set lmargin at screen {:.4f}\nset rmargin at screen {:.4f}\nset tmargin at screen 0.92\nset bmargin at screen "
        "0.57\nset logscale y\nset yrange [{:.6g}:{:.6g}]\nset ytics {}\nset title '{}'\n{}",
        left, left + 0.9 * width, least, most, ticks(least, most), spaced(methods[m]), y);
    out += fmt::format("plot $limit using 1:2 with {} lw 2 lc '{}' notitle, \\\n  {}\n",
                       limit.size() == 1 ? "points pt 1" : "lines dt 2", kGrey, plotOf(fmt::format("map{}_", m), 1.1));
  }
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const double left = 0.15 + width * static_cast<double>(m);
    out += fmt::format(
        "set lmargin at screen {:.4f}\nset rmargin at screen {:.4f}\nset tmargin at screen 0.48\nset bmargin at screen "
        "0.1\nunset logscale y\nset yrange [{}:-0.5]\nunset ylabel\nset format y '%g'\nunset title\n",
        left, left + 0.9 * width, static_cast<double>(names.size()) - 0.5);
    out += "set ytics (";
    for (std::size_t k = 0; k < names.size(); ++k)
      out += fmt::format("{}'{}' {}", k == 0 ? "" : ", ", m == 0 ? spaced(names[k]) : "", k);
    out += ")\n";
    if (m + 1 == methods.size()) out += keyLabels(limit.size() == 1);
    out += fmt::format("plot {}\n", plotOf(fmt::format("trial{}_", m), 0.9));
  }
  return out + "unset multiplot\n";
}

}  // namespace medulla
