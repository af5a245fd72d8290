#include "haptics/servo.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>

#include "haptics/buckets.h"
#include "haptics/force_bounds.h"
#include "haptics/hand_over.h"
#include "haptics/leaving.h"
#include "haptics/servo_tool.h"
#include "haptics/tissue_motion.h"
#include "haptics/triple_buffer.h"

namespace medulla {

using Eigen::Vector3d;

struct Servo::Data {
  TripleBuffer<Buckets> surfaces;
  // Dynamics' side: of the surface committed last.
  std::array<std::vector<Vector3d>, 3> steps;
  std::array<std::vector<Vector3d>, 2> toolForce;
  double tickDuration;
  double alpha = 0;  // of the last tick
  std::vector<ServoTool> tools;
  std::vector<ToolState> states;
  std::vector<ProxyContact> contacts;  // scratch of handOver
};

// ---- Checks ----------------------------------------------------------------------------------------------

static void checkSample(const ToolSample& sample, std::size_t tool) {
  const bool inReach = sample.position.allFinite() && sample.position.lpNorm<Eigen::Infinity>() <= kToolReach;
  if (!inReach)
    throw std::runtime_error("tool " + std::to_string(tool) + ": device position is not finite or more than " +
                             std::to_string(int(kToolReach)) + " m from the origin");
  if (!(std::abs(sample.worldFromTool.norm() - 1) < 1e-3) || !std::isfinite(sample.grip))
    throw std::runtime_error("tool " + std::to_string(tool) + ": expected a unit quaternion and a finite grip");
}

static void checkSettings(const ToolSettings& s, std::size_t tool) {
  const auto positive = [](double v) { return v > 0 && std::isfinite(v); };
  const bool valid = positive(s.radius) && positive(s.stiffness) && s.damping >= 0 && std::isfinite(s.damping) &&
                     s.dynamicFriction >= 0 && s.staticFriction >= s.dynamicFriction &&
                     std::isfinite(s.staticFriction) && positive(s.forceMax) && positive(s.gripRadius) &&
                     positive(s.gripForceMax);
  if (!valid)
    throw std::runtime_error("tool " + std::to_string(tool) +
                             ": expected radius, stiffness, forceMax, gripRadius and gripForceMax > 0, damping >= 0 "
                             "and staticFriction >= dynamicFriction >= 0, all finite");
}

// ---- One tick --------------------------------------------------------------------------------------------

// What the surface's motion adds to the spring's force. The damper, against the velocity of the surface point in the
// dynamics: the proxy's own, differenced over ticks, would jump at every edge. And the lead: the blended surface is one
// frame late; uncorrected, a device that presses at speed v feels k v T too much, on soft tissue several times the
// tissue's own force.
static Vector3d motionForce(const ServoTool& tool, const TissueMotion& tissue) {
  return tool.settings.stiffness * tissue.lead + tool.settings.damping * (tissue.velocity - tool.motion.velocity);
}

static std::span<const ProxyContact> touchedContacts(const ServoTool& tool) {
  return tool.proxy.inContact() ? tool.proxy.touched() : std::span(tool.left);
}

// N, on the tissue, as the dynamics had it; to be asked only where it is known.
static Vector3d givenForce(const BlendedSurface& surface, double alpha, const ServoTool& tool) {
  return blendPoint(surface.toolForce[1][tool.index], surface.toolForce[0][tool.index], alpha);
}

// A push along the normal, as far as the dynamics can have it by now: what the tissue gave some frames ago, give or
// take what it can have changed since. Where a stiff tool meets limp tissue, a place that is off by a tenth of a
// millimetre is several times the force. Downward twice as much: what lags behind a device that withdraws hands it
// energy.
static double pushKeptToTissue(const BlendedSurface& surface, double alpha, const Vector3d& normal,
                               const TissueMotion& tissue, const ServoTool& tool, double push) {
  if (surface.toolForce[0].empty()) return push;
  const double given = std::max(0.0, -givenForce(surface, alpha, tool).dot(normal));
  const double since = pushSince(surface, alpha, tissue, normal, tool.settings, tool.motion);
  return std::clamp(push, std::max(0.0, given - 2 * since), given + since);
}

// What the device's motion makes of it is taken off.
static double pushFelt(const BlendedSurface& surface, double alpha, const Vector3d& normal, const TissueMotion& tissue,
                       ServoTool& tool) {
  const double push = pushKeptToTissue(surface, alpha, normal, tissue, tool, tool.estimate);
  const WayAndChange ways = recentWays(tool.motion, alpha);
  const double off = normal.dot(motionError(ways, alpha, tool.motion.error));
  // Rounding leaves of tissue that swings away 1e-17 N, or none: a tool that rests there would seem to press, or not.
  constexpr double kNothing = 1e-9;
  const double least = kNothing * tool.largestPush;
  if (push > least) noteFelt(std::min(push, tool.settings.forceMax) * normal, ways, tool.motion.error);
  const double felt = pushKeptToTissue(surface, alpha, normal, tissue, tool, std::max(0.0, push - off));
  return felt > least ? felt : 0;
}

// Likewise across it: a proxy on the late surface slips, or sticks, where the tissue itself does not.
static Vector3d dragKeptToTissue(const BlendedSurface& surface, double alpha, const Vector3d& normal,
                                 const TissueMotion& tissue, const ServoTool& tool, const Vector3d& drag) {
  if (surface.toolForce[0].empty()) return drag;
  return keptNear(drag, tangential(-givenForce(surface, alpha, tool), normal),
                  dragSince(surface, alpha, tissue, normal, tool.settings, tool.motion));
}

// m: where the tool's centre would touch what it is leaving.
static Vector3d placeLeft(const ServoTool& tool) {
  Vector3d sum = Vector3d::Zero();
  for (const ProxyContact& c : tool.left) sum += c.share * (c.point + tool.settings.radius * c.normal);
  return sum;
}

// The coupling of a contact that pushes, or that the tool is leaving: along the normal the spring, negative once the
// device has left the late surface, plus the motion's part, never pulling. The motion's part is bounded by the largest
// that the spring has been in this contact, so that force begins without a step on a surface that already moves.
// Across, a slipping contact is dragged by friction alone, which the proxy's position already holds; one that sticks by
// the coupling and the motion; off the late surface as when it was touched last, in the ratio of the pushes. Never by
// more than friction carries.
static Vector3d contactForce(const BlendedSurface& surface, double alpha, const Vector3d& way, ServoTool& tool) {
  tool.estimate = tool.push = 0;
  if (!tool.isLeaving) return Vector3d::Zero();
  const Proxy& proxy = tool.proxy;
  const Vector3d& normal = tool.lastFelt;
  const Vector3d pull = proxy.centre + proxy.shading - tool.device.position;
  const double depth = proxy.inContact() ? pull.dot(normal) : normal.dot(placeLeft(tool) - tool.device.position);
  const double spring = tool.settings.stiffness * depth;
  tool.largestPush = std::max(tool.largestPush, spring);
  tool.motion.way[0] += std::max(way.dot(normal), -std::max(0.0, depth)) * normal;  // from where it touched
  tool.motion.wayAcross[0] += tangential(way, normal);
  const TissueMotion tissue = contactMotion(surface, alpha, touchedContacts(tool), normal, tool.motion);
  const Vector3d motion = motionForce(tool, tissue);
  tool.estimate = std::max(0.0, spring + std::clamp(motion.dot(normal), -tool.largestPush, tool.largestPush));
  const double push = tool.push = pushFelt(surface, alpha, normal, tissue, tool);
  Vector3d drag =
      proxy.inContact() ? Vector3d(tool.settings.stiffness * tangential(pull, normal)) : Vector3d(push * tool.dragged);
  if (proxy.slipping || !tool.sticks) tool.leadWhereItStuck = tangential(tissue.lead, normal);
  tool.sticks = !proxy.slipping;
  if (tool.sticks)
    drag += tangential(motion - tool.settings.stiffness * tool.leadWhereItStuck, normal);
  else if (proxy.inContact() && spring > 0)
    drag *= push / spring;
  if (proxy.inContact() && push > 0) tool.dragged = drag / push;
  return withinCone(push * normal + dragKeptToTissue(surface, alpha, normal, tissue, tool, drag), normal,
                    tool.settings.staticFriction * proxy.wedging);
}

// N, of the springs of what is held, which share the tool's stiffness, and of its motion; each limited to its
// share of `most`, as in the dynamics.
static Vector3d heldForce(const BlendedSurface& surface, double alpha, const TissueMotion& tissue,
                          const ServoTool& tool, double most = std::numeric_limits<double>::infinity()) {
  const Vector3d motion = motionForce(tool, tissue);
  return meanOverHeld(tool.grip, [&](const HeldOffset& held) -> Vector3d {
    const Vector3d stretch = surface.node(held.node, alpha) - heldTarget(tool.device, held);
    return keptNear(tool.settings.stiffness * stretch + motion, Vector3d::Zero(), most);
  });
}

// The same for what a grip feels, in all directions.
static Vector3d keptToTissue(const BlendedSurface& surface, double alpha, const TissueMotion& tissue,
                             const ServoTool& tool, const Vector3d& force) {
  if (surface.toolForce[0].empty()) return force;
  const double change = (1 - alpha) * tool.change[1] + alpha * tool.change[0];
  const double since = heldSince(surface, alpha, tissue, change, tool.settings, tool.motion);
  return keptNear(force, -givenForce(surface, alpha, tool), since);
}
static Vector3d gripFelt(const BlendedSurface& surface, double alpha, const TissueMotion& tissue, ServoTool& tool) {
  const Vector3d limited = heldForce(surface, alpha, tissue, tool, tool.settings.forceMax);
  const Vector3d force = keptToTissue(surface, alpha, tissue, tool, limited);
  const WayAndChange ways = recentWays(tool.motion, alpha);
  const Vector3d off = motionError(ways, alpha, tool.motion.error);
  noteFelt(force, ways, tool.motion.error);
  return keptToTissue(surface, alpha, tissue, tool, force - off);
}

static void record(const Vector3d& force, ServoTool& tool, ToolState& state) {
  const double size = force.norm();
  state.force = size > tool.settings.forceMax ? Vector3d(tool.settings.forceMax / size * force) : force;
  // By the estimate, too: what the tissue gives is limited itself.
  state.clamped = std::max(size, tool.estimate) > tool.settings.forceMax;
  state.device = tool.device.position;
  state.proxy = tool.proxy.centre;
  state.holding = !tool.grip.held.empty();
  state.slipped = tool.grip.slipped;
  state.squeezed = !state.holding && tool.proxy.radius < 0.5 * tool.settings.radius;
  state.inContact = tool.proxy.inContact() || (!state.holding && size > 0);
  tool.deviceSum += tool.device.position;
  ++tool.ticks;
}

// m/s: of where the tool wants what it holds, the mean, since the last tick, when the device was at `before`. A tool
// that turns takes its targets along by omega x lever, as it takes the tissue: against the device's own velocity that
// would be felt as a damper that drags nothing.
static Vector3d heldVelocity(const ServoTool& tool, const ToolSample& before, double tickDuration) {
  const auto way = [&](const HeldOffset& held) -> Vector3d {
    return heldTarget(tool.device, held) - heldTarget(before, held);
  };
  return meanOverHeld(tool.grip, way) / tickDuration;
}

// What jaws would close on: also what is felt still, while the late surface has come off the proxy already.
static const ProxyContact* contactToHold(const ServoTool& tool, const Vector3d& felt) {
  if (tool.proxy.inContact()) return &tool.proxy.mainContact();
  return tool.isLeaving && !felt.isZero(0) ? &tool.left[0] : nullptr;
}

// What is held while the late surface has come off the proxy carries it nevertheless.
static void rideOn(const BlendedSurface& surface, double alpha, const ProxyContact& contact, Proxy& proxy) {
  proxy.contacts[0] = contact;
  proxy.contacts[0].point = pointAt(surface.triangle(contact.triangle, alpha), contact.weights);
  proxy.contacts[0].share = 1;
  proxy.contactCount = 1;
}

// Opens or closes. The targets of what it takes hold of are measured where the nodes are by now, and then shifted so
// that the springs, with what motion adds, start with the force `felt` so far (N): neither hand nor tissue is jerked.
static void tickGrip(const BlendedSurface& surface, double alpha, const Vector3d& felt, const ToolSample& before,
                     double tickDuration, ServoTool& tool) {
  Grip& grip = tool.grip;
  const bool wasHolding = !grip.held.empty();
  updateGrip(surface, alpha, contactToHold(tool, felt), tool.device, tool.settings, grip);
  if (grip.held.empty()) {
    if (wasHolding) tool.isLeaving = false;
    return;
  }
  tool.motion.velocity = heldVelocity(tool, before, tickDuration);
  if (wasHolding) {
    tool.motion.way[0] += tickDuration * tool.motion.velocity;
    return;
  }
  tool.pathEnd.reset();
  tool.holdBegan = tool.device;
  if (!tool.proxy.inContact()) rideOn(surface, alpha, tool.left[0], tool.proxy);
  beginHold(surface, alpha, grip, tool.settings.stiffness, tool.motion);
  const Eigen::Quaterniond toolFromWorld = tool.device.worldFromTool.conjugate();
  for (HeldOffset& held : grip.held) held.offset += toolFromWorld * surface.nodeLead(held.node, alpha);
  const TissueMotion tissue = heldMotion(surface, alpha, grip, tool.motion);
  const Vector3d shift = (heldForce(surface, alpha, tissue, tool) - felt) / tool.settings.stiffness;
  for (HeldOffset& held : grip.held) held.offset += toolFromWorld * shift;
  if (surface.toolForce[0].empty()) return;
  // What the tissue gave is that of a contact still, and no bound before the grip's own has come.
  const double off = (felt + givenForce(surface, alpha, tool)).norm();
  for (double& change : tool.change) change = std::max(change, off);
}

// Whether the grip holds on, its force recorded.
static bool feelGrip(const BlendedSurface& surface, double alpha, ServoTool& tool, ToolState& state) {
  if (tool.grip.held.empty()) return false;
  const TissueMotion tissue = heldMotion(surface, alpha, tool.grip, tool.motion);
  const Vector3d force = gripFelt(surface, alpha, tissue, tool);
  tool.estimate = heldForce(surface, alpha, tissue, tool).norm();
  if (std::min(force.norm(), tool.settings.forceMax) > tool.settings.gripForceMax) {
    letSlip(tool.grip);
    tool.isLeaving = false;
    return false;
  }
  record(force, tool, state);
  tool.proxy.felt.setZero();  // what is felt after the release does not begin where this grip began
  tool.proxy.drag.setZero();
  tool.proxy.device = tool.device.position;
  return true;
}

// First-order lags, exact for any duration of a tick.
static void steady(double tickDuration, ToolState& state) {
  constexpr double kLag = 0.02;  // s
  const double share = 1 - std::exp(-tickDuration / kLag);
  state.steadyForce += share * (state.force - state.steadyForce);
  state.grasp += share * ((state.holding ? 1 : 0) - state.grasp);
}

static void tickTool(const Buckets& buckets, double alphaBefore, double alpha, double tickDuration,
                     const ToolSample& input, ServoTool& tool, ToolState& state) {
  const BlendedSurface& surface = buckets.surface();
  const ToolSample before = tool.device;
  const Vector3d way = input.position - before.position;
  state.energy += state.force.dot(way);  // the device holds a tick's force until the next (Hannaford and Ryu 2002)
  tool.device = input;
  tool.motion.velocity = way / tickDuration;
  followSurface(buckets, alphaBefore, alpha, tool.proxy);
  // Jaws that close, or are closed when a run begins, hold what the tool meets in this very tick, too. Later they hold
  // nothing: closed jaws that come upon tissue push it.
  const bool closes = !tool.grip.closed && input.grip > kGripCloses;
  if (closes && !tool.proxy.inContact())
    followDevice(buckets, alpha, tool.settings, tool.device.position, tickDuration, tool.proxy);
  tickGrip(surface, alpha, state.force, before, tickDuration, tool);
  if (feelGrip(surface, alpha, tool, state)) return;
  tool.motion.velocity = way / tickDuration;  // of what has slipped out it was another
  const Vector3d carried = tool.proxy.centre;
  followDevice(buckets, alpha, tool.settings, tool.device.position, tickDuration, tool.proxy);
  followLeaving(buckets, alphaBefore, alpha, tool);
  record(contactForce(surface, alpha, way, tool), tool, state);
  const double slid = tangential(tool.proxy.centre - carried, tool.lastFelt).norm();
  addToPatch(std::max(way.norm(), slid), tool);
}

void Servo::tick(double alpha, const std::vector<ToolSample>& inputs) {
  assert(inputs.size() == data_->tools.size() && alpha > 0 && alpha <= 1 && alpha >= data_->alpha);
  for (std::size_t k = 0; k < inputs.size(); ++k) checkSample(inputs[k], k);
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    tickTool(data_->surfaces.reading(), data_->alpha, alpha, data_->tickDuration, inputs[k], data_->tools[k],
             data_->states[k]);
    steady(data_->tickDuration, data_->states[k]);
  }
  data_->alpha = alpha;
}

