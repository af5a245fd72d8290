#pragma once

#include <immintrin.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

// Four doubles at a time. The baseline is x86-64-v3 (AVX2 and FMA): a fused multiply-add is always asked for by name
// and never contracted by the compiler, so that results do not depend on compiler or options. No libm: its variants are
// chosen at run time by processor.
namespace medulla {

// For functions whose results are dozens of registers: through memory they would cost more than what they compute.
#define MEDULLA_INLINE [[gnu::always_inline]] inline

using Lanes = __m256d;  // + - * / and [] are the compilers' own

struct Lanes3 {
  Lanes x, y, z;  // a vector in each of the four lanes
};

// Number by number: g++ 12 copies such a structure through general registers, eight bytes at a time.
inline void put(const Lanes3& from, Lanes3& to) {
  to.x = from.x;
  to.y = from.y;
  to.z = from.z;
}

// Four doubles in memory: a vector and a spare, a quaternion x,y,z,w, or one number for each of four objects.
struct alignas(32) Quad {
  double v[4] = {0, 0, 0, 0};
};

inline Lanes load(const Quad& q) {
  return _mm256_load_pd(q.v);
}
inline void store(Quad& q, Lanes a) {
  _mm256_store_pd(q.v, a);
}
inline void addTo(Quad& q, Lanes a) {
  store(q, load(q) + a);
}
inline Lanes splat(double a) {
  return _mm256_set1_pd(a);
}
inline Lanes3 splat(const Quad& q) {
  return {splat(q.v[0]), splat(q.v[1]), splat(q.v[2])};
}
inline Lanes3 zeroVectors() {
  return {splat(0), splat(0), splat(0)};
}
template <int lane>
inline Lanes splatLane(Lanes a) {
  return _mm256_permute4x64_pd(a, lane * 0x55);
}
inline Lanes3 splatLane(const Lanes3& a, int lane) {
  return {splat(a.x[lane]), splat(a.y[lane]), splat(a.z[lane])};
}

inline Lanes fma(Lanes a, Lanes b, Lanes c) {
  return _mm256_fmadd_pd(a, b, c);
}  // a b + c
inline Lanes fnma(Lanes a, Lanes b, Lanes c) {
  return _mm256_fnmadd_pd(a, b, c);
}  // c - a b
// c0 + x (c1 + x (c2 + ...))
inline Lanes polynomial(Lanes, double last) {
  return splat(last);
}
template <class... Rest>
inline Lanes polynomial(Lanes x, double c0, Rest... rest) {
  return fma(polynomial(x, rest...), x, splat(c0));
}
inline Lanes squareRoot(Lanes a) {
  return _mm256_sqrt_pd(a);
}
inline Lanes larger(Lanes a, Lanes b) {
  return _mm256_max_pd(a, b);
}
inline Lanes smaller(Lanes a, Lanes b) {
  return _mm256_min_pd(a, b);
}
inline Lanes nearest(Lanes a) {
  return _mm256_round_pd(a, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
}
inline Lanes magnitude(Lanes a) {
  return _mm256_andnot_pd(splat(-0.0), a);
}
inline Lanes withSignOf(Lanes a, Lanes sign) {
  return _mm256_or_pd(magnitude(a), _mm256_and_pd(splat(-0.0), sign));
}
inline Lanes isLess(Lanes a, Lanes b) {
  return _mm256_cmp_pd(a, b, _CMP_LT_OQ);
}
inline Lanes select(Lanes condition, Lanes yes, Lanes no) {
  return _mm256_blendv_pd(no, yes, condition);
}
// 0 where the condition does not hold. Of another condition: where both hold.
inline Lanes masked(Lanes condition, Lanes a) {
  return _mm256_and_pd(condition, a);
}
inline Lanes3 masked(Lanes condition, const Lanes3& a) {
  return {masked(condition, a.x), masked(condition, a.y), masked(condition, a.z)};
}
inline bool any(Lanes condition) {
  return _mm256_movemask_pd(condition) != 0;
}
inline double largestOfLanes(Lanes a) {
  return std::max(std::max(a[0], a[1]), std::max(a[2], a[3]));
}
inline double sumOfLanes(Lanes a) {
  return (a[0] + a[1]) + (a[2] + a[3]);
}

inline Lanes3 operator+(const Lanes3& a, const Lanes3& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Lanes3 operator-(const Lanes3& a, const Lanes3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Lanes3 operator*(Lanes s, const Lanes3& a) {
  return {s * a.x, s * a.y, s * a.z};
}
inline Lanes3 fma(Lanes s, const Lanes3& a, const Lanes3& b) {
  return {fma(s, a.x, b.x), fma(s, a.y, b.y), fma(s, a.z, b.z)};
}
inline Lanes3 fnma(Lanes s, const Lanes3& a, const Lanes3& b) {
  return {fnma(s, a.x, b.x), fnma(s, a.y, b.y), fnma(s, a.z, b.z)};
}
inline Lanes dot(const Lanes3& a, const Lanes3& b) {
  return fma(a.z, b.z, fma(a.y, b.y, a.x * b.x));
}
inline Lanes3 cross(const Lanes3& a, const Lanes3& b) {
  return {fnma(a.z, b.y, a.y * b.z), fnma(a.x, b.z, a.z * b.x), fnma(a.y, b.x, a.x * b.y)};
}

// Four objects of four numbers <-> four lanes of each number.
inline void transpose(Lanes& a, Lanes& b, Lanes& c, Lanes& d) {
  const Lanes ab0 = _mm256_unpacklo_pd(a, b), ab1 = _mm256_unpackhi_pd(a, b);
  const Lanes cd0 = _mm256_unpacklo_pd(c, d), cd1 = _mm256_unpackhi_pd(c, d);
  a = _mm256_permute2f128_pd(ab0, cd0, 0x20);
  b = _mm256_permute2f128_pd(ab1, cd1, 0x20);
  c = _mm256_permute2f128_pd(ab0, cd0, 0x31);
  d = _mm256_permute2f128_pd(ab1, cd1, 0x31);
}
inline Lanes3 gather(const Quad& q0, const Quad& q1, const Quad& q2, const Quad& q3, Lanes& fourth) {
  Lanes a = load(q0), b = load(q1), c = load(q2), d = load(q3);
  transpose(a, b, c, d);
  fourth = d;
  return {a, b, c};
}
inline Lanes3 gather(const Quad& q0, const Quad& q1, const Quad& q2, const Quad& q3) {
  Lanes unused;
  return gather(q0, q1, q2, q3, unused);
}
inline void scatter(const Lanes3& v, Lanes fourth, Quad& q0, Quad& q1, Quad& q2, Quad& q3) {
  Lanes a = v.x, b = v.y, c = v.z, d = fourth;
  transpose(a, b, c, d);
  store(q0, a);
  store(q1, b);
  store(q2, c);
  store(q3, d);
}
// Sums over the lanes of four: one result per lane.
inline Lanes sumsOfLanes(Lanes a, Lanes b, Lanes c, Lanes d) {
  const Lanes ab = _mm256_hadd_pd(a, b), cd = _mm256_hadd_pd(c, d);
  return _mm256_permute2f128_pd(ab, cd, 0x20) + _mm256_permute2f128_pd(ab, cd, 0x31);
}
inline Lanes sumOfLanes(const Lanes3& v, Lanes w) {
  return sumsOfLanes(v.x, v.y, v.z, w);
}
inline Lanes sumOfLanes(const Lanes3& v) {
  return sumOfLanes(v, splat(0));
}

// Columns of the rotation of a unit quaternion.
struct Rotation {
  Lanes3 x, y, z;
};
inline Rotation rotationOf(const Lanes3& q, Lanes w) {
  const Lanes two = splat(2), one = splat(1);
  const Lanes3 d = two * q;
  const Lanes xx = q.x * d.x, yy = q.y * d.y, zz = q.z * d.z, xy = q.x * d.y, xz = q.x * d.z, yz = q.y * d.z;
  const Lanes wx = w * d.x, wy = w * d.y, wz = w * d.z;
  return {
      {one - (yy + zz), xy + wz, xz - wy}, {xy - wz, one - (xx + zz), yz + wx}, {xz + wy, yz - wx, one - (xx + yy)}};
}
inline Lanes3 rotate(const Rotation& r, const Lanes3& a) {
  return fma(a.z, r.z, fma(a.y, r.y, a.x * r.x));
}
inline Lanes3 rotateBack(const Rotation& r, const Lanes3& a) {
  return {dot(r.x, a), dot(r.y, a), dot(r.z, a)};
}

// Vectors as (x, y, z, 0), one per register.
inline Lanes withoutFourth(Lanes a) {
  return _mm256_blend_pd(a, splat(0), 8);
}
inline Lanes turnedLanes(Lanes a) {  // y, z, x, w
  return _mm256_permute4x64_pd(a, _MM_SHUFFLE(3, 0, 2, 1));
}
inline Lanes crossProduct(Lanes a, Lanes b) {
  return turnedLanes(fnma(turnedLanes(a), b, a * turnedLanes(b)));
}
inline double dotProduct(Lanes a, Lanes b) {
  return sumOfLanes(a * b);
}

// The fourth number is zeroed: sums over whole quads rely on it.
inline Quad quadOf(const Eigen::Vector3d& a) {
  return {{a.x(), a.y(), a.z(), 0}};
}
inline Eigen::Vector3d vectorOf(const Quad& q) {
  return {q.v[0], q.v[1], q.v[2]};
}
inline Eigen::Vector3d vectorOf(const Lanes3& a, int lane) {
  return {a.x[lane], a.y[lane], a.z[lane]};
}
inline void setLane(Lanes3& to, int lane, const Eigen::Vector3d& a) {
  to.x[lane] = a.x();
  to.y[lane] = a.y();
  to.z[lane] = a.z();
}

// Vectors four to a group: the i-th of them all.
template <class Array>
Eigen::Vector3d vectorAt(const Array& groups, std::uint32_t i) {
  return vectorOf(groups[i / 4], static_cast<int>(i % 4));
}
template <class Array>
void setVector(Array& groups, std::uint32_t i, const Eigen::Vector3d& a) {
  setLane(groups[i / 4], static_cast<int>(i % 4), a);
}
// The four that begin at i between an array of quads and lanes.
template <class Array>
Lanes3 gatherFour(const Array& q, std::size_t i, Lanes& fourth) {
  return gather(q[i], q[i + 1], q[i + 2], q[i + 3], fourth);
}
template <class Array>
Lanes3 gatherFour(const Array& q, std::size_t i) {
  Lanes unused;
  return gatherFour(q, i, unused);
}
// Of four unit quaternions, x, y, z, w.
template <class Array>
Rotation rotationsFour(const Array& q, std::size_t i) {
  Lanes w;
  const Lanes3 axis = gatherFour(q, i, w);
  return rotationOf(axis, w);
}
template <class Array>
Lanes loadFour(const Array& numbers, std::size_t i) {
  return _mm256_loadu_pd(&numbers[i]);
}
template <class Array>
void storeFour(const Lanes3& v, Lanes fourth, Array& q, std::size_t i) {
  scatter(v, fourth, q[i], q[i + 1], q[i + 2], q[i + 3]);
}
template <class Array>
void storeFour(const Lanes3& v, Array& q, std::size_t i) {
  storeFour(v, splat(0), q, i);
}

}  // namespace medulla
