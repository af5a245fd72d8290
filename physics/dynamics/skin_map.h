#pragma once

#include "physics/dynamics/frame_turn.h"
#include "physics/dynamics/world_data.h"

// How nodes follow the frames they hang on (physics/model/identified_network.h), seen from the frame of their home
// sphere: with e_k and s_k how far frame k is from its place at rest and twice the vector part of its quaternion, both
// in the home frame,
//   node = home + R (restOffset + sum (map_k (e_k - g_k, s_k) + along_k g_k) + s x (s x lever) / 2),
//   s = sum weight_k s_k.
// The maps are the skin's first derivatives, the last term what turning adds to second order. Stretch thins by
// thinness(y) of thinning.h, not by 1 - nu y: with a the line between the two frames at rest, l its length and y =
// a.e_k / l,
//   g_k = a l (y - (1 - thinness(y)) / nu),   along_k = a.map_k a,
// keeps what a way along the line does along that line, and takes from what it does across. Rates and the transpose are
// exact:
//   e_k' = R^T (v_k - v - omega x (x_k - home)),   s_k' = c_k D + D x s_k / 2,   D = R^T (omega_k - omega).
namespace medulla {

struct HomeFrame {  // the same in all lanes
  Lanes3 position, q;
  Lanes w;
  Lanes3 velocity, omega;
  Rotation rotation;
};

MEDULLA_INLINE HomeFrame homeFrame(const Identified& s, const SkinHost& host) {
  const FrameState& f = s.frames[host.home];
  HomeFrame out;
  put(splat(f.position), out.position);
  put(splat(f.orientation), out.q);
  out.w = splat(f.orientation.v[3]);
  put(splat(f.velocity), out.velocity);
  put(splat(f.angularVelocity), out.omega);
  out.rotation = rotationOf(out.q, out.w);
  return out;
}

// Sets the host's SkinTermStates, of the rates where they are asked for; `states` has one for each of its terms.
template <bool withRates>
MEDULLA_INLINE void seeFrames(const Identified& s, const SkinHost& host, const HomeFrame& home, SkinTermState* states) {
  const Lanes half = splat(0.5);
  for (int t = host.firstTerms; t < host.endTerms; ++t, ++states) {
    const SkinTerms& terms = s.terms[t];
    const FrameLanes frames = gatherFrames(s.frames.data(), terms.frame);
    const RelativeTurn r = turnBetween(home.q, home.w, frames.q, frames.w);
    states->cosine = r.cosine;
    const Lanes3 turn = splat(2) * r.v;
    put(turn, states->turn);
    const Lanes3 from = frames.position - home.position, place = rotateBack(home.rotation, from);
    put(place, states->place);
    const Lanes3 way = place - terms.restPlace;
    const Spare spare = spareOf(host.thinning, terms.inverseLength * dot(way, terms.axis));
    states->spareSlope = spare.slope;
    const Lanes3 beyond = (terms.length * spare.value) * terms.axis;
    put(beyond, states->spare);
    put(way - beyond, states->way);
    if (!withRates) continue;
    const Lanes3 velocity = gatherQuads(s.frames.data(), terms.frame, &FrameState::velocity) - home.velocity;
    const Lanes3 wayRate = rotateBack(home.rotation, velocity - cross(home.omega, from));
    const Lanes3 apart =
        rotateBack(home.rotation, gatherQuads(s.frames.data(), terms.frame, &FrameState::angularVelocity) - home.omega);
    put(fma(r.cosine, apart, half * cross(apart, turn)), states->turnRate);
    const Lanes3 beyondRate = (spare.slope * dot(wayRate, terms.axis)) * terms.axis;
    put(beyondRate, states->spareRate);
    put(wayRate - beyondRate, states->wayRate);
  }
}

MEDULLA_INLINE Lanes shareEntry(const float (&four)[4]) {
  return _mm256_cvtps_pd(_mm_load_ps(four));
}
MEDULLA_INLINE Lanes3 broadcastThree(const double* p) {
  return {_mm256_broadcast_sd(p), _mm256_broadcast_sd(p + 4), _mm256_broadcast_sd(p + 8)};
}

struct SkinPlace {  // in the home frame: of the nodes, and how their own frames are turned against it
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

// Forces (N) at the nodes' places, in the home frame, added to the loads on the host's other frames.
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

struct HomeLoad {
  Lanes force, moment;  // N, N m, in the world's frame, as quads
};

// What nodes get in sum, forces and moments about home, in the home frame and node by node in the lanes, and the loads
// that giveToTerms() left: to the frames. `give(frames, forces, torques)` has four of them in the world's frame; home's
// own is returned.
template <class Give>
MEDULLA_INLINE HomeLoad giveToFrames(const Identified& s, const SkinHost& host, const Rotation& rotation,
                                     const SkinTermState* states, const SkinTermLoad* loads, Lanes3 force,
                                     Lanes3 moment, const Give& give) {
  for (int t = host.firstTerms; t < host.endTerms; ++t, ++states, loads += 4) {
    const auto sums = [&](const Lanes(SkinTermLoad::*on)[3]) {
      const auto sum = [&](int j) {
        return sumsOfLanes((loads[0].*on)[j], (loads[1].*on)[j], (loads[2].*on)[j], (loads[3].*on)[j]);
      };
      return Lanes3{sum(0), sum(1), sum(2)};
    };
    Lanes3 onWay = sums(&SkinTermLoad::onWay);
    const Lanes3 onTurn = sums(&SkinTermLoad::onTurn), onSpare = sums(&SkinTermLoad::onSpare);
    const Lanes3& axis = s.terms[t].axis;
    put(fma(states->spareSlope * dot(onSpare - onWay, axis), axis, onWay), onWay);
    const Lanes3 torque = fma(states->cosine, onTurn, splat(0.5) * cross(states->turn, onTurn));
    force = force - onWay;
    moment = moment - torque - cross(states->place, onWay);
    give(s.terms[t].frame, rotate(rotation, onWay), rotate(rotation, torque));
  }
  return {sumOfLanes(rotate(rotation, force)), sumOfLanes(rotate(rotation, moment))};
}

}  // namespace medulla
