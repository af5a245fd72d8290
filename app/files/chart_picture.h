#pragma once

#include <string>
#include <vector>

#include "app/files/chart_file.h"

namespace medulla {

// The picture as a script for gnuplot that writes SVG to standard output: cost across, largest error upwards, both
// logarithmic; a curve per method, labelled with its substeps as far as there is room; what failed or is wrong by 100 %
// and more on the upper rim, a row per curve.
std::string chartScript(const std::string& title, const std::vector<ChartPoint>& points, ChartCost cost);

}  // namespace medulla
