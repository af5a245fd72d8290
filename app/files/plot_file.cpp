#include "app/files/plot_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <vector>

#include "app/files/chart_style.h"
#include "app/files/input_error.h"
#include "app/round_number.h"

namespace medulla {

namespace {

using Series = std::vector<double>;  // one value per row

struct Curve {
  std::string title, style;
  Series values;
};

struct Span {
  double from = 0, to = 0;  // s
};

struct Panel {
  std::string title;
  Series time;  // s; empty: the log's
  std::vector<Curve> curves;
  std::vector<Span> contact, held;
  bool logarithmic = false, fromZero = false;
};

// Lighter than any curve.
constexpr const char *kContactShade = "#dcebf7", *kHeldShade = "#fde3c4";

// ---- What the log holds ----------------------------------------------------------------------------------

Series column(const LogTable& log, const std::string& name, const char* expected = "a log of a run (--log)") {
  const std::size_t place = columnOf(log, name);
  if (place == log.columns.size())
    throw inputError(log.path, 0, fmt::format("column {} is missing, expected {}", name, expected));
  Series out;
  out.reserve(log.value.size());
  for (const auto& row : log.value) out.push_back(row[place]);
  return out;
}

// What stands before `suffix` in the columns that end in it.
std::vector<std::string> namesBefore(const LogTable& log, const std::string& suffix) {
  std::vector<std::string> out;
  for (const std::string& name : log.columns)
    if (name.ends_with(suffix)) out.push_back(name.substr(0, name.size() - suffix.size()));
  return out;
}

Series scaled(Series values, double factor) {
  for (double& v : values) v *= factor;
  return values;
}

// From the row before, because a row tells how a frame ends. Gaps too narrow to be seen are closed.
std::vector<Span> spansWhere(const Series& time, const std::function<bool(std::size_t)>& holds) {
  const double narrow = (time.back() - time.front()) / 500;
  std::vector<Span> out;
  for (std::size_t k = 0; k < time.size(); ++k) {
    if (!holds(k)) continue;
    const double from = time[k > 0 ? k - 1 : 0];
    if (!out.empty() && from - out.back().to <= narrow)
      out.back().to = time[k];
    else
      out.push_back({from, time[k]});
  }
  return out;
}

Curve line(const std::string& title, std::size_t colour, double width, Series values) {
  return {title, fmt::format("lines lw {} lc '{}'", width, kCurveColours[colour % std::size(kCurveColours)]),
          std::move(values)};
}

void addToolPanels(const LogTable& log, const Series& time, const std::string& tool, std::vector<Panel>& out) {
  Series force(time.size()), distance(time.size()), depth(time.size());
  const Series contact = column(log, tool + ".contact"), held = column(log, tool + ".held");
  Panel forces, places;
  for (const char* axis : {".x", ".y", ".z"}) {
    const Series f = column(log, tool + ".force" + axis), device = column(log, tool + ".device" + axis),
                 proxy = column(log, tool + ".proxy" + axis);
    for (std::size_t k = 0; k < time.size(); ++k) {
      force[k] = std::hypot(force[k], f[k]);
      distance[k] = std::hypot(distance[k], 1e3 * (proxy[k] - device[k]));
    }
    forces.curves.push_back(line(&axis[1], forces.curves.size(), 1.3, f));
  }
  for (std::size_t k = 0; k < time.size(); ++k) depth[k] = contact[k] > 0.5 && held[k] < 0.5 ? distance[k] : 0;
  forces.title = tool + ": force on the hand, N";
  forces.curves.insert(forces.curves.begin(), {"magnitude", fmt::format("lines lw 2.6 lc '{}'", kBlack), force});
  forces.contact = spansWhere(time, [&](std::size_t k) { return contact[k] > 0.5; });
  forces.held = spansWhere(time, [&](std::size_t k) { return held[k] > 0.5; });
  places.title = tool + ": device to proxy, mm";
  places.contact = forces.contact;
  places.held = forces.held;
  places.fromZero = true;
  places.curves.push_back(
      {"penetration", fmt::format("filledcurves y1=0 fs transparent solid 0.45 noborder lc '{}'", kBlue), depth});
  places.curves.push_back({"distance", fmt::format("lines lw 1.8 lc '{}'", kBlack), distance});
  out.push_back(std::move(forces));
  out.push_back(std::move(places));
}

// The shades of all tools.
void shadeLikeAll(const LogTable& log, const Series& time, const std::vector<std::string>& tools, Panel& panel) {
  std::vector<Series> contact, held;
  for (const std::string& tool : tools) {
    contact.push_back(column(log, tool + ".contact"));
    held.push_back(column(log, tool + ".held"));
  }
  const auto any = [](const std::vector<Series>& all, std::size_t k) {
    return std::any_of(all.begin(), all.end(), [&](const Series& s) { return s[k] > 0.5; });
  };
  panel.contact = spansWhere(time, [&](std::size_t k) { return any(contact, k); });
  panel.held = spansWhere(time, [&](std::size_t k) { return any(held, k); });
}

std::vector<Panel> panelsOf(const LogTable& log, const Series& time) {
  std::vector<Panel> panels;
  const std::vector<std::string> tools = namesBefore(log, ".force.x"), bodies = namesBefore(log, ".volume_ratio");
  for (const std::string& tool : tools) addToolPanels(log, time, tool, panels);
  Panel volume, nodes, energy;
  volume.title = "volume, % of rest";
  nodes.title = "surface nodes modelled";
  nodes.fromZero = true;
  const bool crowd = bodies.size() > std::size(kCurveColours);  // alike then, and named once
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const std::string name = !crowd ? bodies[b] : b == 0 ? fmt::format("{} bodies", bodies.size()) : "";
    const std::size_t colour = crowd ? 0 : b;
    const double width = crowd ? 0.7 : 1.8;
    volume.curves.push_back(line(name, colour, width, scaled(column(log, bodies[b] + ".volume_ratio"), 100)));
    nodes.curves.push_back(line(name, colour, width, column(log, bodies[b] + ".dynamic_nodes")));
  }
  energy.title = "energy, mJ";
  energy.logarithmic = true;
  energy.curves.push_back(line("elastic", 0, 1.8, scaled(column(log, "energy.elastic"), 1e3)));
  energy.curves.push_back(line("kinetic", 1, 1.8, scaled(column(log, "energy.kinetic"), 1e3)));
  for (Panel* panel : {&volume, &energy, &nodes}) {
    if (panel->curves.empty()) continue;
    shadeLikeAll(log, time, tools, *panel);
    panels.push_back(std::move(*panel));
  }
  return panels;
}

Panel panelOfFrameTimes(const LogTable& times) {
  Panel panel;
  panel.title = "what a dynamics frame took, ms";
  const char* expected = "the times of a run's frames (--frame-times)";
  panel.time = column(times, "t", expected);
  panel.fromZero = true;
  for (const char* name : {"servo", "dynamics", "surface"})
    panel.curves.push_back(line(name, panel.curves.size(), 1.3, column(times, name, expected)));
  return panel;
}

// ---- The script ------------------------------------------------------------------------------------------

// Names come from a file: in single quotes gnuplot takes them as they are, where double quotes would run what stands
// between backticks.
std::string quotedName(const std::string& name) {
  std::string out = "'";
  for (const char c : name) {
    if (c == '\'') out += c;
    out += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
  }
  return out + "'";
}

// Of time and value. More rows than can be seen are drawn as the least and the largest of each bin, in
// their order, so that no peak is lost.
std::string block(const std::string& name, const Series& time, const Series& values) {
  constexpr std::size_t kBins = 1000;
  std::string rows;
  const auto add = [&](std::size_t k) { rows += fmt::format("{:.10g} {:.7g}\n", time[k], values[k]); };
  const std::size_t width = time.size() > 2 * kBins ? (time.size() + kBins - 1) / kBins : 1;
  for (std::size_t k = 0; k < time.size(); k += width) {
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(k),
               last = values.begin() + static_cast<std::ptrdiff_t>(std::min(k + width, time.size()));
    const auto [least, most] = std::minmax_element(first, last);
    const std::size_t a = static_cast<std::size_t>(least - values.begin()),
                      b = static_cast<std::size_t>(most - values.begin());
    add(std::min(a, b));
    if (a != b) add(std::max(a, b));
  }
  return dataBlock(name, rows);
}

std::string shades(const std::vector<Span>& spans, const char* colour) {
  std::string out;
  for (const Span& s : spans)
    out += fmt::format(
        "set object rectangle from first {:.6g}, graph 0 to first {:.6g}, graph 1 behind fc rgb '{}' fs solid 1 "
        "noborder\n",
        s.from, s.to, colour);
  return out;
}

std::string axesOf(const Panel& panel) {
  double least = panel.curves[0].values[0], most = least;
  for (const Curve& c : panel.curves) {
    const auto [a, b] = std::minmax_element(c.values.begin(), c.values.end());
    least = std::min(least, *a);
    most = std::max(most, *b);
  }
  if (panel.logarithmic && most > 0) {
    const double top = std::ceil(std::log10(most));
    return fmt::format("set logscale y\nset yrange [1e{0}:1e{1}]\nset ytics 100\nset format y '10^{{%T}}'\n", top - 6,
                       top);
  }
  if (panel.fromZero) least = std::min(least, 0.0);
  // A constant is drawn with room around it.
  const bool nothing = least == 0 && most == 0;
  const double step = nothing ? 1 : nextRoundNumber(std::max({(most - least) / 4, 1e-3 * std::abs(most), 1e-6}));
  const double low = std::floor(least / step + 1e-9) * step,
               high = std::max(std::ceil(most / step - 1e-9) * step, low + step);
  return fmt::format("unset logscale y\nset yrange [{:.9g}:{:.9g}]\nset ytics {:.9g}\nset format y '%g'\n", low, high,
                     step);
}

std::string drawingOf(const Panel& panel, std::size_t index, bool explainsShades) {
  std::string out = "unset object\n" + shades(panel.contact, kContactShade) + shades(panel.held, kHeldShade);
  out += fmt::format("{}set label 2 {} noenhanced at graph 0, graph 1.09 left\nplot ", axesOf(panel),
                     quotedName(panel.title));
  for (std::size_t c = 0; c < panel.curves.size(); ++c)
    out += fmt::format("{}$p{}_{} using 1:2 with {} title {} noenhanced", c == 0 ? "" : ", \\\n  ", index, c,
                       panel.curves[c].style, quotedName(panel.curves[c].title));
  if (explainsShades)
    out += fmt::format(
        ", \\\n  NaN with filledcurves y1=0 fs solid 1 noborder fc rgb '{}' title 'contact'"
        ", \\\n  NaN with filledcurves y1=0 fs solid 1 noborder fc rgb '{}' title 'grab'",
        kContactShade, kHeldShade);
  return out + "\n";
}

}  // namespace

