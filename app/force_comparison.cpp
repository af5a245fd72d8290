#include "app/force_comparison.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace medulla {

using Forces = std::vector<Eigen::Vector3d>;

// Forces less their mean, with the sums of those before each and of their squares.
struct Signal {
  Forces forces;
  Forces sums;                  // one more than forces
  std::vector<double> squares;  // likewise

  explicit Signal(Forces values) : forces(std::move(values)), sums(1, Eigen::Vector3d::Zero()), squares(1, 0.0) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& f : forces) mean += f;
    mean /= static_cast<double>(forces.size());
    for (Eigen::Vector3d& f : forces) {
      f -= mean;
      sums.push_back(sums.back() + f);
      squares.push_back(squares.back() + f.squaredNorm());
    }
  }
};

// Of what is `shift` later with the other, each less its mean there; 0 where next to nothing of one of them changes
// there: a quotient of roundings.
static double correlationAt(const Signal& later, const Signal& earlier, std::size_t shift) {
  constexpr double kNothing = 1e-9;  // of all that changes
  const std::size_t count = later.forces.size() - shift;
  const Eigen::Vector3d ofLater = later.sums.back() - later.sums[shift], &ofEarlier = earlier.sums[count];
  const auto n = static_cast<double>(count);
  const double laterSquares = later.squares.back() - later.squares[shift] - ofLater.squaredNorm() / n,
               earlierSquares = earlier.squares[count] - ofEarlier.squaredNorm() / n;
  if (laterSquares <= kNothing * later.squares.back() || earlierSquares <= kNothing * earlier.squares.back()) return 0;
  double both = -ofLater.dot(ofEarlier) / n;
  for (std::size_t i = 0; i < count; ++i) both += later.forces[i + shift].dot(earlier.forces[i]);
  return both / std::sqrt(laterSquares * earlierSquares);
}

// The nearest to 0 of the shifts from `first` to `last` that agree best; > 0: the simulated force is later.
struct Shift {
  long ticks = 0;
  double correlation = -2;
};
static Shift bestShift(const Signal& simulated, const Signal& measured, long first, long last) {
  constexpr double kRounding = 1e-9;  // forces that repeat agree as well after a period, but for rounding
  Shift best;
  for (long size = 0; size <= std::max(-first, last); ++size)
    for (const long shift : {size, -size}) {
      if (shift < first || shift > last) continue;
      const double c = shift < 0 ? correlationAt(measured, simulated, static_cast<std::size_t>(-shift))
                                 : correlationAt(simulated, measured, static_cast<std::size_t>(shift));
      if (c > best.correlation + kRounding) best = {shift, c};
    }
  return best;
}

// Means of so many ticks each.
static Forces pooled(const Forces& forces, std::size_t ticks) {
  Forces out(forces.size() / ticks, Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < out.size() * ticks; ++i) out[i / ticks] += forces[i] / static_cast<double>(ticks);
  return out;
}

static bool changes(const Forces& forces) {
  return std::any_of(forces.begin(), forces.end(), [&](const Eigen::Vector3d& f) { return f != forces[0]; });
}

// By milliseconds first, and then by ticks around the best: half a second of ticks for every tick took minutes for a
// minute at 20 kHz.
static void findLag(const Forces& simulated, const Forces& measured, double tickDuration, ForceMatch& match) {
  if (!changes(simulated) || !changes(measured)) return;
  const auto longest = std::min(std::lround(0.5 / tickDuration), static_cast<long>(simulated.size()) / 4);
  const long pool = std::clamp(std::lround(0.001 / tickDuration), 1L, std::max(1L, longest));
  const auto size = static_cast<std::size_t>(pool);
  const Shift coarse =
      bestShift(Signal(pooled(simulated, size)), Signal(pooled(measured, size)), -longest / pool, longest / pool);
  const long first = std::max(-longest, (coarse.ticks - 1) * pool), last = std::min(longest, (coarse.ticks + 1) * pool);
  const Shift fine = bestShift(Signal(simulated), Signal(measured), first, last);
  match.lag = static_cast<double>(fine.ticks) * tickDuration;
  match.correlation = fine.correlation;
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
