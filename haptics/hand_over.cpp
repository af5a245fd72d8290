#include "haptics/hand_over.h"

#include <algorithm>

#include "haptics/force_bounds.h"

namespace medulla {

using Eigen::Vector3d;

namespace {
// A straight path over the frame that ended with the last tick.
struct Path {
  Vector3d end, velocity;
};
// What one contact gets: of the tool's stiffness and damping, of forceMax, how much deeper its anchor lies (m), and the
// coupling's pull across the common push (m). `steadying` (N s/m) adds to the tool's damping, against the surface's own
// velocity.
struct Part {
  double stiffness = 1, forceMax = 1, deeper = 0;
  Vector3d across = Vector3d::Zero();
  double steadying = 0;
  Vector3d surfaceVelocity = Vector3d::Zero();
};
}  // namespace

// The device's path, with the frame's mean rather than its end kept: the dynamics then feels the same mean
// pull that the hand felt, however the device moved within the frame. Ticks stand at dt, 2 dt .. T, their mean time is
// T/2 + dt/2, so the path's end lies (T - dt)/2 later than their mean. What a grip took hold of within the frame is led
// from where the device was then: from where it had come from, tissue would be drawn back against the hand's motion.
static Path devicePath(const ServoTool& tool, double frameDuration, double tickDuration) {
  if (tool.ticks == 0) return {tool.device.position, Vector3d::Zero()};
  if (tool.holdBegan && !tool.grip.held.empty())
    return {tool.device.position, (tool.device.position - tool.holdBegan->position) / frameDuration};
  const Vector3d velocity = (tool.device.position - tool.deviceAtFrameStart.position) / (tool.ticks * tickDuration);
  return {tool.deviceSum / tool.ticks + 0.5 * (frameDuration - tickDuration) * velocity, velocity};
}

// m: by how much the point has come off the proxy
static double comeOff(const Proxy& proxy, const ProxyContact& contact) {
  return (proxy.centre - contact.point).norm() - proxy.radius;
}

// A contact's spring, anchored so that stiffness (anchor - x) is the force of the coupling, k (device - proxy), when x
// is the contact point: anchor = device + (contact point - proxy). Its tangential part is limited to what friction
// carries; where the contact slips the spring slides.
static void handOverContact(const BlendedSurface& surface, const ServoTool& tool, const Path& path,
                            const ProxyContact& contact, const Part& part, Loads& out) {
  const ToolSettings& settings = tool.settings;
  const Proxy& proxy = tool.proxy;
  // Of the coupling along the normal; < 0: pushes.
  const double stretch = contact.normal.dot(path.end - proxy.centre) + comeOff(proxy, contact) - part.deeper;
  Vector3d drag = tangential(part.across, contact.normal);
  const double limit = settings.staticFriction * std::max(0.0, -stretch);
  if (drag.norm() > limit) drag *= limit / drag.norm();
  if (tool.sticks) drag += tangential(tool.leadWhereItStuck, contact.normal);
  const auto& nodes = surface.triangles[contact.triangle];
  const int body = surface.bodyOfNode[nodes[0]], first = surface.firstNode[body];
  ToolSpring& spring = out.toolSprings.emplace_back();
  spring.tool = tool.index;
  spring.body = body;
  spring.nodes = {nodes[0] - first, nodes[1] - first, nodes[2] - first};
  spring.weights = {contact.weights.x(), contact.weights.y(), contact.weights.z()};
  spring.anchor = contact.point + stretch * contact.normal + drag;
  spring.anchorVelocity = path.velocity;
  spring.outward = contact.normal;
  spring.stiffness = settings.stiffness * part.stiffness;
  spring.damping = (settings.damping + part.steadying) * part.stiffness;
  if (part.steadying > 0)
    spring.drift = part.steadying / (settings.damping + part.steadying) * (part.surfaceVelocity - path.velocity);
  spring.slides = proxy.slipping;
  spring.forceMax = settings.forceMax * part.forceMax;
  spring.friction = proxy.slipping ? settings.dynamicFriction : settings.staticFriction;
}

// What the tool has slid away from no longer pushes in full; the rest of the patch pushes so much more. In the late
// surface a tool that withdraws lies shallower than it does: `deeper`, m, is what is missing of how deep it is felt.
// Without it, all that a dent is uneven by seemed slid away from, and a limp organ was held three times as hard for a
// frame.
static double makeUpFor(const Proxy& proxy, const Path& path, const Vector3d& deeper,
                        const std::vector<ProxyContact>& contacts) {
  constexpr double kMost = 3, kTouching = 1e-7 / 3e-3;  // of the radius: twice what the proxy stands off
  if (!proxy.inContact()) return 1;
  double wanted = 0, left = 0;
  for (const ProxyContact& contact : contacts) {
    const double depth = contact.normal.dot(proxy.centre - path.end + deeper);
    wanted += contact.share * std::max(0.0, depth);
    left +=
        contact.share * std::max(0.0, depth - std::max(0.0, comeOff(proxy, contact) - kTouching * proxy.toolRadius));
  }
  if (wanted > kMost * left) return kMost;
  return wanted > left ? wanted / left : 1;
}

constexpr int kFrames = 3;

// N s/m. Contacts are handed over once per frame, and a spring that is renewed after T gives back more than it took,
// unless a damper of kT / 2 and more takes that (Colgate and Schenkel 1997): README, what the dynamics gets. Slack at
// the velocity that the surface had over the last kFrames, it leaves alone what moves steadily against the tool. It
// would make a free body heavier that the tool sets in motion: it is for a tool that is still, gone where the device
// moves by kStill of the depth that is felt in a frame, starts once all kFrames lie within that time, and grows over
// kSettled. With kT a tool deep in a liver came to rest within seconds, with 2 kT at once or after seconds of swinging
// by newtons, as the least change had it.
static double steadying(ServoTool& tool, const Path& path, double frameDuration) {
  constexpr double kDampers = 2, kStill = 0.01;
  constexpr double kSettled = 0.2;  // s
  const double still = kStill * tool.push / tool.settings.stiffness, moved = path.velocity.norm() * frameDuration;
  tool.stillFor = still > moved ? tool.stillFor + frameDuration : 0;
  const double since = tool.stillFor - kFrames * frameDuration;
  if (!(since > 0)) return 0;
  return kDampers * tool.settings.stiffness * frameDuration * std::min(1.0, since / kSettled) * (1 - moved / still);
}

// m/s, of the surface at the contact, mean over kFrames.
static Vector3d surfaceVelocity(const BlendedSurface& surface, const ProxyContact& contact, double frameDuration) {
  static_assert(kFrames == std::tuple_size_v<decltype(BlendedSurface::steps)>);
  Vector3d sum = Vector3d::Zero();
  for (const std::vector<Vector3d>& step : surface.steps)
    for (int i = 0; i < 3; ++i) sum += contact.weights[i] * step[surface.triangles[contact.triangle][i]];
  return sum / (kFrames * frameDuration);
}

// Several contacts stand oblique to the direction p of their common push (a groove, a dimple). The force on the proxy
// is the sum of lambda_i n_i with lambda_i in the ratio of the shares s_i, and must be k D p: lambda_i = k D s_i / C
// with C = sum_j s_j c_j and c_i = n_i . p. Spring i is compressed by D c_i only, so its stiffness is k s_i / (c_i C);
// k s_i alone would lose cos^2 of the groove's angle. In a narrow wedge that has no bound, and would ask for ever
// smaller substeps: there a spring is as stiff as with cosines b_i = max(c_i, leastCosine), k s_i / (b_i B) with
// B = sum_j s_j b_j, and its anchor lies lambda_i / k_i - D c_i = D (b_i B / C - c_i) deeper, so that it starts with
// the same force. Softer springs alone gave the tissue a third of what the hand felt, at rest and at any rate.
// Each is limited to its part of forceMax in the ratio of the pressures, s_i / C.
static void handOverContacts(const BlendedSurface& surface, double alpha, double frameDuration, ServoTool& tool,
                             const Path& path, std::vector<ProxyContact>& contacts, Loads& out) {
  patchContacts(surface, alpha, tool.proxy, tool.settings.radius, tool.patch, contacts);
  Vector3d push = Vector3d::Zero();
  for (const ProxyContact& contact : contacts) push += contact.share * contact.normal;
  constexpr double leastCosine = 0.5, leastSum = 0.05;  // opposite walls push with no more than 20 times the whole
  const double sum = std::max(leastSum, push.norm());
  push.normalize();
  const auto cosine = [&](const ProxyContact& contact) { return std::max(leastCosine, contact.normal.dot(push)); };
  double boundedSum = 0, whole = 0;
  for (const ProxyContact& contact : contacts) boundedSum += contact.share * cosine(contact);
  for (const ProxyContact& contact : contacts) whole += contact.share / (cosine(contact) * boundedSum);
  const Vector3d pull = path.end - tool.proxy.centre - tool.proxy.shading, across = tangential(pull, push) / whole;
  const double depth = std::max(0.0, push.dot(tool.proxy.centre - path.end));
  const double missing = std::max(0.0, tool.push / tool.settings.stiffness - depth);
  const double stiffer = makeUpFor(tool.proxy, path, missing * push, contacts);
  const double damper = steadying(tool, path, frameDuration);
  for (const ProxyContact& contact : contacts) {
    const double bounded = cosine(contact) * boundedSum;
    handOverContact(
        surface, tool, path, contact,
        {stiffer * contact.share / bounded, contact.share / sum, depth * (bounded / sum - contact.normal.dot(push)),
         across, damper, damper > 0 ? surfaceVelocity(surface, contact, frameDuration) : Vector3d(path.velocity)},
        out);
  }
  if (contacts.empty() && tool.isLeaving) handOverContact(surface, tool, path, tool.left[0], {.across = pull}, out);
}

// Every held node pulled to where the tool wants it, by its share of the tool's stiffness: pulling is as stiff as
// pushing. That share of forceMax, too: in the ratio of the late surface's forces, the limits would be springs that
// answer a frame late, and let a patch held by a stiff tool ring.
static void handOverGrip(const BlendedSurface& surface, const ServoTool& tool, const Path& path, double frameDuration,
                         Loads& out) {
  const int body = surface.bodyOfNode[tool.grip.held.front().node];
  ToolSample end = tool.device, start = tool.holdBegan.value_or(tool.deviceAtFrameStart);
  end.position = path.end;
  start.position = path.end - frameDuration * path.velocity;
  for (const HeldOffset& held : tool.grip.held) {
    const Vector3d target = heldTarget(end, held);
    HeldNode& node = out.heldNodes.emplace_back();
    node.tool = tool.index;
    node.body = body;
    node.node = held.node - surface.firstNode[body];
    node.anchor = target;
    node.anchorVelocity = (target - heldTarget(start, held)) / frameDuration;
    node.stiffness = tool.settings.stiffness * held.share;
    node.damping = tool.settings.damping * held.share;
    node.forceMax = tool.settings.forceMax * held.share;
  }
}

void handOverTool(const BlendedSurface& surface, double alpha, double frameDuration, double tickDuration,
                  ServoTool& tool, std::vector<ProxyContact>& scratch, Loads& out) {
  const Path path = devicePath(tool, frameDuration, tickDuration);
  tool.pathEnd = path.end;
  if (!tool.grip.held.empty()) {
    tool.stillFor = 0;
    handOverGrip(surface, tool, path, frameDuration, out);
  } else {
    handOverContacts(surface, alpha, frameDuration, tool, path, scratch, out);
  }
}

}  // namespace medulla
