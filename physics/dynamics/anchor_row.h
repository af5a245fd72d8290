#pragma once

#include "physics/dynamics/anchor.h"
#include "physics/dynamics/link_frame.h"

// The anchors of a link's nodes as a matrix on the motion of its two spheres, row by row.
namespace medulla {

// One link, the same in all lanes: of group and frame what sphereLoads() needs.
struct OneLink {
  int sphere0, sphere1;
  LinkGroup group;
  LinkFrame frame;
  LinkHost host;
};

inline OneLink oneLink(const WorldData& d, int link) {
  const LinkGroup& g = d.links.groups[link / 4];
  const LinkFrame& f = d.links.frames[link / 4];
  const int lane = link % 4;
  OneLink out;
  out.sphere0 = static_cast<int>(g.sphere0[lane]);
  out.sphere1 = static_cast<int>(g.sphere1[lane]);
  out.host = linkHost(d, link);
  out.group.beam = splat(g.beam[lane]);
  out.group.hasBeams = out.host.isBeam;
  out.group.widest = splat(g.widest[lane]);
  for (Lanes3 LinkFrame::*member :
       {&LinkFrame::n, &LinkFrame::line, &LinkFrame::axisU, &LinkFrame::axisV, &LinkFrame::arm0, &LinkFrame::arm1,
        &LinkFrame::t0, &LinkFrame::t1, &LinkFrame::bow, &LinkFrame::spinAxis0, &LinkFrame::spinAxis1,
        &LinkFrame::spinLever0, &LinkFrame::spinLever1})
    put(splatLane(f.*member, lane), out.frame.*member);
  out.frame.inverseLength = splat(f.inverseLength[lane]);
  for (Lanes LinkFrame::*member : {&LinkFrame::thickness, &LinkFrame::thicknessSlope, &LinkFrame::curveU,
                                   &LinkFrame::curveV, &LinkFrame::curveEase})
    out.frame.*member = splat((f.*member)[lane]);
  return out;
}

struct AnchorRow {
  Lanes c[12];  // velocity and angular velocity of sphere 0, then of sphere 1
};

inline Lanes3 unit(int k) {
  const Lanes zero = splat(0), one = splat(1);
  return {k == 0 ? one : zero, k == 1 ? one : zero, k == 2 ? one : zero};
}

// How fast the anchors of four nodes move in one direction, per motion of the spheres; and what a force of 1 N on one
// of them in that direction does to the spheres.
inline AnchorRow anchorRow(const OneLink& link, const NodeGroup& g, const Lanes3& offset, const Lanes3& direction) {
  AnchorLoads loads = noLoads();
  addLoads(link.host, g, offset, direction, cross(offset, direction), loads);
  const EndLoads e = sphereLoads(link.group, link.frame, loads);
  return {{e.force0.x, e.force0.y, e.force0.z, e.torque0.x, e.torque0.y, e.torque0.z, e.force1.x, e.force1.y,
           e.force1.z, e.torque1.x, e.torque1.y, e.torque1.z}};
}

}  // namespace medulla
