#include "app/files/chart_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "app/files/chart_labels.h"
#include "app/files/chart_style.h"

namespace medulla {

namespace {

constexpr double kLeastShown = 1e-3;  // %; smaller errors are drawn here

// Pixels of the picture, and of the plot in it.
constexpr double kWidth = 960, kHeight = 640, kLeft = 90, kRight = 660, kBottom = 70, kTop = 595;
constexpr double kRowHeight = 17, kFirstRow = 12;  // of the rim

struct Curve {
  std::string name;
  std::string colour;
  int symbol = 0;        // gnuplot's; open for implicit steps, where they often lie on those of explicit ones
  bool isOther = false;  // of the reference's own program
  int row = -1;          // on the rim; -1: nothing of it failed
};

std::vector<Curve> curvesOf(const std::vector<ChartPoint>& points) {
  constexpr int kFilled[] = {5, 7, 9, 11, 13}, kPentagon = 15;  // the open one of each comes before it
  std::vector<Curve> out;
  std::size_t own = 0;
  int rows = 0;
  for (const ChartPoint& p : points) {
    auto curve = std::find_if(out.begin(), out.end(), [&](const Curve& c) { return c.name == p.curve; });
    if (curve == out.end()) {
      const bool other = p.nodes > 0;
      const std::size_t style = p.style >= 0 ? static_cast<std::size_t>(p.style) : own;
      const int open = p.curve.find("implicit") != std::string::npos ? 1 : 0;
      out.push_back({p.curve, other ? kBlack : kCurveColours[style % std::size(kCurveColours)],
                     other ? kPentagon : kFilled[style % std::size(kFilled)] - open, other});
      own += other ? 0 : 1;
      curve = out.end() - 1;
    }
    if (atRim(p) && curve->row < 0) curve->row = rows++;
  }
  return out;
}

// What the axes show, and where in the picture.
struct Frame {
  double low = 0, high = 0, least = 0, most = 0;  // cost, error in %
  double perDecadeX = 0, perDecadeY = 0;          // pixels

