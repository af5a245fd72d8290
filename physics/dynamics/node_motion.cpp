#include "physics/dynamics/node_motion.h"

#include <Eigen/Geometry>

#include "physics/dynamics/anchor_row.h"
#include "physics/dynamics/identified_stages.h"

namespace medulla {

using Eigen::Vector3d;

Vector3d nodePosition(const WorldData& d, int node) {
  if (!isSkin(d, node)) return vectorAt(d.nodes.position, node);
  if (d.identified.ofNodeGroup[node / 4] >= 0) return positionOnFrames(d, node);
  const GroupHost host = d.nodes.groupHosts[node / 4];
  const NodeGroup& group = d.nodes.groups[node / 4];
  const Anchor anchor =
      host.onLink ? anchorOnLink(linkHost(d, host.host), group) : anchorOnSphere(sphereHost(d, host.host), group);
  return vectorOf(positionOf(anchor), node % 4);
}

HostPoint hostPoint(const WorldData& d, int node) {
  HostPoint p;
  if (!isSkin(d, node)) return p;
  if (d.identified.ofNodeGroup[node / 4] >= 0) return hostPointOnFrames(d, node);
  const GroupHost host = d.nodes.groupHosts[node / 4];
  const NodeGroup& group = d.nodes.groups[node / 4];
  if (!host.onLink) {
    const Vector3d offset = vectorOf(anchorOnSphere(sphereHost(d, host.host), group).offset, node % 4);
    p.count = 1;
    p.spheres[0] = host.host;
    p.force[0].setIdentity();
    for (int k = 0; k < 3; ++k) p.torque[0].col(k) = offset.cross(Vector3d::Unit(k));
    return p;
  }
  const OneLink one = oneLink(d, host.host);
  const Lanes3 offset = anchorOnLink(one.host, group).offset;
  p.count = 2;
  p.spheres = {one.sphere0, one.sphere1};
  for (int k = 0; k < 3; ++k) {
    const AnchorRow row = anchorRow(one, group, offset, unit(k));
    for (int i = 0; i < 3; ++i) {
      for (int end = 0; end < 2; ++end) {
        p.force[end](i, k) = row.c[6 * end + i][node % 4];
        p.torque[end](i, k) = row.c[6 * end + 3 + i][node % 4];
      }
    }
  }
  return p;
}

}  // namespace medulla