// From what the frame that ended was felt like. Of a contact, along its normal.
static void learnError(const BlendedSurface& surface, ServoTool& tool) {
  if (surface.toolForce[0].empty()) return;
  Vector3d gave = -surface.toolForce[0][tool.index];
  if (tool.grip.held.empty()) gave = std::max(0.0, gave.dot(tool.lastFelt)) * tool.lastFelt;
  const int framesLate = std::min(1, int(std::lround(surface.toolForceAge - kToolForceAge)));
  learnMotionError(gave, tool.ticks, framesLate, surface.duration, tool.motion.error);
}

static void startFrame(const BlendedSurface& surface, double tickDuration, ServoTool& tool) {
  const double way = (tool.device.position - tool.deviceAtFrameStart.position).norm();
  fadePatch(surface, 0, tool.proxy, tool.settings.radius, way, tool.ticks * tickDuration, tool.patch);
  tool.deviceAtFrameStart = tool.device;
  tool.holdBegan.reset();
  tool.deviceSum.setZero();
  const bool holds = !tool.grip.held.empty();
  Vector3d lag = tool.pathEnd ? Vector3d(tool.device.position - *tool.pathEnd) : Vector3d::Zero();
  if (!holds) lag = tool.isLeaving ? Vector3d(tool.lastFelt.dot(lag) * tool.lastFelt) : Vector3d::Zero();
  startFrame(lag, surface.duration, tool.motion);
  learnError(surface, tool);
  const auto& given = surface.toolForce;
  const Vector3d change = given[0].empty() ? Vector3d::Zero() : Vector3d(given[0][tool.index] - given[1][tool.index]);
  if (holds)
    learnFollowing(surface, tool.grip, tool.motion);
  else if (tool.isLeaving)
    learnFollowing(surface, touchedContacts(tool), tool.lastFelt, tool.settings.stiffness,
                   tool.estimate > tool.settings.forceMax ? 0 : std::abs(tool.lastFelt.dot(change)), tool.motion);
  tool.pathEnd.reset();
  tool.change = {change.norm(), tool.change[0]};
  tool.ticks = 0;
}

