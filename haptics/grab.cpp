#include "haptics/grab.h"

#include <algorithm>
#include <cassert>

namespace medulla {

// m/N: what all yields beyond the tool's own spring, where every node's part of that pulls at what the node gives:
// 1 / k + give = 1 / sum of 1 / (1 / (k share) + own). Less than what they give together, for between them the edges do
// not hold.
static double heldGive(const BlendedSurface& surface, const Grip& grip, double stiffness) {
  double sum = 0;
  bool gives = false;
  for (const HeldOffset& held : grip.held) {
    const double own = surface.give[held.node].own;
    sum += held.share / (1 + stiffness * held.share * own);
    gives = gives || own > 0;
  }
  return gives ? std::max(0.0, (1 / sum - 1) / stiffness) : 0;
}

// How firmly a node is held, 0 to 1, by its distance from the contact point (m) and the point's weight of it. With one
// radius for all or nothing, a contact a micrometre elsewhere, or a slower dynamics, held a node more or less: the pull
// of a coarse mesh was another by a third.
static double firmness(double distance, double gripRadius, double weight) {
  constexpr double kRim = 0.25;  // of the radius, to either side
  return std::max(weight, std::clamp((1 + kRim - distance / gripRadius) / (2 * kRim), 0.0, 1.0));
}

static void holdPatch(const BlendedSurface& surface, double alpha, const ProxyContact& contact,
                      const ToolSample& device, const ToolSettings& tool, Grip& grip) {
  const std::array<int, 3>& touched = surface.triangles[contact.triangle];
  double sum = 0;
  const int body = surface.bodyOfNode[touched[0]];
  const Eigen::Quaterniond toolFromWorld = device.worldFromTool.conjugate();
  for (int n = surface.firstNode[body]; n < int(surface.from.size()) && surface.bodyOfNode[n] == body; ++n) {
    const Eigen::Vector3d x = surface.node(n, alpha);
    const auto corner = std::find(touched.begin(), touched.end(), n);
    const double weight = corner != touched.end() ? contact.weights[corner - touched.begin()] : 0;
    const double firm = firmness((x - contact.point).norm(), tool.gripRadius, weight);
    if (!(firm > 0)) continue;
    assert(grip.held.size() < grip.held.capacity());
    grip.held.push_back({n, toolFromWorld * (x - device.position), firm});
    sum += firm;
  }
  for (HeldOffset& held : grip.held) held.share /= sum;
  grip.give = heldGive(surface, grip, tool.stiffness);
}

void updateGrip(const BlendedSurface& surface, double alpha, const ProxyContact* contact, const ToolSample& device,
                const ToolSettings& tool, Grip& grip) {
  const bool closes = device.grip > kGripCloses;
  if (closes == grip.closed) return;
  grip.closed = closes;
  grip.slipped = false;
  grip.held.clear();
  if (closes && contact != nullptr) holdPatch(surface, alpha, *contact, device, tool, grip);
}

}  // namespace medulla
