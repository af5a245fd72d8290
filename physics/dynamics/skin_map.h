#pragma once

#include "physics/dynamics/frame_turn.h"
#include "physics/dynamics/world_data.h"

// How four nodes follow the frames they hang on, each up to six of its own (physics/model/identified_network.h): the
// place, its rate, and the exact transpose of that. With frames at x_k and quaternions q_k of weights w_k,
//   xb = sum w_k x_k,   qb = sum w_k q_k / |sum w_k q_k|,   (c_k, v_k) = conj(qb) q_k,
//   node = xb + Rb (restOffset + sum map_k (Rb^T (x_k - xb) - restPlace_k, v_k)).
// In the blended frame, D_k what angular velocities exceed its own by:
//   v_k' = (c_k D_k + D_k x v_k) / 2,   own spin = sum w_k / n (c_k spin_k + spin_k x v_k),   n = |sum w_k q_k|.
namespace medulla {

struct SkinRows {  // of a term's map
  Lanes3 onWay, onTurn;
};
MEDULLA_INLINE Lanes mapEntry(const SkinTerm& term, int i) {
  return _mm256_cvtps_pd(_mm_load_ps(term.map[i]));
}
MEDULLA_INLINE SkinRows mapRow(const SkinTerm& term, int axis) {
  const int i = 6 * axis;
  return {{mapEntry(term, i), mapEntry(term, i + 1), mapEntry(term, i + 2)},
          {mapEntry(term, i + 3), mapEntry(term, i + 4), mapEntry(term, i + 5)}};
}

MEDULLA_INLINE Lanes3 mapTimes(const SkinTerm& term, const Lanes3& way, const Lanes3& turn) {
  const SkinRows x = mapRow(term, 0), y = mapRow(term, 1), z = mapRow(term, 2);
  return {dot(x.onWay, way) + dot(x.onTurn, turn), dot(y.onWay, way) + dot(y.onTurn, turn),
          dot(z.onWay, way) + dot(z.onTurn, turn)};
}

// Its transpose.
MEDULLA_INLINE void mapBack(const SkinTerm& term, const Lanes3& force, Lanes3& onWay, Lanes3& onTurn) {
  const SkinRows x = mapRow(term, 0), y = mapRow(term, 1), z = mapRow(term, 2);
  put(fma(force.z, z.onWay, fma(force.y, y.onWay, force.x * x.onWay)), onWay);
  put(fma(force.z, z.onTurn, fma(force.y, y.onTurn, force.x * x.onTurn)), onTurn);
}

// Sets the states; returns the mean of the frames' places (m, world).
MEDULLA_INLINE Lanes3 placeSkin(const Identified& s, const SkinGroup& g, SkinTermState* states, SkinGroupState& to) {
  const Lanes zero = splat(0);
  FrameLanes frames[6];
  Lanes3 mean{zero, zero, zero}, q = mean;
  Lanes w = zero;
  const int count = g.endTerm - g.firstTerm;
  const SkinTerm* terms = &s.terms[g.firstTerm];
  for (int k = 0; k < count; ++k) {
    frames[k] = gatherFrames(s.frames.data(), terms[k].frame);
    mean = fma(terms[k].weight, frames[k].position, mean);
    q = fma(terms[k].weight, frames[k].q, q);
    w = fma(terms[k].weight, frames[k].w, w);
  }
  to.inverseNorm = splat(1) / squareRoot(larger(fma(w, w, dot(q, q)), splat(1e-4)));
  q = to.inverseNorm * q;
  w = to.inverseNorm * w;
  to.rotation = rotationOf(q, w);
  Lanes3 offset = g.restOffset;
  for (int k = 0; k < count; ++k) {
    SkinTermState& state = states[k];
    const RelativeTurn r = turnBetween(q, w, frames[k].q, frames[k].w);
    put(rotateBack(to.rotation, frames[k].position - mean), state.place);
    put(r.v, state.turn);
    state.cosine = r.cosine;
    offset = offset + mapTimes(terms[k], state.place - terms[k].restPlace, r.v);
  }
  put(offset, to.offset);
  return mean;
}

struct SkinRates {
  Lanes3 velocity;  // m/s, world, of the nodes' places
  Lanes3 spin;      // rad/s, world, of the blended frame
};

MEDULLA_INLINE SkinRates skinRates(const Identified& s, const SkinGroup& g, const SkinTermState* states,
                                   const SkinGroupState& at) {
  const Lanes zero = splat(0), half = splat(0.5);
  Lanes3 velocities[6], spins[6], mean{zero, zero, zero}, spin = mean;
  const int count = g.endTerm - g.firstTerm;
  const SkinTerm* terms = &s.terms[g.firstTerm];
  for (int k = 0; k < count; ++k) {
    velocities[k] = gatherQuads(s.frames.data(), terms[k].frame, &FrameState::velocity);
    spins[k] = rotateBack(at.rotation, gatherQuads(s.frames.data(), terms[k].frame, &FrameState::angularVelocity));
    mean = fma(terms[k].weight, velocities[k], mean);
    spin = fma(terms[k].weight, fma(states[k].cosine, spins[k], cross(spins[k], states[k].turn)), spin);
  }
  spin = at.inverseNorm * spin;
  Lanes3 rate = cross(spin, at.offset);
  for (int k = 0; k < count; ++k) {
    const Lanes3 way = rotateBack(at.rotation, velocities[k] - mean) - cross(spin, states[k].place);
    const Lanes3 apart = spins[k] - spin;
    const Lanes3 turn = half * fma(states[k].cosine, apart, cross(apart, states[k].turn));
    rate = rate + mapTimes(terms[k], way, turn);
  }
  return {mean + rotate(at.rotation, rate), rotate(at.rotation, spin)};
}

// What forces (N, world) at the nodes' places and moments (N m, world) on their blended frames do to the frames;
// `give(k, force, torque)` for each term k.
template <class Give>
MEDULLA_INLINE void returnSkinLoads(const Identified& s, const SkinGroup& g, const SkinTermState* states,
                                    const SkinGroupState& at, const Lanes3& force, const Lanes3& moment,
                                    const Give& give) {
  const Lanes half = splat(0.5);
  const int count = g.endTerm - g.firstTerm;
  const SkinTerm* terms = &s.terms[g.firstTerm];
  const Lanes3 f = rotateBack(at.rotation, force);
  Lanes3 rest = f, turning = rotateBack(at.rotation, moment) + cross(at.offset, f), onWay[6], onTurn[6];
  for (int k = 0; k < count; ++k) {
    const SkinTermState& state = states[k];
    Lanes3 turn;
    mapBack(terms[k], f, onWay[k], turn);
    onTurn[k] = half * fma(state.cosine, turn, cross(state.turn, turn));
    rest = rest - onWay[k];
    turning = turning - onTurn[k] - cross(state.place, onWay[k]);
  }
  for (int k = 0; k < count; ++k) {
    const SkinTermState& state = states[k];
    const Lanes weight = terms[k].weight;
    const Lanes3 shared = fma(state.cosine, turning, cross(state.turn, turning));
    give(k, rotate(at.rotation, fma(weight, rest, onWay[k])),
         rotate(at.rotation, fma(weight * at.inverseNorm, shared, onTurn[k])));
  }
}

}  // namespace medulla
