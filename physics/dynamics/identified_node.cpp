#include <Eigen/Geometry>
#include <vector>

#include "physics/dynamics/identified_stages.h"
#include "physics/dynamics/skin_map.h"
#include "physics/model/cross_matrix.h"

// Single nodes on frames: those that carry loads.
namespace medulla {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

// A host's frames as they are, without a world to write to; up to the thread's next call.
struct SeenHost {
  HomeFrame home;
  const SkinTermState* states;
};

SeenHost see(const Identified& s, const SkinHost& host) {
  thread_local std::vector<SkinTermState> room;  // kept: tools ask in every substep
  room.resize(host.endTerms - host.firstTerms);
  const SeenHost out{homeFrame(s, host), room.data()};
  seeFrames<false>(s, host, out.home, room.data());
  return out;
}

void add(HostPoint& p, const CarriedFrame& frame, const Matrix3d& force, const Matrix3d& torque) {
  if (frame.sphere < 0) return;
  p.spheres[p.count] = frame.sphere;
  p.force[p.count] = force;
  p.torque[p.count] = torque + crossMatrix(vectorOf(frame.worldArm)) * force;
  ++p.count;
}

}  // namespace

Vector3d positionOnFrames(const WorldData& d, int node) {
  const Identified& s = d.identified;
  const SkinGroup& g = s.skin[s.ofNodeGroup[node / 4]];
  const SeenHost seen = see(s, s.hosts[g.host]);
  const SkinPlace place = placeSkin<false>(s, g, seen.states);
  return vectorOf(seen.home.position + rotate(seen.home.rotation, place.offset), node % 4);
}

// The transpose of the rates in skin_map.h for one node, column by column of its force.
HostPoint hostPointOnFrames(const WorldData& d, int node) {
  const Identified& s = d.identified;
  const SkinGroup& g = s.skin[s.ofNodeGroup[node / 4]];
  const SkinHost& host = s.hosts[g.host];
  const SeenHost seen = see(s, host);
  const int lane = node % 4;
  const SkinPlace place = placeSkin<false>(s, g, seen.states);
  const Matrix3d r = quaternionOf(s.frames[host.home].orientation).toRotationMatrix();
  const Vector3d turn = vectorOf(place.turn, lane), lever = vectorOf(g.lever, lane);
  // Of the second order by the turn of the node's own frame: (s.P) / 2 + s P^T / 2 - P s^T.
  const Matrix3d second =
      0.5 * turn.dot(lever) * Matrix3d::Identity() + 0.5 * turn * lever.transpose() - lever * turn.transpose();
  HostPoint p;
  Matrix3d force = r.transpose(), moment = crossMatrix(vectorOf(place.offset, lane)) * r.transpose();
  for (int k = g.firstShare; k < g.endShare; ++k) {
    const SkinShare& share = s.shares[k];
    Matrix3d onWay, onTurn;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        onWay(j, i) = share.map[3 * j + i][lane];
        onTurn(j, i) = share.map[9 + 3 * j + i][lane];
      }
    }
    if (onWay.isZero(0) && onTurn.isZero(0) && share.weight[lane] == 0) continue;  // another node's
    onTurn += static_cast<double>(share.weight[lane]) * second.transpose();
    const SkinTermState& at = seen.states[share.term / 4];
    const SkinTerms& term = s.terms[host.firstTerms + share.term / 4];
    const int l = share.term % 4;
    const Vector3d axis = vectorOf(term.axis, l);
    const double along = share.along[lane];
    onWay += at.spareSlope[l] * axis * (along * axis - onWay.transpose() * axis).transpose();
    const Matrix3d f = onWay * r.transpose(), t = onTurn * r.transpose();
    const Matrix3d torque = at.cosine[l] * t + 0.5 * crossMatrix(vectorOf(at.turn, l)) * t;
    force -= f;
    moment -= torque + crossMatrix(vectorOf(at.place, l)) * f;
    add(p, s.carried[term.frame[l]], r * f, r * torque);
  }
  add(p, s.carried[host.home], r * force, r * moment);
  return p;
}

}  // namespace medulla
