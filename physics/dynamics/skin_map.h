#pragma once

#include "physics/dynamics/frame_turn.h"
#include "physics/dynamics/world_data.h"

// How nodes follow the frames they hang on (physics/model/identified_network.h), seen from their host's own frame: it
// stands where the home sphere's does and is turned as the host's frames are in the mean (identified_data.h),
//   R = Q / |Q|,   Q = sum share_k q_k.
// With e_k and s_k how far frame k is from its place at rest and twice the vector part of its quaternion, both seen
// from there,
//   node = home + R (restOffset + sum (map_k (e_k - g_k, s_k) + along_k g_k) + s x (s x lever) / 2),
//   s = sum weight_k s_k.
// The maps are the skin's first derivatives, the last term what turning adds to second order. With a the line between
// the two frames at rest, l its length, and y by how much it is longer now (stretchOf() of thinning.h),
//   g_k = a (a.e_k - l (1 - thinness(y)) / nu),   along_k = a.map_k a,
// keeps what a way along the line does along that line, and takes from what it does across: stretch thins by thinness,
// not in proportion. Why it is measured so, and from there: physics/equations/links.md.
// Rates and the transpose are exact; with (c_k, s_k / 2) the quaternion of frame k against R, all seen in R,
//   e_k' = v_k - v - omega x (x_k - home),   s_k' = c_k D + D x s_k / 2,   D = omega_k - omega,
//   omega = sum share_k (c_k omega_k + omega_k x s_k / 2) / |Q|,   |Q| = sum share_k c_k.
namespace medulla {

struct HostFrame {  // the same in all lanes
  Lanes3 position, q;
  Lanes w;
  Lanes3 velocity, omega;  // m/s, rad/s; where rates are asked for
  Rotation rotation;
  Lanes inverseLength;  // of Q
};

// Without rates. Frames that are turned by a whole turn against each other have no mean: Q's length is floored.
MEDULLA_INLINE HostFrame hostFrame(const Identified& s, const SkinHost& host) {
  const SkinTerms* terms = s.terms.data() + host.firstTerms;
  Lanes sum = splat(0);
  for (int k = 0; k < host.turnShares; ++k)
    sum = fma(splat(terms[k / 4].share[k % 4]), load(s.frames[terms[k / 4].frame[k % 4]].orientation), sum);
  Quad q;
  store(q, sum);
  HostFrame out;
  out.inverseLength = splat(1) / larger(squareRoot(splat(sumOfLanes(sum * sum))), splat(1e-3));
  put(out.inverseLength * splat(q), out.q);
  out.w = out.inverseLength * splat(q.v[3]);
  put(splat(s.frames[host.home].position), out.position);
  out.rotation = rotationOf(out.q, out.w);
  return out;
}

inline int frameOf(const Identified& s, const SkinHost& host, int term) {
  return static_cast<int>(s.terms[host.firstTerms + term / 4].frame[term % 4]);
}

// With the quaternion (c, turn / 2): c a + a x turn / 2 of a rate, and the transpose of a torque.
MEDULLA_INLINE Lanes3 rateOfTurn(const SkinTermState& at, const Lanes3& a) {
  return fma(at.cosine, a, splat(0.5) * cross(a, at.turn));
}
MEDULLA_INLINE Lanes3 torqueOnFrame(const SkinTermState& at, const Lanes3& onTurn) {
  return fma(at.cosine, onTurn, splat(0.5) * cross(at.turn, onTurn));
}

constexpr int kMostTurning = (kSkinFrames + 3) / 4;
inline int turningTerms(const SkinHost& host) {
  return (host.turnShares + 3) / 4;
}

// After seeFrames(): the rates of its states, and the host's own.
MEDULLA_INLINE void seeRates(const Identified& s, const SkinHost& host, SkinTermState* states, HostFrame& to) {
  const SkinTerms* terms = s.terms.data() + host.firstTerms;
  const int count = host.endTerms - host.firstTerms, turning = turningTerms(host);
  const auto spinOf = [&](int t) {
    return rotateBack(to.rotation, gatherQuads(s.frames.data(), terms[t].frame, &FrameState::angularVelocity));
  };
  Lanes3 sum = zeroVectors(), spins[kMostTurning];
  for (int t = 0; t < turning; ++t) {
    put(spinOf(t), spins[t]);
    put(fma(terms[t].share, rateOfTurn(states[t], spins[t]), sum), sum);
  }
  Quad mean;
  store(mean, sumOfLanes(to.inverseLength * sum));
  const Lanes3 omega = splat(mean);
  put(rotate(to.rotation, omega), to.omega);
  put(splat(s.frames[host.home].velocity), to.velocity);
  for (int t = 0; t < count; ++t) {
    SkinTermState& at = states[t];
    const Lanes3 velocity = gatherQuads(s.frames.data(), terms[t].frame, &FrameState::velocity) - to.velocity;
    const Lanes3 wayRate = rotateBack(to.rotation, velocity) - cross(omega, at.place);
    put(rateOfTurn(at, (t < turning ? spins[t] : spinOf(t)) - omega), at.turnRate);
    const Lanes3 beyond = dot(wayRate, at.spareRow) * terms[t].axis;
    put(beyond, at.spareRate);
    put(wayRate - beyond, at.wayRate);
  }
}

// Sets the host's SkinTermStates, of the rates where they are asked for; `states` has one for each of its terms.
template <bool withRates>
MEDULLA_INLINE HostFrame seeFrames(const Identified& s, const SkinHost& host, SkinTermState* states) {
  HostFrame own = hostFrame(s, host);
  SkinTermState* state = states;
  for (int t = host.firstTerms; t < host.endTerms; ++t, ++state) {
    const SkinTerms& terms = s.terms[t];
    const FrameLanes frames = gatherFrames(s.frames.data(), terms.frame);
    const RelativeTurn r = turnBetween(own.q, own.w, frames.q, frames.w);
    state->cosine = r.cosine;
    put(splat(2) * r.v, state->turn);
    const Lanes3 place = rotateBack(own.rotation, frames.position - own.position);
    put(place, state->place);
    const Lanes3 way = place - terms.restPlace;
    const PlaceStretch stretch = stretchOf(terms.inverseLength * place, terms.axis);
    const Spare spare = spareOf(host.thinning, stretch.value);
    put(fma(spare.slope - splat(1), stretch.slope, terms.axis), state->spareRow);
    const Lanes3 beyond = fma(terms.length, spare.value - stretch.value, dot(way, terms.axis)) * terms.axis;
    put(beyond, state->spare);
    put(way - beyond, state->way);
  }
  if (withRates) seeRates(s, host, states, own);
  return own;
}

MEDULLA_INLINE Lanes shareEntry(const float (&four)[4]) {
  return _mm256_cvtps_pd(_mm_load_ps(four));
}
MEDULLA_INLINE Lanes3 broadcastThree(const double* p) {
  return {_mm256_broadcast_sd(p), _mm256_broadcast_sd(p + 4), _mm256_broadcast_sd(p + 8)};
}

struct SkinPlace {  // seen in the host's frame: of the nodes from home, and how their own frames are turned against it
  Lanes3 offset, turn;
  Lanes3 offsetRate;
};

// s x (s x lever) / 2
MEDULLA_INLINE Lanes3 secondOrder(const Lanes3& s, const Lanes3& lever) {
  const Lanes half = splat(0.5);
  return fma(half * dot(s, lever), s, (splat(-0.5) * dot(s, s)) * lever);
}

// Sums of columns, each times its number, and of the same times the numbers' rates.
struct ColumnSums {
  Lanes3 value, rate;
};
template <bool withRates>
MEDULLA_INLINE void addColumns(const float (*columns)[4], const double* numbers, const double* rates, ColumnSums& to) {
  for (int j = 0; j < 3; ++j, columns += 3) {
    const Lanes3 column{shareEntry(columns[0]), shareEntry(columns[1]), shareEntry(columns[2])};
    put(fma(_mm256_broadcast_sd(numbers + 4 * j), column, to.value), to.value);
    if (withRates) put(fma(_mm256_broadcast_sd(rates + 4 * j), column, to.rate), to.rate);
  }
}
template <bool withRates>
MEDULLA_INLINE void addScaled(const float (&factor)[4], const double* numbers, const double* rates, ColumnSums& to) {
  const Lanes f = shareEntry(factor);
  put(fma(f, broadcastThree(numbers), to.value), to.value);
  if (withRates) put(fma(f, broadcastThree(rates), to.rate), to.rate);
}

// Twelve sums at a time are what the registers hold, and as many do not wait for each other: those of the maps first,
// then what a way does along its line and the nodes' own turns.
template <bool withRates>
MEDULLA_INLINE SkinPlace placeSkin(const Identified& s, const SkinGroup& g, const SkinTermState* states) {
  const Lanes3 none = zeroVectors();
  const double* numbers = reinterpret_cast<const double*>(states);
  ColumnSums ways{g.restOffset, none}, spares{none, none}, turns{none, none}, own{none, none};
  addColumns<withRates>(g.homeTurn, numbers + 12, numbers + 36, turns);
  addScaled<withRates>(g.homeWeight, numbers + 12, numbers + 36, own);
  for (int k = g.firstShare; k < g.endShare; ++k) {
    const SkinShare& share = s.shares[k];
    const double* at = numbers + share.state;
    addColumns<withRates>(share.map, at, at + 24, ways);
    addColumns<withRates>(share.map + 9, at + 12, at + 36, turns);
  }
  for (int k = g.firstShare; k < g.endShare; ++k) {
    const SkinShare& share = s.shares[k];
    const double* at = numbers + share.state;
    addScaled<withRates>(share.along, at + 48, at + 60, spares);
    addScaled<withRates>(share.weight, at + 12, at + 36, own);
  }
  const Lanes3 &turn = own.value, &turnRate = own.rate;
  SkinPlace out;
  put(ways.value + spares.value + turns.value + secondOrder(turn, g.lever), out.offset);
  put(turn, out.turn);
  if (withRates) {
    const Lanes half = splat(0.5);
    const Lanes3 rate = ways.rate + spares.rate + turns.rate;
    put(fma(half * dot(turn, g.lever), turnRate,
            fma(half * dot(turnRate, g.lever), turn, fnma(dot(turn, turnRate), g.lever, rate))),
        out.offsetRate);
  }
  return out;
}

// Forces (N) at the nodes' places, seen in the host's frame, added to the loads on the frames it sees.
MEDULLA_INLINE void giveToTerms(const Identified& s, const SkinGroup& g, const Lanes3& turn, const Lanes3& force,
                                SkinTermLoad* loads) {
  const Lanes half = splat(0.5);
  const Lanes3 onOwn = fma(half * dot(turn, g.lever), force,
                           fma(half * dot(turn, force), g.lever, (splat(-1) * dot(g.lever, force)) * turn));
  const Lanes f[3] = {force.x, force.y, force.z}, own[3] = {onOwn.x, onOwn.y, onOwn.z};
  const auto timesColumn = [&](const float(*column)[4], Lanes sum) {
    return fma(shareEntry(column[2]), force.z,
               fma(shareEntry(column[1]), force.y, fma(shareEntry(column[0]), force.x, sum)));
  };
  const Lanes homeWeight = shareEntry(g.homeWeight);
  for (int j = 0; j < 3; ++j)
    loads->onTurn[j] = timesColumn(g.homeTurn + 3 * j, fma(homeWeight, own[j], loads->onTurn[j]));
  for (int k = g.firstShare; k < g.endShare; ++k) {
    const SkinShare& share = s.shares[k];
    SkinTermLoad& to = loads[share.term];
    const Lanes weight = shareEntry(share.weight), along = shareEntry(share.along);
    for (int j = 0; j < 3; ++j) {
      to.onWay[j] = timesColumn(share.map + 3 * j, to.onWay[j]);
      to.onTurn[j] = timesColumn(share.map + 9 + 3 * j, fma(weight, own[j], to.onTurn[j]));
      to.onSpare[j] = fma(along, f[j], to.onSpare[j]);
    }
  }
}

// What nodes have done to four frames, node by node in the lanes of `loads`: summed up, one frame per lane.
struct TermLoads {
  Lanes3 onWay, onTurn, onSpare;
};
MEDULLA_INLINE TermLoads sumOfNodes(const SkinTermLoad* four) {
  const auto sums = [&](const Lanes(SkinTermLoad::*on)[3]) {
    const auto sum = [&](int j) {
      return sumsOfLanes((four[0].*on)[j], (four[1].*on)[j], (four[2].*on)[j], (four[3].*on)[j]);
    };
    return Lanes3{sum(0), sum(1), sum(2)};
  };
  return {sums(&SkinTermLoad::onWay), sums(&SkinTermLoad::onTurn), sums(&SkinTermLoad::onSpare)};
}

// What nodes get in sum, forces and moments about home, seen in the host's frame and node by node in the lanes, and the
// loads that giveToTerms() left: to the frames. `give(frames, forces, torques)` has four of them in the world's frame.
// Home, the first, bears what force the others do not, and those that turn the host bear the moment that is left by
// their shares in that: they come last.
template <class Give>
MEDULLA_INLINE void giveToFrames(const Identified& s, const SkinHost& host, const HostFrame& own,
                                 const SkinTermState* states, const SkinTermLoad* loads, Lanes3 force, Lanes3 moment,
                                 const Give& give) {
  const SkinTerms* terms = s.terms.data() + host.firstTerms;
  const int turning = turningTerms(host);
  Lanes3 onFrame[kMostTurning], torques[kMostTurning];
  for (int t = host.endTerms - host.firstTerms - 1; t >= 0; --t) {
    TermLoads on = sumOfNodes(loads + 4 * t);
    put(fma(dot(on.onSpare - on.onWay, terms[t].axis), states[t].spareRow, on.onWay), on.onWay);
    const Lanes3 torque = torqueOnFrame(states[t], on.onTurn);
    force = force - on.onWay;
    moment = moment - torque - cross(states[t].place, on.onWay);
    if (t >= turning) {
      give(terms[t].frame, rotate(own.rotation, on.onWay), rotate(own.rotation, torque));
    } else {
      put(on.onWay, onFrame[t]);
      put(torque, torques[t]);
    }
  }
  Quad forceLeft, momentLeft;
  store(forceLeft, sumOfLanes(force));
  store(momentLeft, sumOfLanes(own.inverseLength * moment));
  onFrame[0].x[0] += forceLeft.v[0];
  onFrame[0].y[0] += forceLeft.v[1];
  onFrame[0].z[0] += forceLeft.v[2];
  const Lanes3 left = splat(momentLeft);
  for (int t = 0; t < turning; ++t) {
    const Lanes3 torque = fma(terms[t].share, torqueOnFrame(states[t], left), torques[t]);
    give(terms[t].frame, rotate(own.rotation, onFrame[t]), rotate(own.rotation, torque));
  }
}

}  // namespace medulla
