#include "app/files/chart_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/files/output_file.h"

namespace medulla {

bool atRim(const ChartPoint& p) {
  return p.failedAt || !(p.errorMax < kChartRim);
}

const char* costLabel(ChartCost cost) {
  return cost == ChartCost::ofTheCase ? "CPU seconds of the whole load case" : "CPU seconds per simulated second";
}

const char* costUnit(ChartCost cost) {
  return cost == ChartCost::ofTheCase ? "s" : "s/s";
}

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
                  costUnit(cost)));
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

}  // namespace medulla
