#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <tuple>

#include "physics/dynamics/anchor_row.h"
#include "physics/dynamics/loads.h"
#include "physics/dynamics/node_motion.h"
#include "physics/dynamics/skin_map.h"
#include "physics/dynamics/stages.h"

// What the scene prescribes. Nodes with masses take their forces one by one; those of a skin give them to what carries
// them, all of a host at once: node by node, each would look for its host's frames anew.
namespace medulla {

namespace {

using Eigen::Vector3d;

LoadedHost hostOf(const WorldData& d, int group) {
  const int skin = d.identified.ofNodeGroup[group];
  if (skin >= 0) return {LoadedHost::Kind::frames, d.identified.skin[skin].host, 0, 0};
  const GroupHost host = d.nodes.groupHosts[group];
  return {host.onLink ? LoadedHost::Kind::link : LoadedHost::Kind::sphere, host.host, 0, 0};
}

void gatherSkinLoads(WorldData& d) {
  SkinLoads& s = d.skinLoads;
  std::map<int, int> place;  // of a group of nodes; sorted by host, as nodes are
  for (const NodeForce& load : d.deadLoads)
    if (isSkin(d, load.node)) place[load.node / 4] = 0;
  for (auto& [group, number] : place) {
    number = static_cast<int>(s.groups.size());
    s.groups.push_back({group, zeroVectors()});
    LoadedHost host = hostOf(d, group);
    const bool isNew = s.hosts.empty() || s.hosts.back().kind != host.kind || s.hosts.back().host != host.host;
    if (isNew) {
      host.first = number;
      s.hosts.push_back(host);
    }
    s.hosts.back().end = number + 1;
  }
  for (const NodeForce& load : d.deadLoads)
    s.groupOfLoad.push_back(isSkin(d, load.node) ? place.at(load.node / 4) : -1);
}

// N, N m, as quads.
void push(WorldData& d, int sphere, Lanes force, Lanes torque) {
  const SphereGroup& g = d.spheres.groups[sphere / 4];
  const double time = d.keptByDrag * d.substep;
  addTo(d.spheres.velocity[sphere], splat(time * g.inverseMass[sphere % 4]) * force);
  addTo(d.spheres.angularMomentum[sphere], splat(time * g.freeToTurn[sphere % 4]) * torque);
}

void pushFrame(WorldData& d, int frame, Lanes force, Lanes torque) {
  const CarriedFrame& c = d.identified.carried[frame];
  if (c.sphere >= 0) push(d, c.sphere, force, torque + crossProduct(load(c.worldArm), force));
}

void pushFrames(WorldData& d, const LoadedHost& loaded) {
  Identified& s = d.identified;
  const SkinHost& host = s.hosts[loaded.host];
  SkinTermState* states = s.termStates.data() + host.firstTerms;
  const HostFrame own = seeFrames<false>(s, host, states);
  std::fill_n(s.termLoads.begin(), 4 * (host.endTerms - host.firstTerms), SkinTermLoad{});
  Lanes3 sum = zeroVectors(), moment = sum;
  for (int k = loaded.first; k < loaded.end; ++k) {
    const SkinGroup& g = s.skin[s.ofNodeGroup[d.skinLoads.groups[k].group]];
    const SkinPlace place = placeSkin<false>(s, g, states);
    const Lanes3 force = rotateBack(own.rotation, d.skinLoads.groups[k].force);
    sum = sum + force;
    moment = moment + cross(place.offset, force);
    giveToTerms(s, g, place.turn, force, s.termLoads.data());
  }
  const auto give = [&](const std::uint32_t* frames, const Lanes3& force, const Lanes3& torque) {
    Quad forces[4], torques[4];
    storeFour(force, forces, 0);
    storeFour(torque, torques, 0);
    for (int l = 0; l < 4; ++l) pushFrame(d, static_cast<int>(frames[l]), load(forces[l]), load(torques[l]));
  };
  giveToFrames(s, host, own, states, s.termLoads.data(), sum, moment, give);
}

void pushLink(WorldData& d, const LoadedHost& loaded) {
  const OneLink link = oneLink(d, loaded.host);
  AnchorLoads sum = noLoads();
  for (int k = loaded.first; k < loaded.end; ++k) {
    const auto& [group, force] = d.skinLoads.groups[k];
    const Lanes3 offset = anchorOnLink(link.host, d.nodes.groups[group]).offset;
    addLoads(link.host, d.nodes.groups[group], offset, force, cross(offset, force), sum);
  }
  const EndLoads e = sphereLoads(link.group, link.frame, sum);
  push(d, link.sphere0, sumOfLanes(e.force0), sumOfLanes(e.torque0));
  push(d, link.sphere1, sumOfLanes(e.force1), sumOfLanes(e.torque1));
}

void pushSphere(WorldData& d, const LoadedHost& loaded) {
  const SphereHost host = sphereHost(d, loaded.host);
  Lanes3 sum = zeroVectors(), moment = sum;
  for (int k = loaded.first; k < loaded.end; ++k) {
    const auto& [group, force] = d.skinLoads.groups[k];
    sum = sum + force;
    moment = moment + cross(anchorOnSphere(host, d.nodes.groups[group]).offset, force);
  }
  push(d, loaded.host, sumOfLanes(sum), sumOfLanes(moment));
}

void pushSkins(WorldData& d) {
  for (const LoadedHost& host : d.skinLoads.hosts)
    if (host.kind == LoadedHost::Kind::frames)
      pushFrames(d, host);
    else if (host.kind == LoadedHost::Kind::link)
      pushLink(d, host);
    else
      pushSphere(d, host);
}

}  // namespace

std::vector<DeadLoad> spreadLoad(const SoftBodyModel& model, const std::vector<int>& nodes, const DeadLoad& whole) {
  double area = 0;
  for (const int node : nodes) area += model.attachments[node].area;
  std::vector<DeadLoad> out;
  for (const int node : nodes) {
    out.push_back(whole);
    out.back().node = node;
    out.back().force *= model.attachments[node].area / area;
  }
  return out;
}

// Loads of one course in time on one node are one: each takes its time in every substep, and a scene may have a
// thousand over each other.
void layOutDeadLoads(WorldData& d) {
  std::map<std::tuple<int, double, double>, std::size_t> known;  // node, from, to
  for (std::size_t b = 0; b < d.bodies.size(); ++b) {
    const std::vector<int>& node = d.ranges[b].node;
    for (const DeadLoad& load : d.bodies[b].deadLoads) {
      const auto require = [&](bool condition, const std::string& message) {
        if (!condition)
          throw std::runtime_error(fmt::format("body '{}' cannot be simulated: {}", d.bodies[b].name, message));
      };
      require(load.node >= 0 && load.node < static_cast<int>(node.size()),
              fmt::format("it loads node {}: expected 0 to {}", load.node, node.size() - 1));
      require(load.force.allFinite(), fmt::format("the load on its node {} is not finite", load.node));
      require(std::isfinite(load.from) && std::isfinite(load.to) && load.from <= load.to,
              fmt::format("the load on its node {} grows from {} s to {} s: expected the earlier time first", load.node,
                          load.from, load.to));
      const auto [place, isNew] = known.try_emplace({node[load.node], load.from, load.to}, d.deadLoads.size());
      if (isNew)
        d.deadLoads.push_back({node[load.node], load.force, load.from, load.to});
      else
        d.deadLoads[place->second].force += load.force;
    }
  }
  gatherSkinLoads(d);
}

double shareAt(const WorldData& d, const NodeForce& load, double time, double duration) {
  if (d.frame < 0 || time < load.from) return 0;
  const double grows = std::max(load.to - load.from, duration);
  return std::min(1.0, (time - load.from) / grows);
}

// A constant force bounds no step: explicit, and by the same way to the hosts of a skin as the tools' forces.
void applyDeadLoads(WorldData& d, double time) {
  for (LoadedGroup& g : d.skinLoads.groups) put(zeroVectors(), g.force);
  bool skinIsLoaded = false;
  for (std::size_t k = 0; k < d.deadLoads.size(); ++k) {
    const NodeForce& load = d.deadLoads[k];
    const double share = shareAt(d, load, time, d.substep);
    if (!(share > 0)) continue;
    const int group = d.skinLoads.groupOfLoad[k], node = load.node;
    if (group < 0) {
      const Vector3d impulse = d.keptByDrag * d.substep * share * load.force;
      setVector(d.nodes.velocity, node, vectorAt(d.nodes.velocity, node) + d.nodes.inverseMass[node] * impulse);
    } else {
      Lanes3& sum = d.skinLoads.groups[group].force;
      setLane(sum, node % 4, vectorOf(sum, node % 4) + share * load.force);
      skinIsLoaded = true;
    }
  }
  if (skinIsLoaded) pushSkins(d);
}

}  // namespace medulla
