#include "app/force_comparison.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace medulla {

using Forces = std::vector<Eigen::Vector3d>;

// Forces less their mean, with the sum of the squares of those before each.
struct Signal {
  Forces forces;
  std::vector<double> squares;  // one more than forces

  explicit Signal(Forces values) : forces(std::move(values)), squares(1, 0.0) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& f : forces) mean += f;
    mean /= static_cast<double>(forces.size());
    for (Eigen::Vector3d& f : forces) {
      f -= mean;
      squares.push_back(squares.back() + f.squaredNorm());
    }
  }
};

// Correlation of later[shift + i] with earlier[i]; 0 where one of them is constant.
static double correlationAt(const Signal& later, const Signal& earlier, std::size_t shift) {
  const std::size_t count = later.forces.size() - shift;
  double both = 0;
  for (std::size_t i = 0; i < count; ++i) both += later.forces[i + shift].dot(earlier.forces[i]);
  const double squares = (later.squares.back() - later.squares[shift]) * earlier.squares[count];
  return squares > 0 ? both / std::sqrt(squares) : 0;
}

static bool changes(const Forces& forces) {
  return std::any_of(forces.begin(), forces.end(), [&](const Eigen::Vector3d& f) { return f != forces[0]; });
}

static void findLag(const Forces& simulated, const Forces& measured, double tickDuration, ForceMatch& match) {
  if (!changes(simulated) || !changes(measured)) return;
  const Signal s(simulated), m(measured);
  const auto longest = std::min(static_cast<std::size_t>(std::lround(0.5 / tickDuration)), simulated.size() / 4);
  match.lag = 0;
  match.correlation = correlationAt(s, m, 0);
  for (std::size_t shift = 1; shift <= longest; ++shift) {
    const double late = correlationAt(s, m, shift), early = correlationAt(m, s, shift);
    if (std::max(late, early) <= match.correlation) continue;
    match.correlation = std::max(late, early);
    match.lag = (late >= early ? 1 : -1) * static_cast<double>(shift) * tickDuration;
  }
}

ForceMatch matchForces(const Forces& simulated, const Forces& measured, double tickDuration) {
  assert(!simulated.empty() && simulated.size() == measured.size());
  ForceMatch match;
  double sum = 0;
  for (std::size_t i = 0; i < simulated.size(); ++i) {
    sum += (simulated[i] - measured[i]).squaredNorm();
    match.peak = std::max(match.peak, simulated[i].norm());
    match.peakMeasured = std::max(match.peakMeasured, measured[i].norm());
  }
  match.rms = std::sqrt(sum / static_cast<double>(simulated.size()));
  findLag(simulated, measured, tickDuration, match);
  return match;
}

ForceComparison::ForceComparison(const LoadedScene& loaded) : loaded_(&loaded), tools_(loaded.trajectories.size()) {}

void ForceComparison::afterFrame(const Simulation& simulation) {
  const ServoRecord& record = simulation.record();
  for (std::size_t k = 0; k < tools_.size(); ++k) {
    const Trajectory& trajectory = loaded_->trajectories[k];
    if (trajectory.measuredForces.empty()) continue;
    for (std::size_t tick = 1; tick < record.inputs.size(); ++tick) {
      const auto measured = measuredForceAt(trajectory, record.inputs[tick][k].time);
      if (!measured) continue;
      tools_[k].simulated.push_back(record.tools[tick][k].force);
      tools_[k].measured.push_back(*measured);
    }
  }
}

std::vector<std::optional<ForceMatch>> ForceComparison::matches() const {
  std::vector<std::optional<ForceMatch>> out(tools_.size());
  for (std::size_t k = 0; k < tools_.size(); ++k)
    if (!tools_[k].simulated.empty())
      out[k] = matchForces(tools_[k].simulated, tools_[k].measured, 1 / loaded_->scene.servoRate);
  return out;
}

}  // namespace medulla
