#include "app/commands/rest_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

namespace medulla {

using Eigen::Vector3d;

namespace {

// m, of the node that is farthest from where it was.
double farthest(const std::vector<Vector3d>& from, const std::vector<Vector3d>& to) {
  double squared = 0;
  for (std::size_t k = 0; k < to.size(); ++k) squared = std::max(squared, (to[k] - from[k]).squaredNorm());
  return std::sqrt(squared);
}

// At its turning points, or before its ramp has begun, it would seem to rest.
void requireUndriven(const SceneBody& body) {
  for (const DrivenSphere& drive : body.driven)
    if (drive.amplitude > 0 || !drive.velocity.isZero())
      throw NotAtRest(fmt::format(
          "never at rest: sphere {} of body '{}' is driven all the time, expected a run without --until-rest",
          drive.sphere, body.name));
}

}  // namespace

RestWatch::RestWatch(const LoadedScene& loaded, const Simulation& simulation) {
  constexpr double kLeastPeriod = 0.1;  // s
  for (const SceneBody& body : loaded.scene.bodies) {
    requireUndriven(body);
    for (const DeadLoad& load : body.deadLoads) busyUntil_ = std::max(busyUntil_, load.to);
    const int k = static_cast<int>(bodies_.size());
    Body& watched = bodies_.emplace_back();
    watched.name = body.name;
    watched.start = watched.last = simulation.current().bodies[k].nodes;
    for (const Vector3d& node : watched.start) watched.size = std::max(watched.size, (node - watched.start[0]).norm());
    const double frequency = simulation.world().lowestFrequency(k);
    watched.period = frequency > 0 ? std::max(kLeastPeriod, 2 * std::numbers::pi / frequency) : kLeastPeriod;
  }
  for (const Trajectory& motion : loaded.trajectories) busyUntil_ = std::max(busyUntil_, motionEnd(motion));
}

void RestWatch::afterFrame(const Simulation& simulation) {
  constexpr double kOfWay = 1e-4, kOfSize = 2e-6;
  time_ = simulation.time();
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    Body& body = bodies_[k];
    const std::vector<Vector3d>& now = simulation.current().bodies[k].nodes;
    const double none = std::max(kOfWay * farthest(body.start, now), kOfSize * body.size);
    // A recorded motion ends at a tick, which may lie a rounding past the frame that ends there.
    if (farthest(body.last, now) <= none && time_ >= busyUntil_ - 1e-9) continue;
    body.last = now;
    body.movedAt = time_;
  }
}

bool RestWatch::atRest() const {
  return std::all_of(bodies_.begin(), bodies_.end(),
                     [&](const Body& body) { return time_ - body.movedAt >= body.period - 1e-9; });
}

void RestWatch::fail(bool hasFiles) const {
  const char* files = hasFiles ? "; no file is written, without --until-rest they all are" : "";
  if (busyUntil_ > time_)
    throw NotAtRest(fmt::format("not at rest: loads or tools act up to the end at {:.6g} s{}", time_, files));
  const auto latest = std::min_element(bodies_.begin(), bodies_.end(), [](const Body& a, const Body& b) {
    return a.movedAt + a.period > b.movedAt + b.period;
  });
  throw NotAtRest(fmt::format(
      "not at rest: body '{}' moved up to {:.6g} s, expected {:.3g} s of rest, its slowest swing, before the "
      "end at {:.6g} s{}",
      latest->name, latest->movedAt, latest->period, time_, files));
}

}  // namespace medulla
