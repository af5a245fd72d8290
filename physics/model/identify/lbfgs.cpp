#include "physics/model/identify/lbfgs.h"

#include <cmath>
#include <deque>
#include <limits>
#include <stdexcept>

namespace medulla {

using Eigen::VectorXd;

namespace {

struct Pair {
  VectorXd step, change;  // of x and of the gradient
  double scale;           // 1 / (step . change)
};

// The two-loop recursion: -H gradient.
VectorXd direction(const std::deque<Pair>& pairs, const VectorXd& gradient) {
  VectorXd d = -gradient;
  std::vector<double> along(pairs.size());
  for (std::size_t k = pairs.size(); k-- > 0;) {
    along[k] = pairs[k].scale * pairs[k].step.dot(d);
    d -= along[k] * pairs[k].change;
  }
  if (!pairs.empty()) d *= 1 / (pairs.back().scale * pairs.back().change.squaredNorm());
  for (std::size_t k = 0; k < pairs.size(); ++k)
    d += (along[k] - pairs[k].scale * pairs[k].change.dot(d)) * pairs[k].step;
  return d;
}

}  // namespace

double descend(const Objective& objective, const DescentSettings& settings, VectorXd& x) {
  constexpr double decrease = 1e-4, curvature = 0.9;
  VectorXd gradient = VectorXd::Zero(x.size()), trialGradient = gradient, trial;
  double value = objective(x, gradient);
  if (!std::isfinite(value)) throw std::runtime_error("a fit starts from a value that is not finite");
  std::deque<Pair> pairs;
  for (int iteration = 0; iteration < settings.iterations; ++iteration) {
    VectorXd d = direction(pairs, gradient);
    double slope = d.dot(gradient);
    if (!(slope < 0)) {
      if (pairs.empty()) break;
      pairs.clear();
      d = -gradient;
      slope = -gradient.squaredNorm();
      if (!(slope < 0)) break;
    }
    double low = 0, high = std::numeric_limits<double>::infinity();
    double step = pairs.empty() ? std::min(1., 0.1 * std::max(1., x.norm()) / d.norm()) : 1, reached = value;
    for (int k = 0; k < 30; ++k) {
      trial = x + step * d;
      reached = objective(trial, trialGradient);
      if (!(reached <= value + decrease * step * slope))
        high = step;
      else if (trialGradient.dot(d) < curvature * slope)
        low = step;
      else
        break;
      step = std::isfinite(high) ? (low + high) / 2 : 2 * low;
    }
    if (!(reached < value)) break;
    Pair pair{trial - x, trialGradient - gradient, 0};
    const double product = pair.step.dot(pair.change);
    const double fall = value - reached;
    x = trial;
    gradient = trialGradient;
    value = reached;
    if (product > 0) {
      pair.scale = 1 / product;
      pairs.push_back(std::move(pair));
      if (static_cast<int>(pairs.size()) > settings.memory) pairs.pop_front();
    }
    if (fall < settings.tolerance * std::abs(value)) break;
  }
  return value;
}

}  // namespace medulla
