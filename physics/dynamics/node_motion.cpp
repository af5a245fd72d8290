#include "physics/dynamics/node_motion.h"

#include "physics/dynamics/anchor_row.h"

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
  const OneLink one = oneLink(d, link);
  const NodeGroup& group = d.nodes.groups[node / 4];
  const Lanes3 offset = anchorOnLink(one.host, group).offset;
  LinkPoint p{one.sphere0, one.sphere1, {}};
  for (int k = 0; k < 3; ++k) {
    const AnchorRow row = anchorRow(one, group, offset, unit(k));
    for (int i = 0; i < 12; ++i) p.loads(i, k) = row.c[i][node % 4];
  }
  return p;
}

Vector3d sphereOffset(const WorldData& d, int sphere, int node) {
  return vectorOf(anchorOnSphere(sphereHost(d, sphere), d.nodes.groups[node / 4]).offset, node % 4);
}

Vector3d velocityOf(const LinkPoint& p, const SphereMotion& of0, const SphereMotion& of1) {
  Eigen::Matrix<double, 12, 1> motion;
  motion << of0.linear, of0.angular, of1.linear, of1.angular;
  return p.loads.transpose() * motion;
}

std::array<SphereMotion, 2> loadsOf(const LinkPoint& p, const Vector3d& force) {
  const Eigen::Matrix<double, 12, 1> loads = p.loads * force;
  return {SphereMotion{loads.segment<3>(0), loads.segment<3>(3)},
          SphereMotion{loads.segment<3>(6), loads.segment<3>(9)}};
}

}  // namespace medulla