bool Servo::beginFrame() {
  if (!data_->surfaces.take()) return false;
  data_->alpha = 0;
  for (ServoTool& tool : data_->tools) startFrame(data_->surfaces.reading().surface(), data_->tickDuration, tool);
  return true;
}

// ---- Dynamics' side --------------------------------------------------------------------------------------

void Servo::commit(const DynamicsFrame& from, const DynamicsFrame& to, const std::vector<ToolState>& tools,
                   const std::vector<Vector3d>* toolImpulse, int framesLate) {
  constexpr double kTravel = 0.02;  // m that a tool moves in a frame at 1 m/s and 50 Hz
  if (toolImpulse != nullptr) {
    auto& [last, before] = data_->toolForce;
    const bool isFirst = last.empty();
    before = last;
    last.assign(data_->tools.size(), Vector3d::Zero());
    for (std::size_t k = 0; k < toolImpulse->size(); ++k) last[k] = (*toolImpulse)[k] / (to.time - from.time);
    if (isFirst) before = last;  // a tool may start in contact
  } else {
    data_->toolForce = {};
  }
  Buckets& buckets = data_->surfaces.writing();
  buckets.commit(from, to, data_->steps, data_->toolForce, kToolForceAge + framesLate);
  data_->steps = buckets.surface().steps;
  for (const ToolState& tool : tools) buckets.refitNear(tool.proxy, (tool.device - tool.proxy).norm() + kTravel);
  data_->surfaces.publish();
}

