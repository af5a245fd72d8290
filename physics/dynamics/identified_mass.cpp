#include <Eigen/Geometry>
#include <algorithm>
#include <map>

#include "physics/dynamics/implicit_stages.h"
#include "physics/dynamics/pair_numbers.h"
#include "physics/dynamics/skin_map.h"
#include "physics/model/cross_matrix.h"

// What the spheres of an identified body feel of the nodes' masses, J^T m J, between all frames of a node. Seen in the
// host's frame (skin_map.h) a node's velocity is, but for the second order, what stretch thins, and how that frame
// turns while frames are turned against each other,
//   v + omega x offset + sum map_k (v_k - v - omega x place_k, omega_k - omega),
// with maps that never change. So the sum over a host's nodes is taken once, in the motions of home and of the frames
// against it; where the frames are by now enters with their places. Node by node it took longer than all else of a
// step.
namespace medulla {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Rows3x6 = Eigen::Matrix<double, 3, 6>;

// m X, where X is the motion of what `arm` carries: (v, omega) -> (v + omega x arm, omega).
Block6 timesLever(const Block6& m, const Vector3d& arm) {
  Block6 out = m;
  for (int j = 0; j < 3; ++j) {
    const int next = (j + 1) % 3, last = (j + 2) % 3;
    const Six with = fma(splat(-arm[last]), loadSix(m.col(next).data()), loadSix(m.col(3 + j).data()));
    storeSix(out.col(3 + j).data(), fma(splat(arm[next]), loadSix(m.col(last).data()), with));
  }
  return out;
}

// m with each three columns times R^T.
Block6 timesTurn(const Block6& m, const Matrix3d& r) {
  Block6 out;
  for (int j = 0; j < 6; ++j) {
    const int first = j - j % 3;
    Six sum = splatSix(0);
    for (int i = 0; i < 3; ++i) sum = fma(splat(r(j % 3, i)), loadSix(m.col(first + i).data()), sum);
    storeSix(out.col(j).data(), sum);
  }
  return out;
}

// Of one node: by home's motion, and by those of other frames against it.
struct NodeMap {
  int term;  // -1: home
  Rows3x6 map;
};

std::vector<NodeMap> mapsOf(const Identified& s, const SkinGroup& g, int lane) {
  NodeMap home{-1, {}};
  home.map << Matrix3d::Identity(), -crossMatrix(vectorOf(g.restOffset, lane));
  std::vector<NodeMap> out{home};
  for (int k = g.firstShare; k < g.endShare; ++k) {
    NodeMap of{s.shares[k].term, {}};
    for (int e = 0; e < 18; ++e) of.map(e % 3, e / 3) = s.shares[k].map[e][lane];
    if (!of.map.isZero(0)) out.push_back(of);
  }
  return out;
}

// kg, in the host's frame.
Matrix3d massOf(const WorldData& d, const ImplicitData& s, int node) {
  const Vector3d area = vectorOf(d.nodes.groups[node / 4].restArea, node % 4);
  return s.carriedMass[node] * Matrix3d::Identity() + s.carriedNormal[node] * area * area.transpose();
}

void layOutHost(const WorldData& d, const HostRange& range, PairNumbers& pairs, ImplicitData& s) {
  const Identified& identified = d.identified;
  const int number = identified.skin[identified.ofNodeGroup[range.firstGroup]].host;
  const SkinHost& host = identified.hosts[number];
  std::map<std::array<int, 2>, Block6> sums;  // by the places of two terms, the lower first
  for (int i = 4 * range.firstGroup; i < 4 * range.endGroup; ++i) {
    if (s.carriedMass[i] == 0) continue;
    const std::vector<NodeMap> maps = mapsOf(identified, identified.skin[identified.ofNodeGroup[i / 4]], i % 4);
    const Matrix3d mass = massOf(d, s, i);
    for (const NodeMap& a : maps) {
      for (const NodeMap& b : maps) {
        if (a.term > b.term) continue;
        Block6& sum = sums.try_emplace({a.term, b.term}, Block6::Zero()).first->second;
        sum += a.map.transpose() * mass * b.map;
      }
    }
  }
  const auto sphereOf = [&](int term) {
    const int frame = term < 0 ? host.home : frameOf(identified, host, term);
    return identified.carried[frame].sphere;
  };
  CarriedHost out{number, static_cast<int>(s.carriedBlocks.size()), 0};
  for (const auto& [terms, sum] : sums) {
    const int a = sphereOf(terms[0]), b = sphereOf(terms[1]);
    const int pair = a >= 0 && b >= 0 && a != b ? pairs.of(a, b) : 0;
    s.carriedBlocks.push_back({terms[0], terms[1], a, b, pair, sum});
  }
  out.end = static_cast<int>(s.carriedBlocks.size());
  s.carriedHosts.push_back(out);
  s.homeColumn.resize(std::max<std::size_t>(s.homeColumn.size(), 1 + 4 * (host.endTerms - host.firstTerms)));
}

// The host's frames as they stand, seen in its own.
class PlacedFrames {
 public:
  PlacedFrames(const Identified& s, const SkinHost& host) : s_(&s), host_(&host) {
    const Rotation r = hostFrame(s, host).rotation;
    rotation_ << vectorOf(r.x, 0), vectorOf(r.y, 0), vectorOf(r.z, 0);
  }
  Vector3d place(int term) const { return vectorOf(s_->termStates[host_->firstTerms + term / 4].place, term % 4); }
  // Block of the spheres' own motions, in the world's frame.
  Block6 ofSpheres(const CarriedBlock& b, const Block6& ofFrames) const {
    const Block6 right = timesTurn(timesLever(ofFrames, arm(b.term1)), rotation_).transpose();
    return timesTurn(timesLever(right, arm(b.term0)), rotation_).transpose();
  }

