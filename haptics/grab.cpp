#include "haptics/grab.h"

#include <algorithm>
#include <cassert>

namespace medulla {

// Of springs side by side. Less than what they give together, for between them the edges do not hold.
static double heldGive(const BlendedSurface& surface, const Grip& grip) {
  double stiffness = 0;
  for (const HeldOffset& held : grip.held) {
    if (!(surface.give[held.node].own > 0)) return 0;
    stiffness += 1 / surface.give[held.node].own;
  }
  return 1 / stiffness;
}

static void holdPatch(const BlendedSurface& surface, double alpha, const ProxyContact& contact,
                      const ToolSample& device, double gripRadius, Grip& grip) {
  const std::array<int, 3>& touched = surface.triangles[contact.triangle];
  const int body = surface.bodyOfNode[touched[0]];
  const Eigen::Quaterniond toolFromWorld = device.worldFromTool.conjugate();
  for (int n = surface.firstNode[body]; n < int(surface.from.size()) && surface.bodyOfNode[n] == body; ++n) {
    const Eigen::Vector3d x = surface.node(n, alpha);
    const bool isTouched = std::find(touched.begin(), touched.end(), n) != touched.end();
    if (!isTouched && (x - contact.point).norm() > gripRadius) continue;
    assert(grip.held.size() < grip.held.capacity());
    grip.held.push_back({n, toolFromWorld * (x - device.position)});
  }
  grip.give = heldGive(surface, grip);
}

void updateGrip(const BlendedSurface& surface, double alpha, const ProxyContact* contact, const ToolSample& device,
                double gripRadius, Grip& grip) {
  const bool closes = device.grip > kGripCloses;
  if (closes == grip.closed) return;
  grip.closed = closes;
  grip.slipped = false;
  grip.held.clear();
  if (closes && contact != nullptr) holdPatch(surface, alpha, *contact, device, gripRadius, grip);
}

}  // namespace medulla
