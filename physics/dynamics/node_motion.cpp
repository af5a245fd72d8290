#include "physics/dynamics/node_motion.h"

#include <Eigen/Geometry>

#include "physics/dynamics/anchor.h"

namespace medulla {

using Eigen::Vector3d;

Vector3d nodePosition(const WorldData& d, int node) {
  if (!isSkin(d, node)) return vectorAt(d.nodes.position, node);
  const GroupHost host = d.nodes.groupHosts[node / 4];
  const NodeGroup& group = d.nodes.groups[node / 4];
  const Anchor anchor =
      host.onLink ? anchorOnLink(linkHost(d, host.host), group) : anchorOnSphere(sphereHost(d, host.host), group);
  return vectorOf(positionOf(anchor), node % 4);
}

LinkPoint linkPoint(const WorldData& d, int link, int node) {
  const LinkFrame& f = d.links.frames[link / 4];
  const LinkGroup& g = d.links.groups[link / 4];
  const NodeGroup& group = d.nodes.groups[node / 4];
  const int l = link % 4;
  LinkPoint p;
  p.sphere0 = static_cast<int>(g.sphere0[l]);
  p.sphere1 = static_cast<int>(g.sphere1[l]);
  p.s = group.along[node % 4];
  p.twistShare = group.twistShare[node % 4];
  p.inverseLength = f.inverseLength[l];
  p.offset = vectorOf(anchorOnLink(linkHost(d, link), group).offset, node % 4);
  p.n = vectorOf(f.n, l);
  p.axis0 = vectorOf(f.spinAxis0, l);
  p.axis1 = vectorOf(f.spinAxis1, l);
  p.lever0 = vectorOf(f.spinLever0, l);
  p.lever1 = vectorOf(f.spinLever1, l);
  p.thicknessSlope = f.thicknessSlope[l];
  p.arm0 = vectorOf(f.arm0, l);
  p.arm1 = vectorOf(f.arm1, l);
  return p;
}

Vector3d sphereOffset(const WorldData& d, int sphere, int node) {
  return vectorOf(anchorOnSphere(sphereHost(d, sphere), d.nodes.groups[node / 4]).offset, node % 4);
}

Vector3d velocityOf(const LinkPoint& p, const SphereMotion& of0, const SphereMotion& of1) {
  const Vector3d v0 = of0.linear + of0.angular.cross(p.arm0);
  const Vector3d line = of1.linear + of1.angular.cross(p.arm1) - v0;
  const Vector3d nRate = p.inverseLength * (line - p.n * p.n.dot(line));
  const double spin0 = p.axis0.dot(of0.angular) - p.lever0.dot(nRate);
  const double spin1 = p.axis1.dot(of1.angular) - p.lever1.dot(nRate);
  const Vector3d omega = p.n.cross(nRate) + ((1 - p.twistShare) * spin0 + p.twistShare * spin1) * p.n;
  return v0 + p.s * line + omega.cross(p.offset) + p.thicknessSlope * p.n.dot(line) * p.offset;
}

std::array<SphereMotion, 2> loadsOf(const LinkPoint& p, const Vector3d& force) {
  const Vector3d moment = p.offset.cross(force);
  const double twist0 = (1 - p.twistShare) * p.n.dot(moment), twist1 = p.twistShare * p.n.dot(moment);
  const Vector3d along = p.thicknessSlope * p.offset.dot(force) * p.n;
  const Vector3d swing = p.inverseLength * (moment.cross(p.n) - twist0 * p.lever0 - twist1 * p.lever1) + along;
  const Vector3d at0 = (1 - p.s) * force - swing, at1 = p.s * force + swing;
  return {SphereMotion{at0, twist0 * p.axis0 + p.arm0.cross(at0)},
          SphereMotion{at1, twist1 * p.axis1 + p.arm1.cross(at1)}};
}

}  // namespace medulla
