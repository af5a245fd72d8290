#include <algorithm>

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
    const Lanes axis = withoutFourth(load(q)), rest = load(c.restArm);
    const Lanes arm = fma(splat(2), crossProduct(axis, fma(splat(q.v[3]), rest, crossProduct(axis, rest))), rest);
    store(c.worldArm, arm);
    store(f.position, load(s.position[c.sphere]) + arm);
    store(f.velocity, load(s.velocity[c.sphere]) + crossProduct(load(omega), arm));
    f.orientation = q;
    f.angularVelocity = omega;
  }
}

MEDULLA_INLINE LinkTurn turnOf(const IdentifiedLinkGroup& link, const FrameState* frames) {
  return measureLink(link, gatherFrames(frames, link.frame0), gatherFrames(frames, link.frame1));
}

// With what damping adds: relaxation times their rates.
MEDULLA_INLINE LinkMeasures6 dampedMeasures(const IdentifiedLinkGroup& link, const LinkTurn& m,
                                            const FrameState* frames) {
  const auto seen = [&](Quad FrameState::*q, const std::uint32_t* i) {
    return rotateBack(m.middle, gatherQuads(frames, i, q));
  };
  const Lanes3 spin0 = seen(&FrameState::angularVelocity, link.frame0),
               spin1 = seen(&FrameState::angularVelocity, link.frame1);
  const Lanes3 velocity = rotateBack(m.middle, gatherQuads(frames, link.frame1, &FrameState::velocity) -
                                                   gatherQuads(frames, link.frame0, &FrameState::velocity));
  const LinkRates rate =
      measuredRates(link, m, ratesOf(link, m, velocity, spin1 - spin0, splat(0.5) * (spin0 + spin1)));
  const LinkMeasures6 at = measuresOf(link, m);
  return {fma(link.relaxation, rate.t, at.t), fma(link.relaxation, rate.w, at.w)};
}

// N, N m: forces on the measures.
MEDULLA_INLINE LinkMeasures6 forcesOn(const IdentifiedLinkGroup& link, const LinkMeasures6& m) {
  LinkMeasures6 out;
  stiffnessTimes(link, m.t, m.w, out.t, out.w);
  return out;
}

// Each cell's strain pulls at the measures that it is summed from.
MEDULLA_INLINE void addStrainForces(const IdentifiedLinkGroup& link, const double* strains, LinkMeasures6& to) {
  const auto gathered = [&](const std::uint32_t* i) {
    return Lanes{strains[i[0]], strains[i[1]], strains[i[2]], strains[i[3]]};
  };
  const auto add = [&](Lanes strain, const Lanes(&of)[6]) {
    to.t = fma(strain, Lanes3{of[0], of[1], of[2]}, to.t);
    to.w = fma(link.lengthScale * strain, Lanes3{of[3], of[4], of[5]}, to.w);
  };
  add(gathered(link.frame0), link.strain0);
  add(gathered(link.frame1), link.strain1);
}

MEDULLA_INLINE void giveToFrames(const IdentifiedLinkGroup& link, const LinkTurn& m, const LinkMeasures6& forces,
                                 FrameLoad* loads) {
  const LinkRates onTurn = forcesOnTurn(link, m, forces);
  const FrameLoads on = loadsOf(link, m, onTurn.t, onTurn.w);
  const Lanes3 force = rotate(m.middle, on.force1);
  const Lanes minus = splat(-1);
  addFour(force, loads, link.frame0, &FrameLoad::force);
  addFour(minus * rotate(m.middle, on.torque0), loads, link.frame0, &FrameLoad::torque);
  addFour(minus * force, loads, link.frame1, &FrameLoad::force);
  addFour(minus * rotate(m.middle, on.torque1), loads, link.frame1, &FrameLoad::torque);
}

void evaluateGroup(const IdentifiedLinkGroup& link, const FrameState* frames, FrameLoad* loads) {
  const LinkTurn m = turnOf(link, frames);
  giveToFrames(link, m, forcesOn(link, dampedMeasures(link, m, frames)), loads);
}

// All links are measured before any pulls.
void evaluateStrained(Identified& s, const IdentifiedBody& body) {
  std::fill(s.strains.begin() + body.firstFrame, s.strains.begin() + body.endFrame, 0);
  for (int g = body.firstLinkGroup; g < body.endLinkGroup; ++g) {
    StrainedLinkState& at = s.strained[g];
    at.turn = turnOf(s.links[g], s.frames.data());
    at.damped = dampedMeasures(s.links[g], at.turn, s.frames.data());
    addStrains(s.links[g], at.damped, s.strains.data());
  }
  for (int g = body.firstLinkGroup; g < body.endLinkGroup; ++g) {
    const StrainedLinkState& at = s.strained[g];
    LinkMeasures6 forces = forcesOn(s.links[g], at.damped);
    addStrainForces(s.links[g], s.strains.data(), forces);
    giveToFrames(s.links[g], at.turn, forces, s.loads.data());
  }
}

}  // namespace

void evaluateIdentifiedLinks(WorldData& d, const Batch& batch) {
  Identified& s = d.identified;
  for (const int b : batch.bodies) {
    const IdentifiedBody& body = s.bodies[b];
    placeFrames(d, body);
    for (int i = body.firstFrame; i < body.endFrame; ++i) s.loads[i] = {};
    if (body.hasStrains) {
      evaluateStrained(s, body);
      continue;
    }
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
      giveToSphere(c, s.loads[i], d.spheres.force[c.sphere], d.spheres.torque[c.sphere]);
    }
  }
}

double identifiedLinkEnergy(const Identified& s, const IdentifiedBody& body) {
  double sum = 0;
  const auto first = s.stillStrains.begin() + body.firstFrame, end = s.stillStrains.begin() + body.endFrame;
  std::fill(first, end, 0);
  for (int g = body.firstLinkGroup; g < body.endLinkGroup; ++g) {
    const IdentifiedLinkGroup& link = s.links[g];
    const LinkTurn m = turnOf(link, s.frames.data());
    const LinkMeasures6 measures = measuresOf(link, m), forces = forcesOn(link, measures);
    sum += 0.5 * sumOfLanes(dot(measures.t, forces.t) + dot(measures.w, forces.w));
    addStrains(link, measures, s.stillStrains.data());
  }
  for (auto strain = first; strain != end; ++strain) sum += 0.5 * *strain * *strain;
  return sum;
}

double identifiedLinkEnergy(const WorldData& d, std::vector<double>* ofBodies) {
  double sum = 0;
  for (std::size_t b = 0; b < d.identified.bodies.size(); ++b) {
    const double own = identifiedLinkEnergy(d.identified, d.identified.bodies[b]);
    sum += own;
    if (ofBodies != nullptr) (*ofBodies)[b] += own;
  }
  return sum;
}

}  // namespace medulla
