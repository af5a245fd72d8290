#include "app/force_comparison.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>

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

// Products of later[shift + i] with earlier[i], summed over i, of shifts up to `longest` to either side: those of
// `simulated` later at [shift], of `measured` later at [size - shift]. By Fourier transforms, since the sums themselves
// take half a second of ticks for every tick: minutes for a minute at 20 kHz.
static std::vector<double> productsOfShifts(const Signal& simulated, const Signal& measured, std::size_t longest) {
  std::size_t size = 1;  // with zeros enough that what a shift moves out at one end finds nothing at the other
  while (size < simulated.forces.size() + longest + 1) size *= 2;
  Eigen::FFT<double> transform;
  std::vector<double> padded(size), products(size);
  std::vector<std::complex<double>> ofSimulated, ofMeasured, sum(size);
  for (int axis = 0; axis < 3; ++axis) {
    const auto spectrum = [&](const Forces& forces, std::vector<std::complex<double>>& out) {
      for (std::size_t i = 0; i < forces.size(); ++i) padded[i] = forces[i][axis];
      transform.fwd(out, padded);
    };
    spectrum(simulated.forces, ofSimulated);
    spectrum(measured.forces, ofMeasured);
    for (std::size_t k = 0; k < size; ++k) sum[k] += ofSimulated[k] * std::conj(ofMeasured[k]);
  }
  transform.inv(products, sum);
  return products;
}

// Of what is `shift` later with the other, each less its mean there; 0 where next to nothing of one of them changes
// there: a quotient of roundings.
static double correlationOf(const Signal& later, const Signal& earlier, std::size_t shift, double product) {
  constexpr double kNothing = 1e-6;  // of all that changes; roundings of the transforms are 1e-15 of both
  const std::size_t count = later.forces.size() - shift;
  const Eigen::Vector3d ofLater = later.sums.back() - later.sums[shift], &ofEarlier = earlier.sums[count];
  const auto n = static_cast<double>(count);
  const double laterSquares = later.squares.back() - later.squares[shift] - ofLater.squaredNorm() / n,
               earlierSquares = earlier.squares[count] - ofEarlier.squaredNorm() / n;
  if (laterSquares <= kNothing * later.squares.back() || earlierSquares <= kNothing * earlier.squares.back()) return 0;
  return (product - ofLater.dot(ofEarlier) / n) / std::sqrt(laterSquares * earlierSquares);
}

static bool changes(const Forces& forces) {
  return std::any_of(forces.begin(), forces.end(), [&](const Eigen::Vector3d& f) { return f != forces[0]; });
}

static void findLag(const Forces& simulated, const Forces& measured, double tickDuration, ForceMatch& match) {
  if (!changes(simulated) || !changes(measured)) return;
  const Signal s(simulated), m(measured);
  const auto longest = std::min(static_cast<std::size_t>(std::lround(0.5 / tickDuration)), simulated.size() / 4);
  const std::vector<double> products = productsOfShifts(s, m, longest);
  match.lag = 0;
  match.correlation = correlationOf(s, m, 0, products[0]);
  constexpr double kRounding = 1e-9;  // forces that repeat agree as well after a period, but for rounding
  for (std::size_t shift = 1; shift <= longest; ++shift) {
    const double late = correlationOf(s, m, shift, products[shift]),
                 early = correlationOf(m, s, shift, products[products.size() - shift]);
    if (std::max(late, early) <= match.correlation + kRounding) continue;
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
