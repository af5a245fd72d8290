#pragma once

#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "render/image.h"

namespace medulla {

struct StripCurve {
  glm::vec4 colour{1};        // linear RGB
  std::vector<float> values;  // evenly over the window, >= 0, at least two; the last is now
  std::string label;          // stands in the curve's colour above the chart
};

// Values of the last seconds, in the lower left corner of a picture. Pictures of less than 120 rows have no labels.
struct StripChart {
  float range = 1;             // of the values, > 0; beyond it they run along the edge
  float seconds = 5, now = 0;  // s: width of the window, and its right end; lines stand at whole seconds
  std::string rangeLabel, windowLabel;
  std::vector<StripCurve> curves;
};

// Over a finished picture. Nothing where there are no curves.
void drawStripChart(const StripChart& chart, Image& image);

}  // namespace medulla
