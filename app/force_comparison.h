#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "app/simulation.h"

// How far the simulated force is from the one that was measured on the hand when the trajectory was recorded.
namespace medulla {

struct ForceMatch {
  double rms = 0;           // N, of the difference as a vector
  double peak = 0;          // N, the largest simulated force
  double peakMeasured = 0;  // N
  // s by which the simulated force follows the measured one, and how well they then agree: the largest correlation of
  // what overlaps, over shifts of up to half a second or a quarter of the time. Positive: it comes later.
  // Empty where one of the two never changes.
  std::optional<double> lag;
  double correlation = 0;  // -1 to 1
};

// Both of the same ticks, at least one.
ForceMatch matchForces(const std::vector<Eigen::Vector3d>& simulated, const std::vector<Eigen::Vector3d>& measured,
                       double tickDuration);

// Collects both forces of every tool whose trajectory has measured ones.
class ForceComparison {
 public:
  explicit ForceComparison(const LoadedScene& loaded);
  void afterFrame(const Simulation& simulation);
  // Per tool with ticks to compare; empty for the others.
  std::vector<std::optional<ForceMatch>> matches() const;

 private:
  struct Forces {
    std::vector<Eigen::Vector3d> simulated, measured;
  };
  const LoadedScene* loaded_;
  std::vector<Forces> tools_;
};

}  // namespace medulla
