#pragma once

#include <optional>
#include <string>
#include <vector>

namespace medulla {

// One run of a chart: what it cost and how far off it was.
struct ChartPoint {
  std::string curve;  // of the method, and of the model where there are several
  int style = -1;     // the same in every chart; -1: by its place in this one
  int spheres = 0;    // of all bodies
  double step = 0;    // s, of a substep
  int nodes = 0;      // of a run of the reference's own program; 0: a run of this one
  double cpu = 0;     // CPU seconds, as ChartCost says
  // Distance of surface nodes from the reference, % of its largest displacement: over all moments, and at the end.
  double errorMax = 0, errorRms = 0, endErrorMax = 0, endErrorRms = 0;
  // The same at the end, of the nodes that dead loads act on and of the rest; none where there are no such nodes.
  std::optional<double> loadedErrorMax, loadedErrorRms, restErrorMax, restErrorRms;
  std::optional<double> volumeRatio;  // at the end, of the body whose volume has changed most
  std::optional<double> failedAt;     // s, where the state stopped being finite; errors are then of no account
  bool onFront = false;               // no other run is both cheaper and more accurate
};

// What a run costs: a scene goes on, a load case with a reference is done at its end.
enum class ChartCost { perSimulatedSecond, ofTheCase };

const char* costLabel(ChartCost cost);
const char* costUnit(ChartCost cost);

// Ticks of a logarithmic axis at 1, 2 and 5: within a decade or two gnuplot would label one or two alone.
std::string logTicks(double low, double high);

constexpr double kChartRim = 100;  // %: as wrong as if nothing had moved
// Failed, or as wrong as that.
bool atRim(const ChartPoint& point);

// Marks the Pareto front of cost against largest error.
void markFront(std::vector<ChartPoint>& points);

// CSV, a row per run. Errors are those of OutputFile.
void writeChart(const std::string& path, const std::vector<ChartPoint>& points, ChartCost cost);

}  // namespace medulla
