#pragma once

#include "physics/dynamics/implicit_data.h"

// Matrices of three by three in four lanes, and the blocks that four links add to their spheres'.
namespace medulla {

// How four links stand; as in LinkFrame.
struct LinkPose {
  Lanes3 line, n, arm0, arm1, spinAxis0, spinAxis1, spinLever0, spinLever1;
  Lanes twist, inverseLength;
};
LinkPose poseOfLinks(const WorldData& d, std::size_t group);  // link_force.cpp; of the present state

struct Matrix3Lanes {
  Lanes3 row[3];
};

inline Matrix3Lanes zeroMatrix() {
  return {{zeroVectors(), zeroVectors(), zeroVectors()}};
}
// += a b^T
MEDULLA_INLINE void addOuter(const Lanes3& a, const Lanes3& b, Matrix3Lanes& to) {
  to.row[0] = fma(a.x, b, to.row[0]);
  to.row[1] = fma(a.y, b, to.row[1]);
  to.row[2] = fma(a.z, b, to.row[2]);
}
MEDULLA_INLINE Matrix3Lanes transposed(const Matrix3Lanes& m) {
  const auto& r = m.row;
  return {{{r[0].x, r[1].x, r[2].x}, {r[0].y, r[1].y, r[2].y}, {r[0].z, r[1].z, r[2].z}}};
}
MEDULLA_INLINE Matrix3Lanes operator+(const Matrix3Lanes& a, const Matrix3Lanes& b) {
  return {{a.row[0] + b.row[0], a.row[1] + b.row[1], a.row[2] + b.row[2]}};
}
MEDULLA_INLINE Matrix3Lanes operator-(const Matrix3Lanes& a) {
  const Lanes minus = splat(-1);
  return {{minus * a.row[0], minus * a.row[1], minus * a.row[2]}};
}
// Each row crossed with b: m [b]^T with [b] v = v x b.
MEDULLA_INLINE Matrix3Lanes rowsCrossed(const Matrix3Lanes& m, const Lanes3& b) {
  return {{cross(m.row[0], b), cross(m.row[1], b), cross(m.row[2], b)}};
}

// The upper half of a symmetric matrix of four links' energies, by the line between the ends and by the turning of each
// of the two spheres.
struct LinkBlocks {
  Matrix3Lanes line, line0, line1, turn0, between, turn1;  // line0: line and turning of sphere 0; between: of both
};

// Four blocks of six by six, one per lane, whose quarters these are. `visit(lane, k, quad)` gets every block's numbers
// four by four, column after column.
template <class Visit>
MEDULLA_INLINE void visitBlocks(const Matrix3Lanes& topLeft, const Matrix3Lanes& topRight,
                                const Matrix3Lanes& bottomLeft, const Matrix3Lanes& bottomRight, const Visit& visit) {
  Lanes entry[36];
  const Matrix3Lanes* quarters[2][2] = {{&topLeft, &bottomLeft}, {&topRight, &bottomRight}};
  for (int right = 0; right < 2; ++right) {
    for (int bottom = 0; bottom < 2; ++bottom) {
      Lanes* to = entry + 18 * right + 3 * bottom;
      for (int r = 0; r < 3; ++r) {
        const Lanes3& row = quarters[right][bottom]->row[r];
        to[r] = row.x;
        to[6 + r] = row.y;
        to[12 + r] = row.z;
      }
    }
  }
  for (int k = 0; k < 9; ++k) {
    Lanes* of = entry + 4 * k;
    transpose(of[0], of[1], of[2], of[3]);
  }
  for (int lane = 0; lane < 4; ++lane)
    for (int k = 0; k < 9; ++k) visit(lane, k, entry[4 * k + lane]);
}

}  // namespace medulla
