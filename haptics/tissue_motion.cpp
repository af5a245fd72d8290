#include "haptics/tissue_motion.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "haptics/force_bounds.h"

namespace medulla {

using Eigen::Vector3d;

void startFrame(const Vector3d& lag, double duration, DeviceMotion& device) {
  constexpr double kMemory = 0.1;  // s; a half or two and a half times as long feels the same within a few per cent
  const double kept = std::exp(-duration / kMemory);
  auto& swung = device.swung;
  for (double* sum : {&device.seen.stepChange, &device.seen.wayChange, &device.seen.forceLength, &device.seen.length,
                      &swung.frames, &swung.square, &swung.product})
    *sum *= kept;
  swung.last *= kept;
  swung.both *= kept;
  device.way[0] -= lag;
  std::rotate(device.way.begin(), device.way.end() - 1, device.way.end());
  device.way[0] = lag;
  std::rotate(device.wayAcross.begin(), device.wayAcross.end() - 1, device.wayAcross.end());
  device.wayAcross[0].setZero();
  device.sinceBefore = device.since;
  device.earlyBefore = device.early;
  device.since = 0;
  ++device.frames;
  device.early.setZero();
}

namespace {

// The part of its way by which a tool of this stiffness (N/m) takes along what gives so much (m/N).
double followedPart(double stiffness, double give) {
  return stiffness * give / (1 + stiffness * give);
}

// m, within the duration of a frame up to now; the way of the frame before was an even one up to where the device's own
// began, and from there on.
Vector3d latestWay(const DeviceMotion& device, double alpha) {
  const double late = alpha < 1 ? std::min(1.0, (1 - alpha) / (1 - device.sinceBefore)) : 0;
  const double early = device.sinceBefore > alpha ? 1 - alpha / device.sinceBefore : 0;
  return device.way[0] + late * (device.way[1] - device.earlyBefore) + early * device.earlyBefore;
}

// m: the next step at alpha, drift apart, of the `last` three, the newest first.
Vector3d nextStep(const std::array<DeviceMotion::Swing, 2>& swing, double alpha, const Vector3d* last) {
  return blendPoint(swing[1].turn * last[1] - last[2], swing[0].turn * last[0] - last[1], alpha);
}

// m: what BlendedSurface::nodeStep() and the steps of nextStep(), of the same frames in the same way, answer.
Vector3d wayOfStep(const DeviceMotion& device, double alpha) {
  return blendPoint(device.way[2], device.way[1], alpha);
}
Vector3d wayOfLead(const DeviceMotion& device, double alpha) {
  return nextStep(device.swing, alpha, &device.way[1]);
}

Vector3d meanOver(const BlendedSurface& surface, const ProxyContact& contact, const std::vector<Vector3d>& ofNodes) {
  const auto& [a, b, c] = surface.triangles[contact.triangle];
  return contact.weights.x() * ofNodes[a] + contact.weights.y() * ofNodes[b] + contact.weights.z() * ofNodes[c];
}

// m/N, mean over the contacts: what each yields to its share of a push.
double contactGive(const BlendedSurface& surface, std::span<const ProxyContact> contacts) {
  double sum = 0, carried = 0, shares = 0;
  for (const ProxyContact& contact : contacts) {
    double own = 0;
    for (int k = 0; k < 3; ++k) {
      const NodeGive& give = surface.give[surface.triangles[contact.triangle][k]];
      own += contact.weights[k] * contact.weights[k] * give.own;
      carried += contact.share * contact.weights[k] * give.carried;
    }
    sum += contact.share * contact.share * own;
    shares += contact.share;
  }
  return shares > 0 ? sum / (shares * shares) + carried / shares : 0;
}

// m, of the point that is touched, within a frame at its present velocity.
Vector3d contactStep(const BlendedSurface& surface, double alpha, const ProxyContact& contact) {
  return blendPoint(meanOver(surface, contact, surface.steps[1]), meanOver(surface, contact, surface.steps[0]), alpha);
}

// m, mean over contacts by their shares.
template <class Of>
Vector3d meanOverShares(std::span<const ProxyContact> contacts, const Of& of) {
  Vector3d sum = Vector3d::Zero();
  double shares = 0;
  for (const ProxyContact& contact : contacts) {
    sum += contact.share * of(contact);
    shares += contact.share;
  }
  return sum / shares;
}

Vector3d heldStep(const BlendedSurface& surface, const Grip& grip, int framesAgo) {
  return meanOverHeld(grip, [&](const HeldOffset& held) { return surface.steps[framesAgo][held.node]; });
}

// The newest first.
std::array<Vector3d, 3> heldSteps(const BlendedSurface& surface, const Grip& grip) {
  return {heldStep(surface, grip, 0), heldStep(surface, grip, 1), heldStep(surface, grip, 2)};
}

// What gives so much may resist half as much again: a slab of 20 kPa did with 800 N/m where its give says 520, and a
// stiff tool that left it lagged behind by 13 ms. But what is pushed starts late, and looks stiff at first: a free ball
// that is poked has gone by the fourth frame.
double leastPart(const DeviceMotion& device) {
  constexpr int kUnsure = 3;  // frames
  constexpr double kStiffer = 1.5;
  const double part = device.followsAtOnce;
  return device.frames <= kUnsure ? part : part / (part + kStiffer * (1 - part));
}

double partSeen(const DeviceMotion& device) {
  constexpr double kSafe = 1.5;  // forces follow the ways late; at 1, strokes of a live run give 4 mJ
  const auto& seen = device.seen;
  const double bySteps = (seen.stepChange + device.least * device.followsAtOnce) / (seen.wayChange + device.least);
  const double byForce =
      1 - kSafe * (seen.forceLength + device.least * (1 - device.followsAtOnce)) / (seen.length + device.least);
  return std::clamp(std::max(bySteps, byForce), leastPart(device), 1.0);
}

// `change`, m: by how much the step up to the surface's `to` differs from the one before.
void seeStep(const Vector3d& change, DeviceMotion& device) {
  const Vector3d way = device.way[1] - device.way[2];
  device.seen.stepChange += change.dot(way);
  device.seen.wayChange += way.squaredNorm();
}

// `last`, m: the steps up to the surface's `to`, the newest first. What the device's ways make of them is no swing;
// while these change much, what is left is mostly that the part that follows is not known so well, and no swing is
// learnt of it: a free ball that was sped up at 20 Hz felt a fifth too heavy.
void seeSwing(const std::array<Vector3d, 3>& last, DeviceMotion& device) {
  constexpr double kUnknown = 0.1;  // of the squared changes of ways
  const auto own = [&](int k) -> Vector3d { return last[k] - device.follows[0] * device.way[k + 1]; };
  const Vector3d both = own(0) + own(2);
  auto& sums = device.swung;
  sums.frames += 1;
  sums.square += own(1).squaredNorm();
  sums.product += own(1).dot(both);
  sums.last += own(1);
  sums.both += both;
  const double square = std::max(0.0, sums.square - sums.last.squaredNorm() / sums.frames),
               product = sums.product - sums.last.dot(sums.both) / sums.frames,
               turn = std::clamp((product + 2 * device.least) / (square + device.least), -2.0, 2.0);
  const double known = square / (square + kUnknown * device.seen.wayChange + device.least);
  const Vector3d drift = known / sums.frames * (sums.both - turn * sums.last);
  device.swing = {{{2 + known * (turn - 2), drift}, device.swing[0]}};
}

double followsNow(const DeviceMotion& device, double alpha) {
  return (1 - alpha) * device.follows[1] + alpha * device.follows[0];
}

// m, over the last `frames`, as the sum over them of `size` of the way and of the frames that it took.
template <class Size>
double wayOver(double frames, double alpha, const std::array<Vector3d, 4>& ways, const Size& size) {
  double sum = 0;
  for (std::size_t k = 0; frames > 0 && k < ways.size(); ++k) {
    const double within = std::min(frames, k == 0 ? alpha : 1.0);
    sum += size(k == 0 ? ways[k] : Vector3d(within * ways[k]), within);
    frames -= within;
  }
  return sum;
}

}  // namespace

void beginContact(const BlendedSurface& surface, double alpha, const ProxyContact& contact, const Vector3d& normal,
                  double stiffness, DeviceMotion& device) {
  device = {.least = device.least,
            .velocity = device.velocity,
            .since = alpha,
            .followsAtOnce = followedPart(stiffness, contactGive(surface, {&contact, 1})),
            .seen = device.seen};
  const double part = partSeen(device);
  device.follows = {part, part};
  if (!(part > 0)) return;
  for (int k = 0; k < 3; ++k)
    device.way[k + 1] = normal.dot(meanOver(surface, contact, surface.steps[k])) / part * normal;
  device.way[0] = device.early = wayOfStep(device, alpha) - (1 - alpha) * device.way[1];
}

void beginHold(const BlendedSurface& surface, double alpha, const Grip& grip, double stiffness, DeviceMotion& device) {
  const double part = followedPart(stiffness, grip.give);
  device = {.least = device.least, .velocity = device.velocity, .followsAtOnce = part, .follows = {part, part}};
  if (!(part > 0)) return;
  for (int k = 0; k < 3; ++k) device.way[k + 1] = heldStep(surface, grip, k) / part;
  device.way[0] = wayOfLead(device, alpha) - (1 - alpha) * device.way[1];
}

// Of a frame towards whose end it was touched, tissue that already moves shows its own motion more than any answer.
constexpr double kMostMissed = 0.5;

void learnFollowing(const BlendedSurface& surface, std::span<const ProxyContact> contacts, const Vector3d& normal,
                    double stiffness, double forceChange, DeviceMotion& device) {
  const auto stepOf = [&](int framesAgo) {
    return meanOverShares(contacts,
                          [&](const ProxyContact& c) { return meanOver(surface, c, surface.steps[framesAgo]); });
  };
  const Vector3d last = stepOf(0), before = stepOf(1);
  const bool tells = device.sinceBefore < kMostMissed;
  if (tells) seeStep(last - before, device);
  if (tells && forceChange > 0) {  // between two frames' means, which lie half of each frame's way apart
    const auto half = [&](const Vector3d& sum) { return 0.5 * std::abs(normal.dot(sum)); };
    const double length = std::max(half(device.way[1] + device.way[2]), half(last + before));
    device.seen.forceLength += forceChange / stiffness * length;
    device.seen.length += length * length;
  }
  device.followsAtOnce = followedPart(stiffness, contactGive(surface, contacts));
  device.follows = {partSeen(device), device.follows[0]};
}

void learnFollowing(const BlendedSurface& surface, const Grip& grip, DeviceMotion& device) {
  const std::array<Vector3d, 3> last = heldSteps(surface, grip);
  seeStep(last[0] - last[1], device);
  device.follows = {partSeen(device), device.follows[0]};
  seeSwing(last, device);
}

TissueMotion contactMotion(const BlendedSurface& surface, double alpha, std::span<const ProxyContact> contacts,
                           const Vector3d& normal, const DeviceMotion& device) {
  assert(!contacts.empty());
  if (!(surface.duration > 0)) return {};
  const Vector3d step =
      meanOverShares(contacts, [&](const ProxyContact& contact) { return contactStep(surface, alpha, contact); });
  const double part = followsNow(device, alpha);
  const Vector3d answered = wayOfStep(device, alpha);
  const Vector3d beyond = latestWay(device, alpha) - answered, faster = device.velocity - answered / surface.duration;
  return {step + part * normal.dot(beyond) * normal, step / surface.duration + part * normal.dot(faster) * normal, step,
          part};
}

double pushSince(const BlendedSurface& surface, double alpha, const TissueMotion& tissue, const Vector3d& normal,
                 const ToolSettings& tool, const DeviceMotion& device) {
  const auto along = [&](const Vector3d& v) { return std::abs(normal.dot(v)); };
  const double way =
      wayOver(surface.toolForceAge, alpha, device.way, [&](const Vector3d& v, double) { return along(v); });
  const double longer = std::max(way, surface.toolForceAge * along(tissue.step));
  return (1 - tissue.followed) * (tool.stiffness * longer + tool.damping * along(device.velocity));
}

double dragSince(const BlendedSurface& surface, double alpha, const TissueMotion& tissue, const Vector3d& normal,
                 const ToolSettings& tool, const DeviceMotion& device) {
  const Vector3d step = tangential(tissue.step, normal),
                 slip = tangential(device.velocity, normal) - step / surface.duration;
  const double off = wayOver(surface.toolForceAge, alpha, device.wayAcross,
                             [&](const Vector3d& v, double frames) { return (v - frames * step).norm(); });
  return tool.stiffness * off + tool.damping * slip.norm();
}

double heldSince(const BlendedSurface& surface, double alpha, const TissueMotion& tissue, double changePerFrame,
                 const ToolSettings& tool, const DeviceMotion& device) {
  const double way =
      wayOver(surface.toolForceAge, alpha, device.way, [](const Vector3d& v, double) { return v.norm(); });
  const double longer = std::max(way, surface.toolForceAge * tissue.step.norm());
  return 2 * surface.toolForceAge * changePerFrame +
         (1 - tissue.followed) * (tool.stiffness * longer + tool.damping * device.velocity.norm());
}

WayAndChange recentWays(const DeviceMotion& device, double alpha) {
  WayAndChange ways;
  ways.col(0) = latestWay(device, alpha);
  ways.col(1) = ways.col(0) - wayOfStep(device, alpha);
  return ways;
}

TissueMotion heldMotion(const BlendedSurface& surface, double alpha, const Grip& grip, const DeviceMotion& device) {
  if (!(surface.duration > 0)) return {};
  const double part = followsNow(device, alpha);
  const Vector3d beyond = latestWay(device, alpha) - wayOfLead(device, alpha);
  const Vector3d faster = device.velocity - wayOfStep(device, alpha) / surface.duration;
  const std::array<Vector3d, 3> last = heldSteps(surface, grip);
  const Vector3d lead =
      blendPoint(device.swing[1].drift, device.swing[0].drift, alpha) + nextStep(device.swing, alpha, last.data());
  const Vector3d step = meanOverHeld(grip, [&](const HeldOffset& h) { return surface.nodeStep(h.node, alpha); });
  return {lead + part * beyond, step / surface.duration + part * faster, step, part};
}

}  // namespace medulla
