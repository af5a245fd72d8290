#include "app/commands/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "app/commands/rest_watch.h"
#include "app/commands/run_recorders.h"
#include "app/files/text.h"
#include "app/interrupt.h"
#include "app/standard_streams.h"
#include "physics/dynamics/rigid_support.h"
#include "physics/model/surface_queries.h"

namespace medulla {

void recordFrames(const Simulation& simulation, bool last, std::vector<RecordedFrame>& moments) {
  const double start = simulation.previous().time, end = simulation.current().time;
  for (RecordedFrame& m : moments) {
    const bool due = m.time <= end + 1e-9 || last;
    if (!due || !m.frame.bodies.empty()) continue;
    const double alpha = std::clamp((m.time - start) / (end - start), 0.0, 1.0);
    blendFrames(simulation.previous(), simulation.current(), alpha, m.frame);
  }
}

std::map<std::string, std::string> filesOfTools(const std::string& option, const Scene& scene,
                                                const std::map<std::string, std::string>& files) {
  std::map<std::string, std::string> out;
  for (const auto& [name, path] : files) {
    if (scene.tools.empty()) throw std::runtime_error(fmt::format("{} {}: the scene has no tool", option, path));
    if (name.empty() && scene.tools.size() != 1)
      throw std::runtime_error(
          fmt::format("{} {}: the scene has {} tools, write TOOL=FILE", option, path, scene.tools.size()));
    const std::string tool = name.empty() ? scene.tools[0].name : name;
    if (std::none_of(scene.tools.begin(), scene.tools.end(), [&](const SceneTool& t) { return t.name == tool; }))
      throw std::runtime_error(fmt::format("{} {}={}: the scene has no tool \"{}\"", option, name, path, name));
    if (!out.try_emplace(tool, path).second)
      throw std::runtime_error(
          fmt::format("{} {}={}: another file is named for this tool, expected one file per tool", option, tool, path));
  }
  return out;
}

LoadedScene loadRun(const RunOptions& options) {
  Scene scene = readScene(options.scene, options.overrides);
  const auto trajectories = filesOfTools("--trajectory", scene, options.trajectories);
  return loadScene(std::move(scene), trajectories);
}

int pictureCount(const Scene& scene) {
  return static_cast<int>(std::ceil(scene.duration * scene.fps - 1e-9));
}

std::vector<double> pictureTimes(const Scene& scene, int first, int last) {
  std::vector<double> times;
  for (int k = first; k < last; ++k) times.push_back(k / scene.fps);
  return times;
}

void PictureTimes::afterFrame(const Simulation& simulation, const std::function<void(int, const PictureState&)>& each) {
  const double end = simulation.record().start + simulation.record().duration;
  for (; next_ < times_.size() && times_[next_] <= end + 1e-9; ++next_) {
    stateAt(simulation.record(), times_[next_], state_);
    each(firstNumber_ + static_cast<int>(next_), state_);
  }
}

// One who shortens a scene knows what is not played.
static bool isShortened(const Scene& scene, bool isExcerpt) {
  return isExcerpt || durationOverridden(scene);
}

// Scripted motions end before their scenes by intention, and the tool stands still from then on. What lies outside the
// scene is never seen, and a table whose clock begins late was likely cut out of a longer one.
static void printUnplayed(const LoadedScene& loaded, bool isExcerpt) {
  constexpr double kLeast = 0.5, kShare = 0.05;  // s; of the motion
  const Scene& scene = loaded.scene;
  for (std::size_t k = 0; k < loaded.trajectories.size(); ++k) {
    const SceneTool& tool = scene.tools[k];
    const double start = loaded.trajectories[k].samples.front().time, end = motionEnd(loaded.trajectories[k]);
    const double length = end - start;
    const double outside = length - std::max(0.0, std::min(end, scene.duration) - std::max(start, 0.0));
    if (tool.recordingPath.empty() && start > kLeast && length > 0)
      tell("note: tool '{}' stands still until {:.6g} s, where {} begins\n", tool.name, start, tool.trajectoryPath);
    if (!isShortened(scene, isExcerpt) && outside >= kLeast && outside > kShare * length)
      tell("note: {:.4g} of {:.4g} s of the motion of tool '{}' are not played: the scene is 0 to {:.6g} s\n", outside,
           length, tool.name, scene.duration);
  }
}

// As of a recording whose `closes` is the very least that its jaws come to.
static void printAlmostClosed(const LoadedScene& loaded) {
  constexpr double kRounding = 1e-6;
  for (std::size_t k = 0; k < loaded.trajectories.size(); ++k) {
    double most = 0;
    for (const ToolSample& sample : loaded.trajectories[k].samples) most = std::max(most, sample.grip);
    if (most <= kGripCloses && most > kGripCloses - kRounding)
      tell("note: the jaws of tool '{}' come to where they close and no further: it grips nothing\n",
           loaded.scene.tools[k].name);
  }
}

// m; how far a ball reaches into a closed surface, below 0 where it does not touch it.
static double reachInto(const TriangleMesh& surface, const Eigen::Vector3d& centre, double radius) {
  const SurfaceTree tree = makeSurfaceTree(surface);
  const double distance = closestPoint(tree, centre).distance;
  return radius + (isInside(tree, centre) ? distance : -distance);
}

// The tissue pushes such a tool out at once, with all the force of its spring. A closed one holds what it is in.
static void printBuriedTools(const LoadedScene& loaded, const World& world) {
  constexpr double kLeast = 0.01;  // of the tool's radius: one that just touches
  DynamicsFrame frame;
  world.readFrame(frame);
  for (std::size_t k = 0; k < loaded.trajectories.size(); ++k) {
    const ToolSample start = sampleTrajectory(loaded.trajectories[k], 0);
    const double radius = loaded.scene.tools[k].settings.radius;
    for (std::size_t b = 0; b < frame.bodies.size() && start.grip <= kGripCloses; ++b) {
      const SceneBody& body = loaded.scene.bodies[b];
      const double depth = reachInto({frame.bodies[b].nodes, body.model->triangles}, start.position, radius);
      if (depth > kLeast * radius)
        tell("warning: tool '{}' reaches {:.2g} mm into body '{}' at the start and is pushed out at once\n",
             loaded.scene.tools[k].name, 1e3 * depth, body.name);
    }
  }
}

static void printIdleLoads(const Scene& scene, bool isExcerpt) {
  for (const SceneBody& body : scene.bodies) {
    const std::set<int> held(body.fixedNodes.begin(), body.fixedNodes.end());
    if (holdsByNodes(body) && !body.deadLoads.empty() &&
        std::all_of(body.deadLoads.begin(), body.deadLoads.end(),
                    [&](const DeadLoad& l) { return held.count(l.node) > 0; }))
      tell("note: every load on body '{}' acts where it is held\n", body.name);
    for (const SceneLoad& load : body.loads)
      if (load.whole.from >= scene.duration && !isShortened(scene, isExcerpt))
        tell("note: a load on body '{}' begins at {:.6g} s, and the scene ends at {:.6g} s\n", body.name,
             load.whole.from, scene.duration);
  }
}

// A skin moves with its spheres alone.
static void printRigid(const SceneBody& body) {
  std::set<int> held;
  for (const FixedSphere& sphere : body.fixed)
    if (sphere.freedom == FixedFreedom::all) held.insert(sphere.sphere);
  if (std::set<int>(body.fixedNodes.begin(), body.fixedNodes.end()).size() == body.model->restNodes.size())
    tell("note: every node of body '{}' is held\n", body.name);
  else if (body.surface == SurfaceMode::skin && held.size() == body.model->spheres.size())
    tell("note: body '{}' is rigid: all its spheres are held, and surface=\"skin\" moves with these alone\n",
         body.name);
}

// Who had finite elements identify links hardly wants beams by default.
static void printUnusedNetworks(const Scene& scene) {
  for (const SceneBody& body : scene.bodies)
    if (!body.choosesLinks && body.model->identified && !body.model->identified->usesFormulas)
      tell(
          "note: body '{}' has beams, though its model has identified links: links=\"identified\" takes these, "
          "links=\"beam\" ends this note\n",
          body.name);
}

void printWarnings(const LoadedScene& loaded, const RunOptions& options, const World& world) {
  const Scene& scene = loaded.scene;
  printUnplayed(loaded, options.isExcerpt);
  printAlmostClosed(loaded);
  for (const BodyOverlap& o : world.startOverlaps()) {
    const std::string& name = scene.bodies[o.body0].name;
    const SceneBody& body = scene.bodies[o.body0];
    const bool isHeld = !body.fixed.empty() || !body.fixedNodes.empty();
    if (o.body1 < 0)
      tell("warning: body '{}' overlaps static shapes by {:.2g} mm at the start{}\n", name, 1e3 * o.depth,
           isHeld ? " where its surface is not held on them: its spheres stand on them, and tools feel it too hard"
                  : "");
    else
      tell("warning: bodies '{}' and '{}' overlap by {:.2g} mm at the start\n", name, scene.bodies[o.body1].name,
           1e3 * o.depth);
  }
  printBuriedTools(loaded, world);
  for (const SceneBody& body : scene.bodies) printRigid(body);
  printUnusedNetworks(scene);
  printIdleLoads(scene, options.isExcerpt);
  if (scene.dynamics.integrator != Integrator::implicit) return;
  if (scene.dynamics.sleepAfter > 0)
    tell("warning: sleep_after has no effect: bodies sleep under the explicit integrator only\n");
  if (std::any_of(scene.bodies.begin(), scene.bodies.end(),
                  [](const SceneBody& body) { return body.surface == SurfaceMode::contact; }))
    tell("note: surface=\"contact\" is \"full\": nodes are chosen under the explicit integrator only\n");
}

// A moment of it is nothing: a tool that is caught between two bodies.
static void printSqueezed(const LoadedScene& loaded, const RunTotals& totals) {
  constexpr double kLeast = 0.05;  // s
  for (std::size_t k = 0; k < totals.squeezedTicks.size(); ++k) {
    const double squeezed = double(totals.squeezedTicks[k]) / loaded.scene.servoRate;
    if (squeezed < kLeast) continue;
    tell(
        "note: for {:.2g} s surfaces left tool '{}' less than half of its radius: walls that close on it, or "
        "tissue pressed deeper than its model can follow, which then lets the tool in\n",
        squeezed, loaded.scene.tools[k].name);
  }
}

// What a run came to that was hardly meant. A run that ends before a tool's motion does says nothing of the tool.
static void printNotes(const LoadedScene& loaded, const RunTotals& totals, const CreepReport& creep) {
  for (std::size_t k = 0; k < loaded.trajectories.size(); ++k) {
    if (motionEnd(loaded.trajectories[k]) > totals.simulated + 1e-9) continue;
    const std::string& name = loaded.scene.tools[k].name;
    const int closings = totals.closings[k];
    if (!totals.touched[k])
      tell("note: tool '{}' touched nothing in its whole motion\n", name);
    else if (closings > 0 && !totals.held[k])
      tell("note: tool '{}' closed {} and held nothing\n", name,
           closings == 1 ? "once" : fmt::format("{} times", closings));
    else if (totals.beganClosed[k] && !totals.held[k])
      tell("note: tool '{}' was closed from the start and held nothing\n", name);
  }
  printSqueezed(loaded, totals);
  if (totals.volumeRatioMin <= 0)
    tell(
        "note: a body was turned inside out (volume_ratio_min {:.3g}): its model is too coarse, its tissue too "
        "soft for what acts on it, or a step too long\n",
        totals.volumeRatioMin);
  if (creep.substeps == 0) return;
  std::vector<std::string> names;
  for (std::size_t b = 0; b < creep.bodies.size(); ++b)
    if (creep.bodies[b]) names.push_back(fmt::format("'{}'", loaded.scene.bodies[b].name));
  tell("note: {} crept on without speed where implicit steps failed, in {}: deformed beyond what they follow\n",
       joined(names, ", "), creep.substeps == 1 ? "1 substep" : fmt::format("{} substeps", creep.substeps));
}

std::vector<Result> runToEnd(const LoadedScene& loaded, const RunOptions& options, Simulation& simulation,
                             const std::function<void()>& afterFrame, const std::function<void()>& finish,
                             const std::function<void()>& advance) {
  RunRecorders recorders(loaded, options);
  std::optional<RestWatch> rest;
  if (options.untilRest) rest.emplace(loaded, simulation);
  printWarnings(loaded, options, simulation.world());
  for (bool last = false; !last;) {
    checkInterrupt();
    if (advance)
      advance();
    else
      simulation.advanceFrame();
    if (rest) rest->afterFrame(simulation);
    const bool isAtRest = rest && rest->atRest();
    if (rest && !isAtRest && simulation.finished()) rest->fail(simulation.time(), !outputFiles(options).empty());
    last = simulation.finished() || isAtRest;
    recorders.afterFrame(simulation, last);
    afterFrame();
  }
  if (finish) finish();
  recorders.commit(simulation);
  printNotes(loaded, simulation.totals(), simulation.world().creep());
  return recorders.forceResults();
}

std::vector<Result> runResults(const Simulation& simulation, double cpuSeconds, double wallSeconds) {
  const RunTotals& totals = simulation.totals();
  const PenetrationReport penetration = simulation.world().penetration();
  return {{"simulated", fmt::format("{:.6g}", totals.simulated), "s"},
          {"cpu", fmt::format("{:.4g}", cpuSeconds), "s"},
          {"realtime", fmt::format("{:.4g}", totals.simulated / std::max(wallSeconds, 1e-9)), "x"},
          {"substeps", fmt::format("{}", totals.substeps), ""},
          {"ticks", fmt::format("{}", totals.ticks), ""},
          {"force_max", fmt::format("{:.5g}", totals.forceMax), "N"},
          {"force_clamped", fmt::format("{}", totals.clampedTicks), "ticks"},
          {"grip_slips", fmt::format("{}", totals.gripSlips), ""},
          {"user_energy_max", fmt::format("{:.4g}", totals.userEnergyMax), "J"},
          {"volume_ratio_min", fmt::format("{:.5g}", totals.volumeRatioMin), ""},
          {"volume_ratio_max", fmt::format("{:.5g}", totals.volumeRatioMax), ""},
          {"impulse_mismatch", fmt::format("{:.4g}", totals.impulseMismatch()), "%"},
          {"penetration_max", fmt::format("{:.3g}", penetration.bodies), "%"},
          {"static_penetration_max", fmt::format("{:.3g}", penetration.statics), "%"},
          {"hash", fmt::format("{:016x}", simulation.world().stateHash()), ""}};
}

void printResults(const std::vector<Result>& results) {
  for (const Result& r : results)
    fmt::print("{} {}{}\n", r.name, r.value, r.unit.empty() ? std::string() : " " + r.unit);
}

}  // namespace medulla