std::string plotScript(const LogTable& log, const LogTable* frameTimes, const std::string& title, PlotFormat format) {
  if (log.value.empty()) throw inputError(log.path, 0, "no rows after the header, expected a log of a run (--log)");
  const Series time = column(log, "t");
  std::vector<Panel> panels = panelsOf(log, time);
  if (frameTimes != nullptr && frameTimes->value.empty())
    throw inputError(frameTimes->path, 0, "no rows after the header");
  if (frameTimes != nullptr) panels.push_back(panelOfFrameTimes(*frameTimes));
  constexpr double kPanel = 124, kGap = 36, kHead = 62, kFoot = 58;  // pixels of the SVG
  const double height = kHead + kFoot + static_cast<double>(panels.size()) * (kPanel + kGap) - kGap;
  std::string out =
      format == PlotFormat::svg
          ? fmt::format("set terminal svg size 1000,{:.0f} dynamic font 'Helvetica,13'", height)
          : fmt::format("set terminal pngcairo size 2000,{:.0f} font 'Helvetica,10' fontscale 2 linewidth 2",
                        2 * height);
  out += " enhanced background 'white'\n";
  for (std::size_t p = 0; p < panels.size(); ++p)
    for (std::size_t c = 0; c < panels[p].curves.size(); ++c)
      out += block(fmt::format("p{}_{}", p, c), panels[p].time.empty() ? time : panels[p].time,
                   panels[p].curves[c].values);
  const double begin = time.size() > 1 ? 2 * time[0] - time[1] : time[0];  // the first row tells how a frame ended
  const double end = std::max(time.back(), begin + 1e-3);
  out += fmt::format(
      "set border 3 lc '{}'\nset tics nomirror out scale 0.6\nunset mytics\nset grid lc '#d4d4d4' lt 1 lw 0.6\n"
      "set key at graph 1.015, graph 1.05 left top Left reverse vertical maxrows 8 samplen 1.6 spacing {} "
      "noautotitle\n"
      "set xrange [{:.10g}:{:.10g}]\nset lmargin at screen 0.065\nset rmargin at screen 0.85\n"
      "set multiplot\nset label 1 {} noenhanced at screen 0.065, screen {:.5f} left font ',16'\n",
      kGrey, format == PlotFormat::svg ? 0.95 : 1.2, begin, end, quotedName(title), 1 - 0.36 * kHead / height);
  const auto hasShades = [](const Panel& panel) { return !panel.contact.empty() || !panel.held.empty(); };
  const auto explaining = std::find_if(panels.begin(), panels.end(), hasShades) - panels.begin();
  for (std::size_t p = 0; p < panels.size(); ++p) {
    const double top = kHead + static_cast<double>(p) * (kPanel + kGap), bottom = top + kPanel;
    if (p + 1 == panels.size()) out += "set format x '%g'\nset xlabel 'time, s' offset 0,0.4\n";
    if (p == 0) out += "set format x ''\n";
    out += fmt::format("set tmargin at screen {:.5f}\nset bmargin at screen {:.5f}\n", 1 - top / height,
                       1 - bottom / height);
    out += drawingOf(panels[p], p, static_cast<std::ptrdiff_t>(p) == explaining);
    if (p == 0) out += "unset label 1\n";
  }
  return out + "unset multiplot\n";
}

}  // namespace medulla