// ---- Handing over ----------------------------------------------------------------------------------------

void Servo::handOver(double frameDuration, Loads& out) {
  assert(frameDuration > 0);
  out.toolSprings.clear();
  out.heldNodes.clear();
  for (ServoTool& tool : data_->tools)
    handOverTool(data_->surfaces.reading().surface(), data_->alpha, frameDuration, data_->tickDuration, tool,
                 data_->contacts, out);
}

void Servo::makeRoom(Loads& out) const {
  out.toolSprings.reserve(data_->tools.size() * kContactPatchCapacity);
  out.heldNodes.reserve(data_->tools.size() * data_->surfaces.reading().surface().from.size());
}

// ---- Life ------------------------------------------------------------------------------------------------

static ServoTool makeTool(const Buckets& buckets, const ToolSettings& settings, int index, const ToolSample& start) {
  ServoTool tool;
  tool.index = index;
  tool.settings = settings;
  tool.device = start;
  tool.proxy = placeProxy(buckets, start.position, settings.radius);
  constexpr double kStandsStill = 1e-6 / 3e-3;  // of the tool's radius
  tool.motion.least = kStandsStill * settings.radius * kStandsStill * settings.radius;
  tool.grip.held.reserve(buckets.surface().from.size());
  tool.patch.entries.reserve(kContactPatchCapacity);
  startFrame(buckets.surface(), 0, tool);
  return tool;
}

