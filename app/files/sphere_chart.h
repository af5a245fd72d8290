#pragma once

#include <string>
#include <vector>

#include "app/files/chart_file.h"

// The second chart: what more filling spheres bring and cost.
namespace medulla {

struct SphereChartRow {
  int spheres = 0;                    // of all bodies
  double gapMax = 0, gapMean = 0;     // %, surface to the nearest ball, of the body where it is largest
  double step = 0;                    // s; 0: every run failed
  double cpu = 0;                     // as ChartCost says
  double errorMax = 0, errorRms = 0;  // %
  bool isReference = false;           // what the others are measured against: it has no error
};

// CSV, a row per number of spheres. Errors are those of OutputFile.
void writeSphereChart(const std::string& path, const std::vector<SphereChartRow>& rows, ChartCost cost);

// The picture as a script for gnuplot: spheres across, gap and error upwards on the left, cost on the right; numbers of
// spheres with which every run failed at 100 %.
std::string sphereChartScript(const std::string& title, const std::vector<SphereChartRow>& rows, ChartCost cost);

}  // namespace medulla
