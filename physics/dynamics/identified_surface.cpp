#include <Eigen/Geometry>

#include "physics/dynamics/edge_springs.h"
#include "physics/dynamics/identified_stages.h"
#include "physics/dynamics/skin_map.h"

// The surface of bodies with identified links: its nodes hang on up to six frames each.
namespace medulla {

namespace {

struct SkinPlace {
  Lanes3 mean, offset, area;  // m, world: of the frames; from there to the nodes' places; m2, carried along
};

MEDULLA_INLINE SkinPlace placeGroup(Identified& s, const NodeGroup& group, int skin) {
  const SkinGroup& g = s.skin[skin];
  SkinGroupState& state = s.skinStates[skin];
  const Lanes3 mean = placeSkin(s, g, &s.termStates[g.firstTerm], state);
  return {mean, rotate(state.rotation, state.offset), rotate(state.rotation, group.restArea)};
}

MEDULLA_INLINE SkinRates ratesOf(const Identified& s, int skin) {
  return skinRates(s, s.skin[skin], &s.termStates[s.skin[skin].firstTerm], s.skinStates[skin]);
}

MEDULLA_INLINE void returnGroup(const Identified& s, int skin, const Lanes3& force, const Lanes3& moment,
                                FrameLoad* loads) {
  const SkinGroup& g = s.skin[skin];
  returnSkinLoads(s, g, &s.termStates[g.firstTerm], s.skinStates[skin], force, moment,
                  [&](int k, const Lanes3& f, const Lanes3& torque) {
                    const std::uint32_t* frames = s.terms[g.firstTerm + k].frame;
                    addFour(f, loads, frames, &FrameLoad::force);
                    addFour(torque, loads, frames, &FrameLoad::torque);
                  });
}

}  // namespace

void pullOnFrames(WorldData& d, const HostRange& range) {
  Nodes& n = d.nodes;
  const Lanes relaxation = splat(range.relaxation);
  Lanes volume = splat(0);
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const int skin = d.identified.ofNodeGroup[g];
    const SkinPlace place = placeGroup(d.identified, n.groups[g], skin);
    const SkinRates rates = ratesOf(d.identified, skin);
    const Lanes3 displaced = n.position[g] - place.mean - place.offset;
    const Lanes3 rate = rates.velocity + cross(rates.spin, displaced) - n.velocity[g];
    const Lanes lifted = dot(displaced, place.area), lifting = dot(rate, place.area);
    const Lanes stiffness = n.groups[g].stiffness, excess = d.identified.skin[skin].normalExcess;
    volume = volume + lifted;
    const Lanes3 pull = fnma(stiffness, displaced, (stiffness * relaxation) * rate);
    put(fma(excess * fma(relaxation, lifting, splat(0) - lifted), place.area, pull), n.force[g]);
    put(place.offset, n.offset[g]);
    put(place.area, n.area[g]);
    storeFour(displaced, n.displaced, 4 * g);
  }
  d.nodes.swollen[range.part] = sumOfLanes(volume);
}

// Springs along what nodes are displaced by turn nothing; all others act at the nodes, and the blended frame bears the
// difference.
void returnToFrames(WorldData& d, const HostRange& range, Lanes pressure) {
  Nodes& n = d.nodes;
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const Lanes3 displaced = gatherFour(n.displaced, 4 * g);
    const Lanes3 edges = pullOfEdges(d.springs, n.displaced.data(), displaced, n.groups[g].edges, g);
    const Lanes3 own = fnma(pressure, n.area[g], n.force[g]), force = own + edges;
    put(force, n.force[g]);
    const Lanes minus = splat(-1);
    returnGroup(d.identified, d.identified.ofNodeGroup[g], minus * force, minus * cross(displaced, own),
                d.identified.loads.data());
  }
}

void placeOnFrames(WorldData& d, const HostRange& range) {
  Nodes& n = d.nodes;
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const int skin = d.identified.ofNodeGroup[g];
    const SkinPlace place = placeGroup(d.identified, n.groups[g], skin);
    put(place.mean + place.offset + gatherFour(n.displaced, 4 * g), n.position[g]);
    put(ratesOf(d.identified, skin).velocity, n.velocity[g]);
    put(place.area, n.area[g]);
  }
}

double normalEnergy(const WorldData& d, int node) {
  const int skin = d.identified.ofNodeGroup[node / 4];
  if (skin < 0) return 0;
  const double lifted = vectorAt(d.nodes.area, node).dot(vectorOf(d.nodes.displaced[node]));
  return 0.5 * d.identified.skin[skin].normalExcess[node % 4] * lifted * lifted;
}

Eigen::Vector3d placeOnFrames(const WorldData& d, int node) {
  const Identified& s = d.identified;
  SkinTermState states[6];
  SkinGroupState at;
  const Lanes3 mean = placeSkin(s, s.skin[s.ofNodeGroup[node / 4]], states, at);
  return vectorOf(mean + rotate(at.rotation, at.offset), node % 4);
}

HostPoint hostPointOnFrames(const WorldData& d, int node) {
  const Identified& s = d.identified;
  const SkinGroup& g = s.skin[s.ofNodeGroup[node / 4]];
  SkinTermState states[6];
  SkinGroupState at;
  placeSkin(s, g, states, at);
  HostPoint p;
  const int lane = node % 4;
  const Lanes zero = splat(0), one = splat(1);
  for (int axis = 0; axis < 3; ++axis) {
    const Lanes3 unit{axis == 0 ? one : zero, axis == 1 ? one : zero, axis == 2 ? one : zero};
    p.count = 0;
    returnSkinLoads(s, g, states, at, unit, {zero, zero, zero}, [&](int k, const Lanes3& force, const Lanes3& torque) {
      const CarriedFrame& c = s.carried[s.terms[g.firstTerm + k].frame[lane]];
      if (c.sphere < 0) return;
      const Eigen::Vector3d f = vectorOf(force, lane);
      p.spheres[p.count] = c.sphere;
      p.force[p.count].col(axis) = f;
      p.torque[p.count].col(axis) = vectorOf(torque, lane) + vectorOf(c.worldArm).cross(f);
      ++p.count;
    });
  }
  return p;
}

}  // namespace medulla
