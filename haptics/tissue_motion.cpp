#include "haptics/tissue_motion.h"

#include <algorithm>
#include <cassert>

namespace medulla {

using Eigen::Vector3d;

void beginWay(double alpha, DeviceMotion& device) {
  device.way.fill(Vector3d::Zero());
  device.since = alpha;
  device.sinceBefore = 0;
}

void startFrame(DeviceMotion& device) {
  std::rotate(device.way.begin(), device.way.end() - 1, device.way.end());
  device.way[0].setZero();
  device.sinceBefore = device.since;
  device.since = 0;
}

namespace {

// The part of its way by which a tool of this stiffness (N/m) takes along what gives so much (m/N).
double followedPart(double stiffness, double give) {
  return stiffness * give / (1 + stiffness * give);
}

// m, within the duration of a frame up to now; the way of the frame before was an even one from where it began.
Vector3d latestWay(const DeviceMotion& device, double alpha) {
  return device.way[0] + std::min(1.0, (1 - alpha) / (1 - device.sinceBefore)) * device.way[1];
}

// m: what BlendedSurface::nodeStep() and nodeLead(), of the same frames in the same way, answer.
Vector3d wayOfStep(const DeviceMotion& device, double alpha) {
  return blendPoint(device.way[2], device.way[1], alpha);
}
Vector3d wayOfLead(const DeviceMotion& device, double alpha) {
  return blendPoint(2 * device.way[2] - device.way[3], 2 * device.way[1] - device.way[2], alpha);
}

// m/N, mean over the contacts: what each yields to its share of a push.
double giveOf(const BlendedSurface& surface, std::span<const ProxyContact> contacts) {
  double sum = 0, shares = 0;
  for (const ProxyContact& contact : contacts) {
    double own = 0;
    for (int k = 0; k < 3; ++k)
      own += contact.weights[k] * contact.weights[k] * surface.give[surface.triangles[contact.triangle][k]];
    sum += contact.share * contact.share * own;
    shares += contact.share;
  }
  return shares > 0 ? sum / (shares * shares) : 0;
}

// m/N: of springs side by side. Less than what they give together, for between them the edges do not hold.
double giveOf(const BlendedSurface& surface, const Grip& grip) {
  double stiffness = 0;
  for (const HeldOffset& held : grip.held) {
    if (!(surface.give[held.node] > 0)) return 0;
    stiffness += 1 / surface.give[held.node];
  }
  return 1 / stiffness;
}

}  // namespace

Vector3d contactStep(const BlendedSurface& surface, double alpha, const ProxyContact& contact) {
  const auto& [a, b, c] = surface.triangles[contact.triangle];
  return contact.weights.x() * surface.nodeStep(a, alpha) + contact.weights.y() * surface.nodeStep(b, alpha) +
         contact.weights.z() * surface.nodeStep(c, alpha);
}

TissueMotion contactMotion(const BlendedSurface& surface, double alpha, std::span<const ProxyContact> contacts,
                           const Vector3d& normal, double stiffness, const DeviceMotion& device) {
  assert(!contacts.empty());
  if (!(surface.duration > 0)) return {};
  Vector3d step = Vector3d::Zero();
  double shares = 0;
  for (const ProxyContact& contact : contacts) {
    step += contact.share * contactStep(surface, alpha, contact);
    shares += contact.share;
  }
  step /= shares;
  const double part = followedPart(stiffness, giveOf(surface, contacts));
  const Vector3d answered = wayOfStep(device, alpha);
  const Vector3d beyond = latestWay(device, alpha) - answered, faster = device.velocity - answered / surface.duration;
  return {step + part * normal.dot(beyond) * normal, step / surface.duration + part * normal.dot(faster) * normal};
}

TissueMotion heldMotion(const BlendedSurface& surface, double alpha, const Grip& grip, double stiffness,
                        const DeviceMotion& device) {
  if (!(surface.duration > 0)) return {};
  const double part = followedPart(stiffness, giveOf(surface, grip));
  const Vector3d beyond = latestWay(device, alpha) - wayOfLead(device, alpha);
  const Vector3d faster = device.velocity - wayOfStep(device, alpha) / surface.duration;
  return {meanHeldLead(surface, alpha, grip) + part * beyond,
          meanHeldStep(surface, alpha, grip) / surface.duration + part * faster};
}

}  // namespace medulla
