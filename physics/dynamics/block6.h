#pragma once

#include <Eigen/Core>

#include "physics/dynamics/simd.h"

// Products of 6x6 blocks, column by column in memory, and vectors of six. Two columns fill three registers without a
// gap: rows 0-3 of the first; rows 4, 5 of the first and 0, 1 of the second; rows 2-5 of the second. Eigen takes each
// column as four and two, and twice to three times the instructions.
namespace medulla {

using Block6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

struct Six {
  Lanes rows0;    // 0-3
  __m128d rows4;  // 4, 5
};

MEDULLA_INLINE Six loadSix(const double* from) {
  return {_mm256_loadu_pd(from), _mm_loadu_pd(from + 4)};
}
MEDULLA_INLINE void storeSix(double* to, const Six& a) {
  _mm256_storeu_pd(to, a.rows0);
  _mm_storeu_pd(to + 4, a.rows4);
}
MEDULLA_INLINE Six splatSix(double a) {
  return {splat(a), _mm_set1_pd(a)};
}
MEDULLA_INLINE Six operator-(const Six& a, const Six& b) {
  return {a.rows0 - b.rows0, a.rows4 - b.rows4};
}
// f a + b
MEDULLA_INLINE Six fma(Lanes f, const Six& a, const Six& b) {
  return {fma(f, a.rows0, b.rows0), _mm_fmadd_pd(_mm256_castpd256_pd128(f), a.rows4, b.rows4)};
}
MEDULLA_INLINE Six operator*(Lanes f, const Six& a) {
  return {f * a.rows0, _mm256_castpd256_pd128(f) * a.rows4};
}

namespace block6 {

// (rows 4, 5, 0, 1) of a column whose rows 0-3 and 2-5 are given.
MEDULLA_INLINE Lanes rowsAcross(Lanes rows0, Lanes rows2) {
  return _mm256_permute2f128_pd(rows0, rows2, 0x03);
}

// Of six numbers, each twice: (0 0 1 1), (2 2 3 3), (4 4 5 5).
MEDULLA_INLINE void eachTwice(const double* x, Lanes (&pairs)[3]) {
  for (int p = 0; p < 3; ++p)
    pairs[p] = _mm256_permute_pd(_mm256_broadcast_pd(reinterpret_cast<const __m128d*>(x + 2 * p)), 0xC);
}

}  // namespace block6

// a x; `x` holds six.
MEDULLA_INLINE Six product(const Block6& a, const double* x) {
  Lanes pairs[3], first = splat(0), across = splat(0), second = splat(0);
  block6::eachTwice(x, pairs);
  for (int p = 0; p < 3; ++p) {
    const double* columns = a.data() + 12 * p;
    first = fma(_mm256_loadu_pd(columns), _mm256_broadcast_sd(&x[2 * p]), first);
    across = fma(_mm256_loadu_pd(columns + 4), pairs[p], across);
    second = fma(_mm256_loadu_pd(columns + 8), _mm256_broadcast_sd(&x[2 * p + 1]), second);
  }
  return {first + _mm256_permute2f128_pd(across, second, 0x21),
          _mm256_castpd256_pd128(across) + _mm256_extractf128_pd(second, 1)};
}

// a^T x; `x` holds six.
MEDULLA_INLINE Six transposedProduct(const Block6& a, const double* x) {
  const Lanes x0 = _mm256_loadu_pd(x), x2 = _mm256_loadu_pd(x + 2), x4 = block6::rowsAcross(x0, x2);
  __m128d sums[3];
  for (int p = 0; p < 3; ++p) {
    const double* columns = a.data() + 12 * p;
    const Lanes halves = _mm256_hadd_pd(_mm256_loadu_pd(columns) * x0, _mm256_loadu_pd(columns + 8) * x2);
    const Lanes across = _mm256_loadu_pd(columns + 4) * x4;
    const __m128d ends = _mm_hadd_pd(_mm256_castpd256_pd128(across), _mm256_extractf128_pd(across, 1));
    sums[p] = (_mm256_castpd256_pd128(halves) + _mm256_extractf128_pd(halves, 1)) + ends;
  }
  return {_mm256_set_m128d(sums[1], sums[0]), sums[2]};
}

// to -= a b^T
MEDULLA_INLINE void subtractProductWithTransposed(const Block6& a, const Block6& b, Block6& to) {
  Lanes sum[9];
  for (int k = 0; k < 9; ++k) sum[k] = _mm256_loadu_pd(to.data() + 4 * k);
  for (int j = 0; j < 6; ++j) {
    const double *column = a.data() + 6 * j, *factors = b.data() + 6 * j;
    const Lanes rows0 = _mm256_loadu_pd(column), rows2 = _mm256_loadu_pd(column + 2);
    const Lanes across = block6::rowsAcross(rows0, rows2);
    Lanes pairs[3];
    block6::eachTwice(factors, pairs);
    for (int p = 0; p < 3; ++p) {
      sum[3 * p] = fnma(rows0, _mm256_broadcast_sd(factors + 2 * p), sum[3 * p]);
      sum[3 * p + 1] = fnma(across, pairs[p], sum[3 * p + 1]);
      sum[3 * p + 2] = fnma(rows2, _mm256_broadcast_sd(factors + 2 * p + 1), sum[3 * p + 2]);
    }
  }
  for (int k = 0; k < 9; ++k) _mm256_storeu_pd(to.data() + 4 * k, sum[k]);
}

// b := b u, with `u` upper.
MEDULLA_INLINE void multiplyByUpper(const Block6& u, Block6& b) {
  Six columns[6];
  for (int j = 0; j < 6; ++j) columns[j] = loadSix(b.data() + 6 * j);
  for (int j = 0; j < 6; ++j) {
    Six sum = splatSix(0);
    for (int k = 0; k <= j; ++k) sum = fma(splat(u(k, j)), columns[k], sum);
    storeSix(b.data() + 6 * j, sum);
  }
}

namespace block6 {

// Element k, in all lanes.
template <int k>
MEDULLA_INLINE Lanes element(const Six& a) {
  if constexpr (k < 4)
    return splatLane<k>(a.rows0);
  else
    return _mm256_broadcastsd_pd(_mm_permute_pd(a.rows4, k == 5 ? 3 : 0));
}
// `a` with the elements of `b` where the bits of `which` are set.
template <int which>
MEDULLA_INLINE Six with(const Six& a, const Six& b) {
  return {_mm256_blend_pd(a.rows0, b.rows0, which & 15), _mm_blend_pd(a.rows4, b.rows4, which >> 4)};
}

// Takes multiples of `row` off the rows from i on; element k of these begins anew.
template <int k, int i>
MEDULLA_INLINE void reduceRows(const Six& minusMultiples, const Six& row, Six (&rows)[6]) {
  if constexpr (i < 6) {
    rows[i] = fma(element<i>(minusMultiples), row, with<1 << k>(rows[i], splatSix(0)));
    reduceRows<k, i + 1>(minusMultiples, row, rows);
  }
}
template <int k>
MEDULLA_INLINE void eliminate(Six (&rows)[6], Six& pivots) {
  if constexpr (k < 6) {
    const Lanes pivot = element<k>(rows[k]);
    pivots = with<1 << k>(pivots, {pivot, _mm256_castpd256_pd128(pivot)});
    const Six row = with<1 << k>(rows[k], splatSix(1));
    reduceRows<k, k + 1>((splat(-1) / pivot) * rows[k], row, rows);
    rows[k] = with<(0x3E << k) & 0x3F>(row, splatSix(0));
    eliminate<k + 1>(rows, pivots);
  }
}
template <int k>
MEDULLA_INLINE void storeScaled(const Six& scale, const Six (&rows)[6], double* to) {
  if constexpr (k < 6) {
    storeSix(to + 6 * k, element<k>(scale) * rows[k]);
    storeScaled<k + 1>(scale, rows, to);
  }
}

}  // namespace block6

// a := L^-T of a = L L^T, upper. False where a pivot is not positive. Only the lower triangle is read.
//
// Gauss's elimination of a = U^T D U, with U^-T in the place of what it empties: row i of six numbers holds, from the
// diagonal on, row i of what is left of `a`, and before it row i of U^-T, which takes the same multiples of the rows
// above. A single division stands between one pivot and the next; the roots of all of them, L = U^T sqrt(D), come last.
inline bool invertFactor(Block6& a) {
  Six rows[6], pivots = splatSix(0);
  for (int i = 0; i < 6; ++i) rows[i] = loadSix(a.data() + 6 * i);
  block6::eliminate<0>(rows, pivots);
  block6::storeScaled<0>({splat(1) / squareRoot(pivots.rows0), _mm_set1_pd(1) / _mm_sqrt_pd(pivots.rows4)}, rows,
                         a.data());
  return _mm256_movemask_pd(isLess(splat(0), pivots.rows0)) == 15 &&
         _mm_movemask_pd(_mm_cmplt_pd(_mm_setzero_pd(), pivots.rows4)) == 3;
}

}  // namespace medulla
