#include "haptics/leaving.h"

#include <algorithm>

#include "haptics/force_bounds.h"

namespace medulla {

using Eigen::Vector3d;

// Of the body that the tool is leaving, the place nearest to it by now.
static ProxyContact contactBelow(const Buckets& buckets, double alpha, const ServoTool& tool) {
  const BlendedSurface& surface = buckets.surface();
  const Vector3d& centre = tool.proxy.centre;
  const int body = surface.bodyOfNode[surface.triangles[tool.left[0].triangle][0]];
  ProxyContact nearest = tool.left[0];
  nearest.point = pointAt(surface.triangle(nearest.triangle, alpha), nearest.weights);
  double distance = (centre - nearest.point).norm();
  for (const int t : buckets.near(centre, tool.settings.radius)) {
    if (surface.bodyOfNode[surface.triangles[t][0]] != body) continue;
    const TrianglePoint closest = closestPoint(surface.triangle(t, alpha), centre);
    const double apart = (centre - closest.point).norm();
    if (!(apart < distance && apart > 0)) continue;
    distance = apart;
    nearest = {t, closest.weights, closest.point, (centre - closest.point) / apart, 1};
  }
  return nearest;
}

// Another body than it touched last is another tissue, of which nothing has been learnt.
static bool touchesBodyOf(const BlendedSurface& surface, const ProxyContact& last, const Proxy& proxy) {
  const auto bodyOf = [&](const ProxyContact& c) { return surface.bodyOfNode[surface.triangles[c.triangle][0]]; };
  const auto touched = proxy.touched();
  return last.triangle >= 0 &&
         std::any_of(touched.begin(), touched.end(), [&](const ProxyContact& c) { return bodyOf(c) == bodyOf(last); });
}

void followLeaving(const Buckets& buckets, double alphaBefore, double alpha, ServoTool& tool) {
  const BlendedSurface& surface = buckets.surface();
  auto& [last, below] = tool.left;
  if (tool.proxy.inContact()) {
    if (!touchesBodyOf(surface, last, tool.proxy)) {
      tool.motion.seen = {};
      tool.isLeaving = false;
    }
    last = below = tool.proxy.mainContact();
    last.share = 1;
    below.share = 0;
    tool.lastFelt = tool.proxy.feltNormal();
    tool.depth = (tool.proxy.centre - tool.device.position).norm();
    if (!tool.isLeaving) {
      tool.largestPush = 0;
      tool.dragged.setZero();
      tool.sticks = false;
      tool.pathEnd.reset();
      beginContact(surface, alphaBefore, last, tool.lastFelt, tool.settings.stiffness, tool.motion);
    }
    tool.isLeaving = true;
  } else if (tool.isLeaving) {
    constexpr double kAside = 0.2;  // of the tool's radius
    last.point = pointAt(surface.triangle(last.triangle, alpha), last.weights);
    below = contactBelow(buckets, alpha, tool);
    const double aside = tangential(tool.proxy.centre - last.point, last.normal).norm();
    below.share = std::min(1.0, aside / (kAside * tool.settings.radius));
    if (below.share == 1) {
      last = below;
      below.share = 0;
    }
    last.share = 1 - below.share;
    tool.isLeaving = (tool.proxy.centre - last.point).norm() <= 2 * tool.settings.radius;
  }
}

void addToPatch(double way, ServoTool& tool) {
  if (!tool.isLeaving) return;
  ProxyContact below = tool.left[1];
  below.share = 1;
  const auto touched = tool.proxy.inContact() ? tool.proxy.touched() : std::span<const ProxyContact>(&below, 1);
  addContacts(touched, tool.settings.radius, tool.depth, way, tool.patch);
  tool.patch.isTouched = true;
}

}  // namespace medulla
