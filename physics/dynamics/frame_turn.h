#pragma once

#include "physics/dynamics/angles.h"
#include "physics/dynamics/identified_data.h"

// How four frames are turned against four others, and what follows from it (physics/equations).
namespace medulla {

struct FrameLanes {
  Lanes3 position, q;
  Lanes w;
};

MEDULLA_INLINE Lanes3 gatherQuads(const FrameState* frames, const std::uint32_t* i, Quad FrameState::*q,
                                  Lanes& fourth) {
  return gather(frames[i[0]].*q, frames[i[1]].*q, frames[i[2]].*q, frames[i[3]].*q, fourth);
}
MEDULLA_INLINE Lanes3 gatherQuads(const FrameState* frames, const std::uint32_t* i, Quad FrameState::*q) {
  Lanes unused;
  return gatherQuads(frames, i, q, unused);
}
MEDULLA_INLINE FrameLanes gatherFrames(const FrameState* frames, const std::uint32_t* i) {
  FrameLanes out;
  out.position = gatherQuads(frames, i, &FrameState::position);
  out.q = gatherQuads(frames, i, &FrameState::orientation, out.w);
  return out;
}

// The quaternion conj(a) b.
struct RelativeTurn {
  Lanes cosine;  // of half the angle
  Lanes3 v;
};
MEDULLA_INLINE RelativeTurn turnBetween(const Lanes3& qa, Lanes wa, const Lanes3& qb, Lanes wb) {
  return {fma(wa, wb, dot(qa, qb)), fma(wa, qb, fnma(wb, qa, cross(qb, qa)))};
}

// Adds vectors, one per lane, to quads anywhere.
MEDULLA_INLINE void addFour(const Lanes3& v, FrameLoad* loads, const std::uint32_t* i, Quad FrameLoad::*q) {
  Lanes a = v.x, b = v.y, c = v.z, d = splat(0);
  transpose(a, b, c, d);
  const Lanes rows[4] = {a, b, c, d};
  for (int l = 0; l < 4; ++l) addTo(loads[i[l]].*q, rows[l]);
}

}  // namespace medulla
