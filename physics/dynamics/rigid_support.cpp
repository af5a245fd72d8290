#include "physics/dynamics/rigid_support.h"

#include <algorithm>

namespace medulla {

namespace {

using Eigen::Vector3d;

struct PlacedPoint {
  SupportPoint point;
  Vector3d place;  // m, model frame, at rest
};

std::vector<PlacedPoint> supportPoints(const BodyDescription& body) {
  std::vector<PlacedPoint> out;
  const auto addSphere = [&](const auto& held) {
    out.push_back({{held.sphere, -1}, body.model->spheres[held.sphere].restFrame});
  };
  std::for_each(body.fixed.begin(), body.fixed.end(), addSphere);
  if (holdsByNodes(body))
    for (const int n : body.fixedNodes) out.push_back({{-1, n}, body.model->restNodes[n]});
  std::for_each(body.driven.begin(), body.driven.end(), addSphere);
  return out;
}

// The sphere that keeps its orientation and leads, or -1.
int turnlessSphere(const BodyDescription& body) {
  for (const FixedSphere& f : body.fixed)
    if (f.freedom == FixedFreedom::all) return f.sphere;
  if (isHeld(body)) return -1;
  for (const DrivenSphere& f : body.driven)
    if (f.freedom == FixedFreedom::all) return f.sphere;
  return -1;
}

}  // namespace

RigidSupport rigidSupport(const BodyDescription& body) {
  const std::vector<PlacedPoint> points = supportPoints(body);
  if (points.empty()) return {};
  RigidSupport out{RigidFreedom::none, points[0].point, {}};
  if (body.links == LinkModel::identified && holdsByNodes(body)) return out;  // patches hold links, turns included
  if (const int sphere = turnlessSphere(body); sphere >= 0) {
    out.point = {sphere, -1};
    return out;
  }
  // Nearer than this to a point or a line is on it: a millionth of the body.
  constexpr double kSamePlace = 1e-6;
  double size = 0;
  for (const Vector3d& node : body.model->restNodes) size = std::max(size, (node - points[0].place).norm());
  const Vector3d from = points[0].place;
  const auto farthest = [&](const auto& distance) {
    return *std::max_element(points.begin(), points.end(), [&](const PlacedPoint& a, const PlacedPoint& b) {
      return distance(a.place) < distance(b.place);
    });
  };
  const auto fromPoint = [&](const Vector3d& x) { return (x - from).norm(); };
  const PlacedPoint second = farthest(fromPoint);
  out.freedom = RigidFreedom::aboutPoint;
  if (fromPoint(second.place) <= kSamePlace * size) return out;
  const Vector3d line = (second.place - from).normalized();
  const auto fromLine = [&](const Vector3d& x) { return (x - from).cross(line).norm(); };
  out.freedom = fromLine(farthest(fromLine).place) <= kSamePlace * size ? RigidFreedom::aboutLine : RigidFreedom::none;
  out.second = second.point;
  return out;
}

std::vector<Vector3d> heldNodes(const BodyDescription& body) {
  std::vector<Vector3d> out;
  if (holdsByNodes(body))
    for (const int n : body.fixedNodes) out.push_back(body.model->restNodes[n]);
  return out;
}

}  // namespace medulla
