#pragma once

#include "physics/dynamics/world_data.h"

// Where the nodes of a host hang still from their anchors (SurfaceMode::contact): k x = m g - p a, and p = bulk sum a.x
// is the host's pressure. Their mean weight alone would not do: a host's patch of surface is open, so that nodes which
// all sink alike press. Fixed nodes, and pads, stay where they are. Identified attachments have more than k along the
// node's normal.
namespace medulla {

// m/N, of the four nodes of group g along their normals, where they give `perForce` without what identified attachments
// have more there.
MEDULLA_INLINE Lanes giveAlongNormal(const WorldData& d, int g, Lanes perForce) {
  if (d.identified.ofNodeGroup[g] < 0) return perForce;
  const Lanes excess = d.identified.skin[d.identified.ofNodeGroup[g]].normalExcess;  // N/m5
  return perForce / fma(excess * perForce, dot(d.nodes.area[g], d.nodes.area[g]), splat(1));
}
MEDULLA_INLINE Lanes giveAlongNormal(const WorldData& d, int g) {
  return giveAlongNormal(d, g, d.surface.give[g].perForce);
}

// m, what they give of the `even` way that they would without: (1/perForce + excess a a^T) inverted by Sherman and
// Morrison's formula.
MEDULLA_INLINE Lanes3 yielding(const WorldData& d, int g, Lanes perForce, const Lanes3& even) {
  if (d.identified.ofNodeGroup[g] < 0) return even;
  const Lanes3& area = d.nodes.area[g];
  const Lanes excess = d.identified.skin[d.identified.ofNodeGroup[g]].normalExcess;
  return fnma(excess * dot(area, even) * giveAlongNormal(d, g, perForce), area, even);
}

// m, of the four nodes of group g under their weight, without pressure.
MEDULLA_INLINE Lanes3 sagOf(const WorldData& d, const Lanes3& gravity, int g) {
  return yielding(d, g, d.surface.give[g].perForce, d.surface.give[g].perGravity * gravity);
}

// m, with it.
MEDULLA_INLINE Lanes3 hangingAt(const WorldData& d, const Lanes3& gravity, Lanes pressure, int g) {
  return fnma(pressure * giveAlongNormal(d, g), d.nodes.area[g], sagOf(d, gravity, g));
}

// m5/N: how far a pressure of 1 Pa would swell what the nodes of some groups close in.
inline double swellingOf(const WorldData& d, int firstGroup, int endGroup) {
  Lanes give = splat(0);
  for (int g = firstGroup; g < endGroup; ++g)
    give = fma(dot(d.nodes.area[g], d.nodes.area[g]), giveAlongNormal(d, g), give);
  return sumOfLanes(give);
}

// m/s2, under which a body's nodes hang.
inline Lanes3 hangingGravity(const WorldData& d, int body) {
  return splat(d.surface.hanging.empty() ? d.gravity : d.surface.hanging[body]);
}

// Pa: of nodes of these groups that hang still, with `bulk` the host's pressure per volume as they give way to it.
inline double stillPressure(const WorldData& d, const Lanes3& gravity, int firstGroup, int endGroup, double bulk) {
  Lanes sunk = splat(0);
  for (int g = firstGroup; g < endGroup; ++g) sunk = sunk + dot(d.nodes.area[g], sagOf(d, gravity, g));
  return bulk * sumOfLanes(sunk);
}

}  // namespace medulla
