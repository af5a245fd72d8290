#include <Eigen/Geometry>
#include <algorithm>

#include "physics/dynamics/edge_springs.h"
#include "physics/dynamics/identified_stages.h"
#include "physics/dynamics/skin_map.h"
#include "physics/dynamics/stages.h"

// The surface of bodies with identified links: its nodes hang on up to six frames each.
namespace medulla {

namespace {

int hostOf(const WorldData& d, int group) {
  return d.identified.skin[d.identified.ofNodeGroup[group]].host;
}

SkinTermState* statesOf(Identified& s, const SkinHost& host) {
  return s.termStates.data() + host.firstTerms;
}

}  // namespace

void pullOnFrames(WorldData& d, const HostRange& range) {
  Nodes& n = d.nodes;
  Identified& s = d.identified;
  const SkinHost& host = s.hosts[hostOf(d, range.firstGroup)];
  const HostFrame own = seeFrames<true>(s, host, statesOf(s, host));
  const NodeGroup* constants = constantsOf(n, range);
  const Lanes relaxation = splat(range.relaxation);
  Lanes volume = splat(0);
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const int skin = s.ofNodeGroup[g];
    const SkinPlace place = placeSkin<true>(s, s.skin[skin], statesOf(s, host));
    put(place.turn, s.turns[skin]);
    const NodeGroup& group = constants[g];
    const Lanes3 offset = rotate(own.rotation, place.offset), area = rotate(own.rotation, group.restArea);
    const Lanes3 lever = n.position[g] - own.position, displaced = lever - offset;
    const Lanes3 rate = own.velocity + cross(own.omega, lever) + rotate(own.rotation, place.offsetRate) - n.velocity[g];
    const Lanes lifted = dot(displaced, area), lifting = dot(rate, area), excess = s.skin[skin].normalExcess;
    volume = volume + lifted;
    const Lanes3 pull = fnma(group.stiffness, displaced, (group.stiffness * relaxation) * rate);
    put(fma(excess * fma(relaxation, lifting, splat(0) - lifted), area, pull), n.force[g]);
    put(offset, n.offset[g]);
    put(area, n.area[g]);
    storeFour(displaced, n.displaced, 4 * g);
  }
  n.swollen[range.part] = sumOfLanes(volume);
}

// Springs pull along what nodes are displaced by, edges act at the nodes' places; all else acts at the nodes, and home
// bears the difference.
void returnToFrames(WorldData& d, const HostRange& range, Lanes pressure) {
  Nodes& n = d.nodes;
  FrameReturn back(d, range);
  const EdgePull edgePull(d, range);
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const Lanes3 displaced = gatherFour(n.displaced, 4 * g);
    const Lanes3 edges = edgePull.at(g, displaced);
    const Lanes3 own = fnma(pressure, n.area[g], n.force[g]), force = own + edges;
    put(force, n.force[g]);
    const Lanes minus = splat(-1);
    back.add(g, minus * force, minus * cross(displaced, own));
  }
  back.finish();
}

void placeOnFrames(WorldData& d, const HostRange& range) {
  Nodes& n = d.nodes;
  Identified& s = d.identified;
  const SkinHost& host = s.hosts[hostOf(d, range.firstGroup)];
  const HostFrame own = seeFrames<true>(s, host, statesOf(s, host));
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const SkinPlace place = placeSkin<true>(s, s.skin[s.ofNodeGroup[g]], statesOf(s, host));
    const Lanes3 offset = rotate(own.rotation, place.offset);
    put(place.turn, s.turns[s.ofNodeGroup[g]]);
    put(offset, n.offset[g]);
    put(own.position + offset + gatherFour(n.displaced, 4 * g), n.position[g]);
    const Lanes3 velocity = own.velocity + cross(own.omega, offset) + rotate(own.rotation, place.offsetRate);
    put(velocity, n.velocity[g]);
    put(rotate(own.rotation, n.groups[g].restArea), n.area[g]);
  }
}

void placeSkinOnFrames(WorldData& d, const HostRange& range) {
  Identified& s = d.identified;
  const SkinHost& host = s.hosts[hostOf(d, range.firstGroup)];
  const HostFrame own = seeFrames<false>(s, host, statesOf(s, host));
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const SkinPlace place = placeSkin<false>(s, s.skin[s.ofNodeGroup[g]], statesOf(s, host));
    put(own.position + rotate(own.rotation, place.offset), d.nodes.position[g]);
  }
}

FrameReturn::FrameReturn(WorldData& d, const HostRange& range)
    : d_(&d), host_(&d.identified.hosts[hostOf(d, range.firstGroup)]) {
  own_ = hostFrame(d.identified, *host_);
  force_ = moment_ = zeroVectors();
  std::fill_n(d.identified.termLoads.begin(), 4 * (host_->endTerms - host_->firstTerms), SkinTermLoad{});
}

void FrameReturn::add(int g, const Lanes3& force, const Lanes3& moment) {
  Identified& s = d_->identified;
  const int skin = s.ofNodeGroup[g];
  const Lanes3 f = rotateBack(own_.rotation, force);
  put(force_ + f, force_);
  put(moment_ + rotateBack(own_.rotation, moment + cross(d_->nodes.offset[g], force)), moment_);
  giveToTerms(s, s.skin[skin], s.turns[skin], f, s.termLoads.data());
}

void FrameReturn::finish() {
  Identified& s = d_->identified;
  giveToFrames(s, *host_, own_, statesOf(s, *host_), s.termLoads.data(), force_, moment_,
               [&](const std::uint32_t* frames, const Lanes3& force, const Lanes3& torque) {
                 addFour(force, s.loads.data(), frames, &FrameLoad::force);
                 addFour(torque, s.loads.data(), frames, &FrameLoad::torque);
               });
}

double normalEnergy(const WorldData& d, int node) {
  const int skin = d.identified.ofNodeGroup[node / 4];
  if (skin < 0) return 0;
  const double lifted = vectorAt(d.nodes.area, node).dot(vectorOf(d.nodes.displaced[node]));
  return 0.5 * d.identified.skin[skin].normalExcess[node % 4] * lifted * lifted;
}

}  // namespace medulla