static TripleBuffer<Buckets> makeSurfaces(const std::vector<TouchableBody>& bodies,
                                          const std::vector<ToolSettings>& tools, const DynamicsFrame& rest,
                                          const EmbreeSettings& embree) {
  double largestRadius = 0;
  for (std::size_t k = 0; k < tools.size(); ++k) {
    checkSettings(tools[k], k);
    largestRadius = std::max(largestRadius, tools[k].radius);
  }
  const auto make = [&] { return Buckets(bodies, largestRadius, rest, embree); };
  return TripleBuffer<Buckets>({make(), make(), make()});
}

Servo::Servo(const std::vector<TouchableBody>& bodies, const std::vector<ToolSettings>& tools, double tickDuration,
             const DynamicsFrame& rest, const std::vector<ToolSample>& start, const EmbreeSettings& embree)
    : data_(new Data{makeSurfaces(bodies, tools, rest, embree), {}, {}, tickDuration, 0, {}, {}, {}}) {
  assert(tools.size() == start.size() && tickDuration > 0);
  const Buckets& buckets = data_->surfaces.reading();
  data_->steps = buckets.surface().steps;
  data_->contacts.reserve(kContactPatchCapacity);
  data_->tools.reserve(tools.size());
  data_->states.reserve(tools.size());
  for (std::size_t k = 0; k < tools.size(); ++k) {
    checkSample(start[k], k);
    data_->tools.push_back(makeTool(buckets, tools[k], int(k), start[k]));
    ToolState state;
    state.device = start[k].position;
    state.proxy = data_->tools.back().proxy.centre;
    data_->states.push_back(state);
  }
}
Servo::~Servo() = default;

const std::vector<ToolState>& Servo::tools() const {
  return data_->states;
}

}  // namespace medulla
