#pragma once

#include <optional>
#include <string>
#include <vector>

namespace medulla {

// One trial of one method at one step.
struct StabilityPoint {
  std::string method, trial;  // trial: of tortureTrials(), or empty in the map
  double step = 0;            // s
  double young = 0;           // Pa
  bool survived = false;
  std::optional<double> recoveredAt;  // s
  double energyRatio = 0;             // largest over that at the start, 1 where both are 0
};

// What an explicit step may be at most, by theory.
struct StableStep {
  double young = 0, step = 0;  // Pa, s
};

// CSV, a row per point.
std::string stabilityRow(const StabilityPoint& point);
void writeStability(const std::string& path, const std::vector<StabilityPoint>& points);

// The picture as a script for gnuplot that writes SVG to standard output: above the map, a panel per method, step
// across and stiffness upwards with the explicit limit drawn over it; below the trials, a panel per method, a row per
// trial. There is at least one point of each.
std::string stabilityScript(const std::string& title, const std::vector<StabilityPoint>& map,
                            const std::vector<StabilityPoint>& trials, const std::vector<StableStep>& limit);

}  // namespace medulla
