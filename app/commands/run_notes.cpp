#include "app/commands/run_notes.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <set>

#include "app/files/text.h"
#include "app/standard_streams.h"
#include "physics/dynamics/rigid_support.h"
#include "physics/model/mesh_topology.h"
#include "physics/model/surface_queries.h"

namespace medulla {

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

static void printUnseen(const Scene& scene, bool isExcerpt) {
  if (isShortened(scene, isExcerpt)) return;
  if (const double last = scene.camera.back().time; last > scene.duration)
    tell("note: the camera moves until {:.6g} s, and the scene ends at {:.6g} s\n", last, scene.duration);
  for (const SceneCaption& caption : scene.captions)
    if (caption.from >= scene.duration)
      tell("note: the caption {} begins at {:.6g} s, and the scene ends at {:.6g} s\n", inQuotes(caption.text, '"'),
           caption.from, scene.duration);
}

// No hand is as fast: a clutch, or a tracker that lost it. What lies between is played all the same.
static void printJumps(const LoadedScene& loaded) {
  constexpr double kFastest = 5;  // m/s
  for (std::size_t k = 0; k < loaded.trajectories.size(); ++k) {
    const std::vector<ToolSample>& samples = loaded.trajectories[k].samples;
    for (std::size_t i = 1; i < samples.size(); ++i) {
      const double way = (samples[i].position - samples[i - 1].position).norm();
      const double time = samples[i].time - samples[i - 1].time;
      if (way <= kFastest * time) continue;
      tell("note: tool '{}' moves by {:.3g} mm in {:.3g} ms at {:.6g} s: is its motion all there?\n",
           loaded.scene.tools[k].name, 1e3 * way, 1e3 * time, samples[i - 1].time);
      break;
    }
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

// Links that bend far before they twist turn their ends until torsion has a longer lever than the estimate of the
// explicit step knows, which takes them straight: a colon of a tenth gained a hundred times its energy.
static void printLimpLinks(const Scene& scene) {
  constexpr double kLimp = 1. / 3;
  for (const SceneBody& body : scene.bodies)
    for (const SteeredLinks& steered : body.steered)
      if (steered.factors.flexion < kLimp * steered.factors.torsion) {
        tell(
            "note: links of body '{}' bend far more easily than they twist: the explicit step may be too long for "
            "them, integrator=\"implicit\" is not\n",
            body.name);
        break;
      }
}

// m; how far a ball reaches into a closed surface, 0 or less where it does not touch it.
static double reachInto(const TriangleMesh& surface, const Eigen::Vector3d& centre, double radius) {
  if (boundsOf(surface.vertices).exteriorDistance(centre) >= radius)
    return 0;  // most tools start beside most bodies: no tree for them
  const SurfaceTree tree = makeSurfaceTree(surface);
  const double distance = closestPoint(tree, centre).distance;
  return radius + (isInside(tree, centre) ? distance : -distance);
}

// The tissue pushes such a tool out at once, with all the force of its spring. A closed one holds what it is in.
static void printBuriedTools(const LoadedScene& loaded, const World& world) {
  if (world.time() < 0) return;    // bodies are about to settle: where they lie at 0, a run tells
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
    for (const SceneLoad& load : body.loads) {
      const double from = load.whole.from, to = load.whole.to;
      if (load.isIdle) tell("note: a load on body '{}' acts where it is held\n", body.name);
      if (isShortened(scene, isExcerpt)) continue;
      if (from >= scene.duration)
        tell("note: a load on body '{}' begins at {:.6g} s, and the scene ends at {:.6g} s\n", body.name, from,
             scene.duration);
      else if (to > scene.duration)
        tell("note: a load on body '{}' grows until {:.6g} s, and the scene ends at {:.6g} s, at {:.3g} % of it\n",
             body.name, to, scene.duration, 100 * (scene.duration - from) / (to - from));
    }
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

// Numbers that are right in other units. Thresholds are an order of magnitude beyond what bodies are made of: brain and
// fat from a few hundred pascals.
static void printUnits(const LoadedScene& loaded) {
  const Scene& scene = loaded.scene;
  const auto ask = [](const std::string& what, double value, std::string_view unit) {
    tell("note: {} is {:.4g} {}; is it in that unit?\n", what, value, unit);
  };
  for (const SceneBody& body : scene.bodies) {
    if (body.tissue.young < 100) ask(fmt::format("Young's modulus of body '{}'", body.name), body.tissue.young, "Pa");
    if (body.tissue.density < 50 || body.tissue.density > 3e4)
      ask(fmt::format("the density of body '{}'", body.name), body.tissue.density, "kg/m3");
  }
  if (const double g = scene.dynamics.gravity.norm(); g > 200) ask("gravity", g, "m/s2");
  const double around = sizeOfBodies(scene);
  for (std::size_t k = 0; k < scene.statics.size(); ++k) {
    const double size = boundsDiagonal(loaded.statics[k]);
    if (!scene.statics[k].meshPath.empty() && (size > 50 * around || size < 0.01 * around))
      tell("note: {} is {:.3g} m across, beside bodies of {:.3g} m in all; is its unit right?\n",
           scene.statics[k].meshPath, size, around);
  }
}

static void printPassedThrough(const Scene& scene) {
  if (scene.dynamics.contact != ContactMode::none) return;
  const bool any =
      std::any_of(scene.statics.begin(), scene.statics.end(), [](const SceneStatic& s) { return s.contact; });
  if (any)
    tell(
        "note: bodies pass through static shapes: <dynamics contact=\"balls\"> lets them lie on these, "
        "contact=\"false\" of the shapes ends this note\n");
}

// Twenty times and more those of the shipped scenes.
static void printManySubsteps(const World& world, double frameRate) {
  constexpr double kMany = 1e5;  // per second
  if (const double rate = world.substepsPerFrame() * frameRate; rate > kMany)
    tell(
        "note: {:.2g} substeps per second: tissue so stiff, or cells so small, run faster in implicit steps "
        "(<dynamics integrator=\"implicit\"/>)\n",
        rate);
}

void printWarnings(const LoadedScene& loaded, const RunOptions& options, const World& world) {
  const Scene& scene = loaded.scene;
  printUnits(loaded);
  printPassedThrough(scene);
  printUnplayed(loaded, options.isExcerpt);
  printUnseen(scene, options.isExcerpt);
  printJumps(loaded);
  printAlmostClosed(loaded);
  for (const BodyOverlap& o : world.startOverlaps()) {
    const std::string& name = scene.bodies[o.body0].name;
    const SceneBody& body = scene.bodies[o.body0];
    if (o.body1 < 0)
      tell("warning: body '{}' overlaps static shapes by {:.2g} mm at the start{}\n", name, 1e3 * o.depth,
           isHeld(body)
               ? " where its surface is not held on them: its spheres stand on them, and tools feel it too hard"
               : "");
    else
      tell("warning: bodies '{}' and '{}' overlap by {:.2g} mm at the start\n", name, scene.bodies[o.body1].name,
           1e3 * o.depth);
  }
  printBuriedTools(loaded, world);
  for (const SceneBody& body : scene.bodies) printRigid(body);
  printUnusedNetworks(scene);
  printIdleLoads(scene, options.isExcerpt);
  if (scene.dynamics.integrator != Integrator::implicit) {
    printLimpLinks(scene);
    return printManySubsteps(world, scene.dynamicsRate);
  }
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
void printNotes(const LoadedScene& loaded, const RunTotals& totals, const World& world) {
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
  for (std::size_t b = 0; b < totals.pressed.size(); ++b)
    if (totals.pressed[b] && loaded.scene.bodies[b].surface == SurfaceMode::skin)
      tell(
          "note: tools acted on body '{}', whose surface=\"skin\" does not yield by itself: they feel it too hard; "
          "\"contact\" or \"full\" does\n",
          loaded.scene.bodies[b].name);
  printSqueezed(loaded, totals);
  if (totals.volumeRatioMin <= 0)
    tell(
        "note: a body was turned inside out (volume_ratio_min {:.3g}): its model is too coarse, its tissue too "
        "soft for what acts on it, or a step too long\n",
        totals.volumeRatioMin);
  else if (totals.volumeRatioMax > 2)
    tell(
        "note: a body was blown up to {:.3g} times its volume: its tissue is too soft for what acts on it, or a "
        "step too long\n",
        totals.volumeRatioMax);
  for (std::size_t b = 0; b < loaded.scene.bodies.size(); ++b)
    if (world.hasTurnedOver(static_cast<int>(b)))
      tell(
          "note: cells of body '{}' turned over against their neighbours: pulled or pressed further than identified "
          "links follow, or a step too long\n",
          loaded.scene.bodies[b].name);
  const CreepReport& creep = world.creep();
  if (creep.substeps == 0) return;
  std::vector<std::string> names;
  for (std::size_t b = 0; b < creep.bodies.size(); ++b)
    if (creep.bodies[b]) names.push_back(fmt::format("'{}'", loaded.scene.bodies[b].name));
  tell(
      "note: {} crept on without speed where implicit steps failed, in {}: deformed beyond what they follow, or too "
      "stiff for their length\n",
      joined(names, ", "), creep.substeps == 1 ? "1 substep" : fmt::format("{} substeps", creep.substeps));
}

}  // namespace medulla
