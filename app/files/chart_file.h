#pragma once

#include <optional>
#include <string>
#include <vector>

namespace medulla {

// One run of a chart: what it cost and how far off it was.
struct ChartPoint {
  std::string curve;  // of the method, and of the model where there are several
  int spheres = 0;    // of all bodies
  double step = 0;    // s, of a substep
  double cpu = 0;     // CPU seconds per simulated second
  // Distance of surface nodes from the reference, % of its largest displacement: over all moments, and at the end.
  double errorMax = 0, errorRms = 0, endErrorMax = 0, endErrorRms = 0;
  std::optional<double> failedAt;  // s, where the state stopped being finite; errors are then of no account
  bool onFront = false;            // no other run is both cheaper and more accurate
};

// Marks the Pareto front of cost against largest error.
void markFront(std::vector<ChartPoint>& points);

// CSV, a row per run. Errors are those of OutputFile.
void writeChart(const std::string& path, const std::vector<ChartPoint>& points);

// The picture as a script for gnuplot that writes SVG to standard output: cost across, largest error upwards, both
// logarithmic; a curve per method; what failed or is wrong by 100 % and more on the upper rim.
std::string chartScript(const std::string& title, const std::vector<ChartPoint>& points);

}  // namespace medulla