  ChartLabels::Place pixels(double cost, double error) const {
    return {kLeft + perDecadeX * std::log10(cost / low), kBottom + perDecadeY * std::log10(error / least)};
  }
  double onRow(int row) const { return kChartRim * std::pow(10, (kFirstRow + kRowHeight * row) / perDecadeY); }
};

Frame frameOf(const std::vector<ChartPoint>& points, const std::vector<Curve>& curves) {
  Frame f{points[0].cpu, points[0].cpu, kChartRim, kChartRim};
  for (const ChartPoint& p : points) {
    f.low = std::min(f.low, p.cpu);
    f.high = std::max(f.high, p.cpu);
    if (!atRim(p)) f.least = std::min(f.least, std::max(kLeastShown, p.errorMax));
  }
  // As wide as two numbers on the axis take wherever it lies.
  constexpr double kLeastRatio = 5;
  f.low *= 0.7;
  f.high *= 1.5;
  const double widen = std::sqrt(std::max(1., kLeastRatio * f.low / f.high));
  f.low /= widen;
  f.high *= widen;
  f.least = std::min(0.6 * f.least, 0.2 * kChartRim);
  const auto rows = std::count_if(curves.begin(), curves.end(), [](const Curve& c) { return c.row >= 0; });
  const double rim = 2 * kFirstRow + kRowHeight * static_cast<double>(std::max<std::ptrdiff_t>(rows, 1) - 1);
  f.perDecadeX = (kRight - kLeft) / std::log10(f.high / f.low);
  f.perDecadeY = (kTop - kBottom - rim) / std::log10(kChartRim / f.least);
  f.most = kChartRim * std::pow(10, rim / f.perDecadeY);
  return f;
}

// As drawn: failed ones on their curve's row.
double heightOf(const ChartPoint& p, const Curve& curve, const Frame& f) {
  return atRim(p) ? f.onRow(curve.row) : std::max(kLeastShown, p.errorMax);
}

template <typename Wanted>
std::string block(const std::string& name, const std::vector<ChartPoint>& points, const Curve& curve,
                  const Frame& frame, const Wanted& wanted) {
  std::string rows;
  for (const ChartPoint& p : points)
    if (wanted(p)) rows += fmt::format("{:.6g} {:.6g}\n", p.cpu, heightOf(p, curve, frame));
  return dataBlock(name, rows);
}

std::string axes(const std::string& title, const Frame& f, ChartCost cost) {
  std::string out = chartHead(kWidth, kHeight, 14);
  out += fmt::format(
      "set lmargin at screen {:.6g}\nset rmargin at screen {:.6g}\n"
      "set bmargin at screen {:.6g}\nset tmargin at screen {:.6g}\n",
      kLeft / kWidth, kRight / kWidth, kBottom / kHeight, kTop / kHeight);
  out +=
      "set logscale xy\n"
      "set format '%g'\n"
      "set key outside right top Left reverse samplen 2 spacing 1.3\n";
  // Not as the axis's own: wide numbers would push it out of the picture.
  out += fmt::format(
      "set label 'largest error of a surface node, % of the largest displacement' at screen {:.6g}, screen {:.6g} "
      "rotate by 90 center\n",
      14.0 / kWidth, 0.5 * (kBottom + kTop) / kHeight);
  out += fmt::format("set xlabel '{}'\n", costLabel(cost));
  out += fmt::format("set xtics ({}) font ',12'\nset ytics ({})\n", logTicks(f.low, f.high),
                     logTicks(f.least, 0.99 * kChartRim));
  out += fmt::format("set ytics add ({0})\n", kChartRim);
  if (f.least < kLeastShown) out += fmt::format("set ytics add ('< {0}' {0})\n", kLeastShown);
  out += fmt::format("set title '{}'\n", title);
  out += fmt::format("set xrange [{:.6g}:{:.6g}]\nset yrange [{:.6g}:{:.6g}]\n", f.low, f.high, f.least, f.most);
  out += fmt::format(
      "set object rectangle from graph 0, first {} to graph 1, graph 1 behind fc '#f6eeee' fs solid noborder\n",
      kChartRim);
  if (cost == ChartCost::perSimulatedSecond && f.low < 1 && f.high > 1)
    out +=
        "set arrow from first 1, graph 0 to first 1, graph 1 nohead lc '#888888' dt 2\n"
        "set label 'real time' at first 1, graph 0.02 offset 0.5,0 tc '#888888' font ',11'\n";
  return out;
}

// Substeps in ms; of other programs, the nodes. What lies on the front is labelled first, for that is what one reads.
// `points`: by step, as curves join them.
std::string labels(const std::vector<ChartPoint>& points, const std::vector<Curve>& curves, const Frame& frame) {
  ChartLabels places;
  const std::array<ChartLabels::Place, 4> corners{{{kLeft, kBottom}, {kRight, kBottom}, {kRight, kTop}, {kLeft, kTop}}};
  for (std::size_t k = 0; k < 4; ++k) places.addLine(corners[k], corners[(k + 1) % 4]);
  struct Marked {
    const ChartPoint* point;
    const Curve* curve;
    ChartLabels::Place place;
  };
  std::vector<Marked> marks;
  marks.reserve(points.size());
  for (const Curve& curve : curves) {
    const ChartLabels::Place* last = nullptr;
    for (const ChartPoint& p : points) {
      if (p.curve != curve.name) continue;
      marks.push_back({&p, &curve, frame.pixels(p.cpu, heightOf(p, curve, frame))});
      places.addMark(marks.back().place);
      if (atRim(p)) continue;
      if (last) places.addLine(*last, marks.back().place);
      last = &marks.back().place;
    }
  }
  std::stable_partition(marks.begin(), marks.end(), [](const Marked& m) { return m.point->onFront; });
  std::string out;
  for (const Marked& m : marks) {
    const std::string text =
        m.curve->isOther ? fmt::format("{}", m.point->nodes) : fmt::format("{:.3g}", 1e3 * m.point->step);
    if (const auto place = places.place(m.place, text.size()))
      out += fmt::format("set label '{}' at screen {:.5f}, screen {:.5f} center front font ',10' tc rgb '{}'\n", text,
                         place->x / kWidth, place->y / kHeight, m.curve->colour);
  }
  return out;
}

}  // namespace

std::string chartScript(const std::string& title, const std::vector<ChartPoint>& points, ChartCost cost) {
  const std::vector<Curve> curves = curvesOf(points);
  const Frame frame = frameOf(points, curves);
  // A curve joins its points by step, so that noise of the timing does not fold it.
  std::vector<ChartPoint> bySteps = points;
  std::stable_sort(bySteps.begin(), bySteps.end(),
                   [](const ChartPoint& a, const ChartPoint& b) { return a.step < b.step; });
  std::string out = axes(title, frame, cost) + labels(bySteps, curves, frame), plot = "plot ";
  std::vector<ChartPoint> sorted = points;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const ChartPoint& a, const ChartPoint& b) { return a.cpu < b.cpu; });
  out += block("front", sorted, {}, frame, [](const ChartPoint& p) { return p.onFront; });
  plot +=
      "$front using 1:2 with steps lw 9 lc '#e8e2c8' title 'Pareto front', \\\n"
      "  $front using 1:2 with points pt 7 ps 1.6 lc '#e8e2c8' notitle";  // of one run there is no step
  for (std::size_t k = 0; k < curves.size(); ++k) {
    const std::string name = fmt::format("c{}", k);
    const auto blockOf = [&](const std::string& called, bool failed) {
      return block(called, bySteps, curves[k], frame,
                   [&](const ChartPoint& p) { return p.curve == curves[k].name && atRim(p) == failed; });
    };
    out += blockOf(name, false) + blockOf(name + "failed", true);
    plot += fmt::format(
        ", \\\n  NaN with linespoints lw 2 pt {2} ps 0.7 lc '{1}' title '{3}'"  // in the key even if all failed
        ", \\\n  ${0} using 1:2 with linespoints lw 2 pt {2} ps 0.7 lc '{1}' notitle"
        ", \\\n  ${0}failed using 1:2 with points pt 2 ps 0.8 lw 2 lc '{1}' notitle",
        name, curves[k].colour, curves[k].symbol, spaced(curves[k].name));
  }
  const bool others = std::any_of(curves.begin(), curves.end(), [](const Curve& c) { return c.isOther; });
  out += fmt::format("set label 'numbers: substep, ms{}' at graph 1.02, graph 0 left tc '#888888' font ',11'\n",
                     others ? "; of FEM, nodes" : "");
  plot += fmt::format(", \\\n  NaN with points pt 2 ps 0.8 lw 2 lc '{}' title 'failed, or 100 % wrong'", kGrey);
  return out + plot + "\n";
}

}  // namespace medulla
