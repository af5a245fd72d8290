#include <Eigen/Geometry>
#include <algorithm>
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
  HostFrame own;
  const SkinTermState* states;
};

SeenHost see(const Identified& s, const SkinHost& host) {
  thread_local std::vector<SkinTermState> room;  // kept: tools ask in every substep
  room.resize(host.endTerms - host.firstTerms);
  const HostFrame own = seeFrames<false>(s, host, room.data());
  return {own, room.data()};
}

void add(HostPoint& p, const CarriedFrame& frame, const Matrix3d& force, const Matrix3d& torque) {
  if (frame.sphere < 0) return;
  const auto known = std::find(p.spheres.begin(), p.spheres.begin() + p.count, frame.sphere);
  const auto k = known - p.spheres.begin();
  if (k == p.count) {
    ++p.count;
    p.spheres[k] = frame.sphere;
    p.force[k].setZero();
    p.torque[k].setZero();
  }
  p.force[k] += force;
  p.torque[k] += torque + crossMatrix(vectorOf(frame.worldArm)) * force;
}

Matrix3d matrixOf(const Rotation& r) {
  Matrix3d out;
  out << vectorOf(r.x, 0), vectorOf(r.y, 0), vectorOf(r.z, 0);
  return out;
}

Matrix3d transposed(const float (*columns)[4], int lane) {
  Matrix3d out;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) out(j, i) = columns[3 * j + i][lane];
  return out;
}

// Columns: as torqueOnFrame() of skin_map.h.
Matrix3d torqueOnFrame(const SkinTermState& at, int lane, const Matrix3d& onTurn) {
  return at.cosine[lane] * onTurn + 0.5 * crossMatrix(vectorOf(at.turn, lane)) * onTurn;
}

}  // namespace

Vector3d positionOnFrames(const WorldData& d, int node) {
  const Identified& s = d.identified;
  const SkinGroup& g = s.skin[s.ofNodeGroup[node / 4]];
  const SeenHost seen = see(s, s.hosts[g.host]);
  const SkinPlace place = placeSkin<false>(s, g, seen.states);
  return vectorOf(seen.own.position + rotate(seen.own.rotation, place.offset), node % 4);
}

// The transpose of the rates in skin_map.h for one node, column by column of its force.
HostPoint hostPointOnFrames(const WorldData& d, int node) {
  const Identified& s = d.identified;
  const SkinGroup& g = s.skin[s.ofNodeGroup[node / 4]];
  const SkinHost& host = s.hosts[g.host];
  const SeenHost seen = see(s, host);
  const int lane = node % 4;
  const SkinPlace place = placeSkin<false>(s, g, seen.states);
  const Matrix3d r = matrixOf(seen.own.rotation);
  const Vector3d turn = vectorOf(place.turn, lane), lever = vectorOf(g.lever, lane);
  // Of the second order by the turn of the node's own frame: (s.P) / 2 + s P^T / 2 - P s^T; transposed.
  const Matrix3d second =
      0.5 * turn.dot(lever) * Matrix3d::Identity() + 0.5 * lever * turn.transpose() - turn * lever.transpose();
  HostPoint p;
  Matrix3d force = r.transpose(), moment = crossMatrix(vectorOf(place.offset, lane)) * r.transpose();
  const auto give = [&](int term, const Matrix3d& onWay, const Matrix3d& onTurn) {
    const SkinTermState& at = seen.states[term / 4];
    const Matrix3d f = onWay * r.transpose(), torque = torqueOnFrame(at, term % 4, onTurn * r.transpose());
    force -= f;
    moment -= torque + crossMatrix(vectorOf(at.place, term % 4)) * f;
    add(p, s.carried[frameOf(s, host, term)], r * f, r * torque);
  };
  give(0, Matrix3d::Zero(), transposed(g.homeTurn, lane) + static_cast<double>(g.homeWeight[lane]) * second);
  for (int k = g.firstShare; k < g.endShare; ++k) {
    const SkinShare& share = s.shares[k];
    Matrix3d onWay = transposed(share.map, lane);
    const Matrix3d onTurn = transposed(share.map + 9, lane);
    if (onWay.isZero(0) && onTurn.isZero(0) && share.weight[lane] == 0) continue;  // another node's
    const int t = share.term / 4, l = share.term % 4;
    const Vector3d axis = vectorOf(s.terms[host.firstTerms + t].axis, l);
    const double along = share.along[lane];
    onWay += vectorOf(seen.states[t].spareRow, l) * (along * axis - onWay.transpose() * axis).transpose();
    give(share.term, onWay, onTurn + static_cast<double>(share.weight[lane]) * second);
  }
  add(p, s.carried[host.home], r * force, Matrix3d::Zero());
  for (int term = 0; term < host.turnShares; ++term) {
    const double share = s.terms[host.firstTerms + term / 4].share[term % 4] * seen.own.inverseLength[0];
    const Matrix3d torque = torqueOnFrame(seen.states[term / 4], term % 4, share * moment);
    add(p, s.carried[frameOf(s, host, term)], Matrix3d::Zero(), r * torque);
  }
  return p;
}

}  // namespace medulla
