#include "physics/dynamics/identified_measures.h"
#include "physics/dynamics/identified_stages.h"

// Links whose six measures share one stiffness matrix, found by finite elements offline.
namespace medulla {

namespace {

void placeFrames(WorldData& d, const IdentifiedBody& body) {
  const Spheres& s = d.spheres;
  for (int i = body.firstFrame; i < body.endFrame; ++i) {
    CarriedFrame& c = d.identified.carried[i];
    if (c.sphere < 0) continue;
    FrameState& f = d.identified.frames[i];
    const Quad &q = s.orientation[c.sphere], &omega = s.angularVelocity[c.sphere];
    // arm + 2 q x (q x arm + w arm)
    const Lanes axis = _mm256_blend_pd(load(q), splat(0), 8), rest = load(c.restArm);
    const Lanes arm = fma(splat(2), crossProduct(axis, fma(splat(q.v[3]), rest, crossProduct(axis, rest))), rest);
    store(c.worldArm, arm);
    store(f.position, load(s.position[c.sphere]) + arm);
    store(f.velocity, load(s.velocity[c.sphere]) + crossProduct(load(omega), arm));
    f.orientation = q;
    f.angularVelocity = omega;
  }
}

void evaluateGroup(const IdentifiedLinkGroup& link, const FrameState* frames, FrameLoad* loads) {
  const LinkTurn m = measureLink(link, gatherFrames(frames, link.frame0), gatherFrames(frames, link.frame1));
  const auto seen = [&](Quad FrameState::*q, const std::uint32_t* i) {
    return rotateBack(m.middle, gatherQuads(frames, i, q));
  };
  const Lanes3 spin0 = seen(&FrameState::angularVelocity, link.frame0),
               spin1 = seen(&FrameState::angularVelocity, link.frame1);
  const Lanes3 velocity = rotateBack(m.middle, gatherQuads(frames, link.frame1, &FrameState::velocity) -
                                                   gatherQuads(frames, link.frame0, &FrameState::velocity));
  const LinkRates rate = ratesOf(link, m, velocity, spin1 - spin0, splat(0.5) * (spin0 + spin1));
  // The axis of elongation is measured by its neo-Hookean measure, at its rate.
  const Lanes beta = link.relaxation;
  const Lanes extra = fma(beta * (m.slope - splat(1)), dot(rate.t, link.along), m.hyper - m.along);
  Lanes3 onT, onW;
  stiffnessTimes(link, fma(beta, rate.t, fma(extra, link.along, m.t)), fma(beta, rate.w, m.w), onT, onW);
  onT = fma((m.slope - splat(1)) * dot(onT, link.along), link.along, onT);
  const FrameLoads on = loadsOf(link, m, onT, onW);
  const Lanes3 force = rotate(m.middle, on.force1);
  const Lanes minus = splat(-1);
  addFour(force, loads, link.frame0, &FrameLoad::force);
  addFour(minus * rotate(m.middle, on.torque0), loads, link.frame0, &FrameLoad::torque);
  addFour(minus * force, loads, link.frame1, &FrameLoad::force);
  addFour(minus * rotate(m.middle, on.torque1), loads, link.frame1, &FrameLoad::torque);
}

}  // namespace

void evaluateIdentifiedLinks(WorldData& d, const Batch& batch) {
  Identified& s = d.identified;
  for (const int b : batch.bodies) {
    const IdentifiedBody& body = s.bodies[b];
    placeFrames(d, body);
    for (int i = body.firstFrame; i < body.endFrame; ++i) s.loads[i] = {};
    for (int g = body.firstLinkGroup; g < body.endLinkGroup; ++g)
      evaluateGroup(s.links[g], s.frames.data(), s.loads.data());
  }
}

void returnFrameForces(WorldData& d, const Batch& batch) {
  const Identified& s = d.identified;
  for (const int b : batch.bodies) {
    const IdentifiedBody& body = s.bodies[b];
    for (int i = body.firstFrame; i < body.endFrame; ++i) {
      const CarriedFrame& c = s.carried[i];
      if (c.sphere < 0) continue;
      const Lanes force = load(s.loads[i].force);
      Quad &onSphere = d.spheres.force[c.sphere], &turning = d.spheres.torque[c.sphere];
      store(onSphere, load(onSphere) + force);
      store(turning, load(turning) + load(s.loads[i].torque) + crossProduct(load(c.worldArm), force));
    }
  }
}

double identifiedLinkEnergy(const Identified& s, const IdentifiedBody& body) {
  double sum = 0;
  for (int g = body.firstLinkGroup; g < body.endLinkGroup; ++g) {
    const IdentifiedLinkGroup& link = s.links[g];
    const LinkTurn m =
        measureLink(link, gatherFrames(s.frames.data(), link.frame0), gatherFrames(s.frames.data(), link.frame1));
    const Lanes3 t = fma(m.hyper - m.along, link.along, m.t);
    Lanes3 onT, onW;
    stiffnessTimes(link, t, m.w, onT, onW);
    sum += 0.5 * sumOfLanes(dot(t, onT) + dot(m.w, onW));
  }
  return sum;
}

double identifiedLinkEnergy(const WorldData& d) {
  double sum = 0;
  for (const IdentifiedBody& body : d.identified.bodies) sum += identifiedLinkEnergy(d.identified, body);
  return sum;
}

}  // namespace medulla
