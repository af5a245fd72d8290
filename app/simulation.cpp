#include "app/simulation.h"

#include <algorithm>
#include <cmath>

#include "app/files/input_error.h"
#include "app/interrupt.h"
#include "app/progress.h"
#include "app/value_error.h"
#include "render/stage_times.h"

namespace medulla {

World makeWorld(const LoadedScene& loaded) {
  const Scene& scene = loaded.scene;
  std::vector<StaticShape> statics;
  for (std::size_t k = 0; k < scene.statics.size(); ++k) {
    if (!scene.statics[k].contact) continue;
    statics.push_back(scene.statics[k].shape);
    if (statics.back().kind == StaticShape::Kind::mesh) statics.back().mesh = loaded.statics[k];
  }
  try {
    return World(scene.dynamics, {scene.bodies.begin(), scene.bodies.end()}, statics);
  } catch (const TissueRefused& e) {
    throw valueError(scene, scene.bodies[e.body].tissuePlace, {"young", "poisson", "density", "damping"}, e.what());
  } catch (const std::runtime_error& e) {
    throw inputError(scene.path, 0, e.what());
  }
}

Simulation::Simulation(const LoadedScene& loaded, const EmbreeSettings& embree)
    : loaded_(&loaded),
      ticksPerFrame_(static_cast<int>(std::lround(loaded.scene.servoRate / loaded.scene.dynamicsRate))),
      frameCount_(static_cast<int>(std::ceil(loaded.scene.duration * loaded.scene.dynamicsRate - 1e-9))),
      frameDuration_(1 / loaded.scene.dynamicsRate),
      tickDuration_(1 / loaded.scene.servoRate),
      world_(makeWorld(loaded)) {
  settle();
  world_.readFrame(current_);
  previous_ = current_;
  sampleInputs(0, inputs_);

  std::vector<TouchableBody> bodies;  // none without tools: three trees of every surface, which nobody feels
  if (!loaded.trajectories.empty()) {
    const std::vector<std::vector<NodeGive>> give = world_.nodeGive();
    for (std::size_t b = 0; b < give.size(); ++b) bodies.push_back({loaded.scene.bodies[b].model, give[b]});
  }
  std::vector<ToolSettings> tools;
  for (const SceneTool& tool : loaded.scene.tools) tools.push_back(tool.settings);
  servo_ = std::make_unique<Servo>(bodies, tools, tickDuration_, current_, inputs_, embree);
  beginAtRest();

  totals_.touched.resize(tools.size());
  totals_.held.resize(tools.size());
  totals_.pressed.resize(loaded.scene.bodies.size());
  totals_.closings.resize(tools.size());
  totals_.squeezedTicks.resize(tools.size());
  for (const ToolSample& input : inputs_) totals_.beganClosed.push_back(input.grip > kGripCloses);
  record_.duration = frameDuration_;
  record_.from = record_.to = current_;
  record_.inputs.assign(ticksPerFrame_ + 1, inputs_);
  record_.tools.assign(ticksPerFrame_ + 1, servo_->tools());
}

// A frame in which nothing happened lies before the first: without one the tissue's answer would be unknown, and what a
// tool meets a wall.
void Simulation::beginAtRest() {
  if (loaded_->trajectories.empty()) return;
  DynamicsFrame before = current_;
  before.time -= frameDuration_;
  const std::vector<Eigen::Vector3d> nothing(loaded_->trajectories.size(), Eigen::Vector3d::Zero());
  servo_->commit(before, current_, servo_->tools(), &nothing);
  servo_->beginFrame();
}

void Simulation::settle() {
  const double start = world_.time();
  Progress progress("settle", -start, "s");
  while (world_.time() < 0) {
    checkInterrupt();
    world_.advance({});
    progress.update(world_.time() - start);
  }
}

void Simulation::sampleInputs(double time, std::vector<ToolSample>& out) const {
  out.resize(loaded_->trajectories.size());
  for (std::size_t k = 0; k < out.size(); ++k) out[k] = sampleTrajectory(loaded_->trajectories[k], time);
}

bool Simulation::finished() const {
  return frame_ >= frameCount_ || (isAwaited_ && record_.start + record_.duration >= loaded_->scene.duration - 1e-9);
}

void Simulation::advanceFrame() {
  const double start = wallSeconds();
  runTicks();
  record_.seconds = wallSeconds() - start;
  advanceDynamics();
  servo_->beginFrame();
}

void Simulation::advanceFrame(const ServoRecord& servo) {
  record_ = servo;
  isAwaited_ = true;
  advanceDynamics();
}

void Simulation::runTicks() {
  record_.start = time();
  std::swap(record_.from, record_.to);  // where the last record ended, this one begins
  record_.to = current_;
  record_.inputs[0] = record_.inputs[ticksPerFrame_];
  record_.tools[0] = record_.tools[ticksPerFrame_];
  for (int tick = 1; tick <= ticksPerFrame_; ++tick) {
    sampleInputs(record_.start + tick * tickDuration_, inputs_);
    if (!inputs_.empty()) servo_->tick(static_cast<double>(tick) / ticksPerFrame_, inputs_);
    record_.inputs[tick] = inputs_;
    record_.tools[tick] = servo_->tools();
  }
  servo_->handOver(frameDuration_, record_.loads);
}

void Simulation::advanceDynamics() {
  times_.servo = record_.seconds;
  // Ahead of what may throw: a frame that fails counts as tried.
  totals_.ticks += ticksPerFrame_;
  totals_.substeps += world_.substepsPerFrame();
  totals_.simulated = (frame_ + 1) * frameDuration_;
  const double start = wallSeconds();
  const std::vector<Eigen::Vector3d> given = world_.advance(record_.loads);
  const double stepped = wallSeconds();
  std::swap(previous_, current_);
  world_.readFrame(current_);
  // Without tools nobody feels the surface; a servo that runs elsewhere waits for it all the same.
  if (isAwaited_ || !loaded_->trajectories.empty())
    servo_->commit(previous_, current_, record_.tools[ticksPerFrame_], &given, isAwaited_ ? 1 : 0);
  times_.dynamics = stepped - start;
  times_.surface = wallSeconds() - stepped;
  ++frame_;
  visitLoadedNodes(record_.loads, [&](const auto& load, int) { totals_.pressed[load.body] = true; });
  accountTicks();
  accountImpulses(given);
  accountVolumes();
}

void Simulation::accountTicks() {
  for (int tick = 1; tick <= ticksPerFrame_; ++tick)
    for (std::size_t k = 0; k < record_.tools[tick].size(); ++k) {
      const ToolState& tool = record_.tools[tick][k];
      totals_.forceMax = std::max(totals_.forceMax, tool.force.norm());
      totals_.clampedTicks += tool.clamped;
      if (tool.inContact || tool.holding) totals_.touched[k] = true;
      if (tool.holding || tool.slipped) totals_.held[k] = true;
      totals_.squeezedTicks[k] += tool.squeezed;
      totals_.closings[k] +=
          record_.inputs[tick][k].grip > kGripCloses && record_.inputs[tick - 1][k].grip <= kGripCloses;
      totals_.gripSlips += tool.slipped && !record_.tools[tick - 1][k].slipped;
      totals_.userEnergyMax = std::max(totals_.userEnergyMax, tool.energy);
    }
}

// `given` by each tool to the bodies, N s; the force on the hand is minus that.
void Simulation::accountImpulses(const std::vector<Eigen::Vector3d>& given) {
  double impulse = 0, difference = 0;
  for (std::size_t k = 0; k < loaded_->trajectories.size(); ++k) {
    Eigen::Vector3d servo = Eigen::Vector3d::Zero();
    for (int tick = 1; tick <= ticksPerFrame_; ++tick) servo -= tickDuration_ * record_.tools[tick][k].force;
    const Eigen::Vector3d dynamics = k < given.size() ? given[k] : Eigen::Vector3d::Zero();
    impulse += servo.norm();
    difference += (servo - dynamics).norm();
  }
  totals_.toolImpulse += impulse;
  totals_.impulseDifference += difference;
  lastMismatch_ = mismatchOf(difference, impulse);
}

void Simulation::accountVolumes() {
  for (std::size_t b = 0; b < loaded_->scene.bodies.size(); ++b) {
    const double ratio = world_.volumeRatio(static_cast<int>(b));
    totals_.volumeRatioMin = std::min(totals_.volumeRatioMin, ratio);
    totals_.volumeRatioMax = std::max(totals_.volumeRatioMax, ratio);
  }
}

static ToolSample blendSample(const ToolSample& a, const ToolSample& b, double u) {
  ToolSample s;
  s.time = (1 - u) * a.time + u * b.time;
  s.position = blendPoint(a.position, b.position, u);
  s.worldFromTool = a.worldFromTool.slerp(u, b.worldFromTool);
  s.grip = (1 - u) * a.grip + u * b.grip;
  return s;
}

static ToolState blendTool(const ToolState& a, const ToolState& b, double u) {
  ToolState s = u < 0.5 ? a : b;
  s.device = blendPoint(a.device, b.device, u);
  s.proxy = blendPoint(a.proxy, b.proxy, u);
  s.force = blendPoint(a.force, b.force, u);
  s.steadyForce = blendPoint(a.steadyForce, b.steadyForce, u);
  s.grasp = (1 - u) * a.grasp + u * b.grasp;
  return s;
}

void stateAt(const ServoRecord& record, double time, PictureState& out) {
  const int ticks = static_cast<int>(record.inputs.size()) - 1;
  const double alpha = std::clamp((time - record.start) / record.duration, 0.0, 1.0);
  // A time on a tick takes that tick as it was: the usual picture rates divide the servo's.
  double position = alpha * ticks;
  if (std::abs(position - std::round(position)) < 1e-6) position = std::round(position);
  const int tick = std::min(static_cast<int>(position), ticks - 1);
  const double u = position - tick;
  out.time = time;
  blendFrames(record.from, record.to, position / ticks, out.frame);
  const std::size_t tools = record.tools[tick].size();
  out.inputs.resize(tools);
  out.tools.resize(tools);
  for (std::size_t k = 0; k < tools; ++k) {
    out.inputs[k] = blendSample(record.inputs[tick][k], record.inputs[tick + 1][k], u);
    out.tools[k] = blendTool(record.tools[tick][k], record.tools[tick + 1][k], u);
  }
}

}  // namespace medulla
