#pragma once

#include <Eigen/Core>
#include <cmath>

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
MEDULLA_INLINE Six operator-(const Six& a, const Six& b) {
  return {a.rows0 - b.rows0, a.rows4 - b.rows4};
}
// f a + b
MEDULLA_INLINE Six fma(double f, const Six& a, const Six& b) {
  return {fma(splat(f), a.rows0, b.rows0), _mm_fmadd_pd(_mm_set1_pd(f), a.rows4, b.rows4)};
}

namespace block6 {

// (rows 4, 5, 0, 1) of a column whose rows 0-3 and 2-5 are given.
MEDULLA_INLINE Lanes rowsAcross(Lanes rows0, Lanes rows2) {
  return _mm256_permute2f128_pd(rows0, rows2, 0x03);
}

// Of six numbers, each twice: (0 0 1 1), (2 2 3 3), (4 4 5 5).
MEDULLA_INLINE void eachTwice(const double* x, Lanes (&pairs)[3]) {
  const Lanes x0 = _mm256_loadu_pd(x);
  pairs[0] = _mm256_permute4x64_pd(x0, 0x50);
  pairs[1] = _mm256_permute4x64_pd(x0, 0xFA);
  pairs[2] = _mm256_permute4x64_pd(_mm256_loadu_pd(x + 2), 0xFA);
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
    Six sum{splat(0), _mm_setzero_pd()};
    for (int k = 0; k <= j; ++k) sum = fma(u(k, j), columns[k], sum);
    storeSix(b.data() + 6 * j, sum);
  }
}

// a := L^-T of a = L L^T, upper. False where a pivot is not positive. Only the lower triangle is read.
inline bool invertFactor(Block6& a) {
  double inverse[6];
  for (int j = 0; j < 6; ++j) {
    double* column = a.data() + 6 * j;
    if (!(column[j] > 0)) return false;
    inverse[j] = 1 / std::sqrt(column[j]);
    const Six scaled = fma(inverse[j], loadSix(column), {splat(0), _mm_setzero_pd()});
    storeSix(column, scaled);
    for (int k = j + 1; k < 6; ++k)
      storeSix(column + 6 * (k - j), fma(-column[k], scaled, loadSix(column + 6 * (k - j))));
  }
  // Row i of L^-1 is (unit i - sum over k < i of L(i, k) row k) / L(i, i); it becomes column i.
  const Block6 l = a;
  for (int i = 0; i < 6; ++i) {
    Vector6 unit = Vector6::Zero();
    unit[i] = inverse[i];
    Six row = loadSix(unit.data());
    for (int k = 0; k < i; ++k) row = fma(-inverse[i] * l(i, k), loadSix(a.data() + 6 * k), row);
    storeSix(a.data() + 6 * i, row);
  }
  return true;
}

}  // namespace medulla
