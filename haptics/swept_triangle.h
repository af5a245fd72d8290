#pragma once

#include <Eigen/Geometry>

// Exact tests between a proxy sphere and a triangle, in double. The sweep of a sphere against a triangle is that of its
// centre against the rounded triangle: the triangle's two offset faces, a cylinder around each edge, a sphere around
// each corner. Degenerate triangles count as their edges.
namespace medulla {

struct Triangle {
  Eigen::Vector3d a, b, c;  // m
};

struct TrianglePoint {
  Eigen::Vector3d point;    // m
  Eigen::Vector3d weights;  // barycentric: point = weights.x a + weights.y b + weights.z c, each in 0..1, sum 1
};

// m2, along the normal.
inline Eigen::Vector3d doubleArea(const Triangle& t) {
  return (t.b - t.a).cross(t.c - t.a);
}

inline Eigen::Vector3d pointAt(const Triangle& t, const Eigen::Vector3d& weights) {
  return weights.x() * t.a + weights.y() * t.b + weights.z() * t.c;
}

TrianglePoint closestPoint(const Triangle& triangle, const Eigen::Vector3d& p);

struct SweepHit {
  double t = 1;            // 0..1 of the motion
  Eigen::Vector3d normal;  // unit, from the triangle to the sphere's centre at t
};

// First t in 0..tMax at which the sphere, moving from `centre` to `centre + motion`, touches the triangle. A sphere
// that touches or overlaps at the start (nearer than radius (1 + 5e-10)) hits at 0 when it approaches, else not at all:
// the two cases share one threshold, because a gap between them would let the proxy through. Whether a hit is found,
// and which, depends on tMax only in that later ones are dropped. Returns false and leaves `hit` alone without one.
bool sweepSphere(const Eigen::Vector3d& centre, const Eigen::Vector3d& motion, double radius, const Triangle& triangle,
                 double tMax, SweepHit& hit);

}  // namespace medulla