 private:
  Vector3d arm(int term) const {
    const int frame = term < 0 ? host_->home : frameOf(*s_, *host_, term);
    return rotation_.transpose() * vectorOf(s_->carried[frame].worldArm);
  }

  const Identified* s_;
  const SkinHost* host_;
  Matrix3d rotation_;
};

void give(const PlacedFrames& frames, const CarriedBlock& b, const Block6& ofFrames, ImplicitData& s) {
  if (b.sphere0 < 0 || b.sphere1 < 0) return;
  const Block6 m = frames.ofSpheres(b, ofFrames);
  if (b.sphere0 == b.sphere1)
    s.lumped[b.sphere0] += m;
  else if (b.pair >= 0)
    s.lumpedBeside[b.pair] += m;
  else
    s.lumpedBeside[-1 - b.pair] += m.transpose();
}

}  // namespace

void layOutMassOnFrames(const WorldData& d, ImplicitData& s) {
  PairNumbers pairs(s.pairs);
  for (const HostRange& range : d.nodes.onSpheres)
    if (range.onFrames) layOutHost(d, range, pairs, s);
}

// With B the constant sums and X_k the levers of the places: between frames j and k B_jk, home's column
//   C_k = B_k0 - sum B_kj X_j,   and of home itself B_00 - sum B_0j X_j - sum C_k^T X_k.
void addMassOnFrames(const WorldData& d, ImplicitData& s) {
  for (const CarriedHost& h : s.carriedHosts) {
    const PlacedFrames frames(d.identified, d.identified.hosts[h.host]);
    Block6* column = s.homeColumn.data() + 1;  // by term, home before the first
    std::fill(s.homeColumn.begin(), s.homeColumn.end(), Block6::Zero());
    for (int k = h.first; k < h.end; ++k) {
      const CarriedBlock& b = s.carriedBlocks[k];
      if (b.term0 < 0) {
        column[b.term1] += b.mass.transpose();
      } else {
        column[b.term1] -= timesLever(b.mass.transpose(), frames.place(b.term0));
        give(frames, b, b.mass, s);
      }
      if (b.term0 != b.term1) column[b.term0] -= timesLever(b.mass, frames.place(b.term1));
    }
    for (int k = h.end - 1; k >= h.first; --k) {  // home's own block, the first, last
      const CarriedBlock& b = s.carriedBlocks[k];
      if (b.term0 >= 0) continue;
      const Block6 beside = column[b.term1].transpose();
      give(frames, b, beside, s);
      if (b.term1 >= 0) column[-1] -= timesLever(beside, frames.place(b.term1));
    }
  }
}

}  // namespace medulla
