#pragma once

#include <Eigen/Core>

#include "physics/dynamics/simd.h"

// Products of 6x6 blocks, column by column in memory, and vectors of six. Two columns fill three registers without a
// gap: rows 0-3 of the first; rows 4, 5 of the first and 0, 1 of the second; rows 2-5 of the second. Eigen takes each
// column as four and two, and twice to three times the instructions.
namespace medulla {

using Block6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

namespace block6 {

// (rows 4, 5, 0, 1) of a column whose rows 0-3 and 2-5 are given.
MEDULLA_INLINE Lanes rowsAcross(Lanes rows0, Lanes rows2) {
  return _mm256_permute2f128_pd(rows0, rows2, 0x03);
}
// (a a b b) of numbers 0 and 1, or 2 and 3, of four.
MEDULLA_INLINE Lanes lowerTwice(Lanes a) {
  return _mm256_permute4x64_pd(a, 0x50);
}
MEDULLA_INLINE Lanes upperTwice(Lanes a) {
  return _mm256_permute4x64_pd(a, 0xFA);
}

}  // namespace block6

// y -= a x
MEDULLA_INLINE void subtractProduct(const Block6& a, const Vector6& x, Vector6& y) {
  const double* m = a.data();
  const Lanes x0 = _mm256_loadu_pd(x.data()), x2 = _mm256_loadu_pd(x.data() + 2);
  const Lanes pairs[3] = {block6::lowerTwice(x0), block6::upperTwice(x0), block6::upperTwice(x2)};
  Lanes first = splat(0), across = splat(0), second = splat(0);
  for (int p = 0; p < 3; ++p) {
    first = fma(_mm256_loadu_pd(m + 12 * p), _mm256_broadcast_sd(&x[2 * p]), first);
    across = fma(_mm256_loadu_pd(m + 12 * p + 4), pairs[p], across);
    second = fma(_mm256_loadu_pd(m + 12 * p + 8), _mm256_broadcast_sd(&x[2 * p + 1]), second);
  }
  const Lanes rows0 = first + _mm256_permute2f128_pd(across, second, 0x21);
  const __m128d rows4 = _mm256_castpd256_pd128(across) + _mm256_extractf128_pd(second, 1);
  _mm256_storeu_pd(y.data(), _mm256_loadu_pd(y.data()) - rows0);
  _mm_storeu_pd(y.data() + 4, _mm_loadu_pd(y.data() + 4) - rows4);
}

// y -= a^T x
MEDULLA_INLINE void subtractTransposedProduct(const Block6& a, const Vector6& x, Vector6& y) {
  const double* m = a.data();
  const Lanes x0 = _mm256_loadu_pd(x.data()), x2 = _mm256_loadu_pd(x.data() + 2);
  const Lanes across = block6::rowsAcross(x0, x2);
  for (int p = 0; p < 3; ++p) {
    const Lanes first = _mm256_loadu_pd(m + 12 * p) * x0, middle = _mm256_loadu_pd(m + 12 * p + 4) * across,
                second = _mm256_loadu_pd(m + 12 * p + 8) * x2;
    const Lanes halves = _mm256_hadd_pd(first, second);
    const __m128d ends = _mm_hadd_pd(_mm256_castpd256_pd128(middle), _mm256_extractf128_pd(middle, 1));
    const __m128d sums = (_mm256_castpd256_pd128(halves) + _mm256_extractf128_pd(halves, 1)) + ends;
    _mm_storeu_pd(&y[2 * p], _mm_loadu_pd(&y[2 * p]) - sums);
  }
}

// to -= a b^T
MEDULLA_INLINE void subtractProductWithTransposed(const Block6& a, const Block6& b, Block6& to) {
  Lanes sum[9];
  for (int k = 0; k < 9; ++k) sum[k] = _mm256_loadu_pd(to.data() + 4 * k);
  for (int j = 0; j < 6; ++j) {
    const double *column = a.data() + 6 * j, *row = b.data() + 6 * j;
    const Lanes rows0 = _mm256_loadu_pd(column), rows2 = _mm256_loadu_pd(column + 2);
    const Lanes across = block6::rowsAcross(rows0, rows2);
    const Lanes b0 = _mm256_loadu_pd(row), b2 = _mm256_loadu_pd(row + 2);
    const Lanes pairs[3] = {block6::lowerTwice(b0), block6::upperTwice(b0), block6::upperTwice(b2)};
    for (int p = 0; p < 3; ++p) {
      sum[3 * p] = fnma(rows0, _mm256_broadcast_sd(row + 2 * p), sum[3 * p]);
      sum[3 * p + 1] = fnma(across, pairs[p], sum[3 * p + 1]);
      sum[3 * p + 2] = fnma(rows2, _mm256_broadcast_sd(row + 2 * p + 1), sum[3 * p + 2]);
    }
  }
  for (int k = 0; k < 9; ++k) _mm256_storeu_pd(to.data() + 4 * k, sum[k]);
}

// b := b l^-T, with `l` lower and its diagonal inverted.
MEDULLA_INLINE void divideByTransposed(const Block6& l, Block6& b) {
  Lanes rows0[6];
  __m128d rows4[6];
  for (int j = 0; j < 6; ++j) {
    rows0[j] = _mm256_loadu_pd(b.data() + 6 * j);
    rows4[j] = _mm_loadu_pd(b.data() + 6 * j + 4);
    for (int k = 0; k < j; ++k) {
      rows0[j] = fnma(splat(l(j, k)), rows0[k], rows0[j]);
      rows4[j] = _mm_fnmadd_pd(_mm_set1_pd(l(j, k)), rows4[k], rows4[j]);
    }
    rows0[j] = rows0[j] * splat(l(j, j));
    rows4[j] = rows4[j] * _mm_set1_pd(l(j, j));
    _mm256_storeu_pd(b.data() + 6 * j, rows0[j]);
    _mm_storeu_pd(b.data() + 6 * j + 4, rows4[j]);
  }
}

}  // namespace medulla
