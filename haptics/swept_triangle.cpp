#include "haptics/swept_triangle.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace medulla {

using Eigen::Vector3d;

// Below this squared ratio of height to length a triangle is a needle without a usable normal.
static constexpr double kDegenerateArea = 1e-20;

static bool isDegenerate(const Vector3d& ab, const Vector3d& ac, const Vector3d& doubleArea) {
  const double longest = std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
  return doubleArea.squaredNorm() <= kDegenerateArea * longest * longest;
}

static TrianglePoint closestOnEdges(const Triangle& triangle, const Vector3d& p) {
  const Vector3d* corners[3] = {&triangle.a, &triangle.b, &triangle.c};
  TrianglePoint best{triangle.a, Vector3d::UnitX()};
  double bestDistance = (p - triangle.a).squaredNorm();
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    const Vector3d edge = *corners[next] - *corners[k];
    const double length2 = edge.squaredNorm();
    const double along = length2 > 0 ? std::clamp((p - *corners[k]).dot(edge) / length2, 0.0, 1.0) : 0;
    const Vector3d q = *corners[k] + along * edge;
    if ((p - q).squaredNorm() >= bestDistance) continue;
    bestDistance = (p - q).squaredNorm();
    best.point = q;
    best.weights.setZero();
    best.weights[k] = 1 - along;
    best.weights[next] = along;
  }
  return best;
}

// By Voronoi regions (Ericson, Real-Time Collision Detection, 2005, 5.1.5).
TrianglePoint closestPoint(const Triangle& triangle, const Vector3d& p) {
  const Vector3d ab = triangle.b - triangle.a, ac = triangle.c - triangle.a;
  if (isDegenerate(ab, ac, ab.cross(ac))) return closestOnEdges(triangle, p);
  const auto at = [&](double wa, double wb, double wc) {
    return TrianglePoint{triangle.a + wb * ab + wc * ac, {wa, wb, wc}};
  };
  const Vector3d ap = p - triangle.a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return at(1, 0, 0);
  const Vector3d bp = p - triangle.b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return at(0, 1, 0);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return at(1 - d1 / (d1 - d3), d1 / (d1 - d3), 0);
  const Vector3d cp = p - triangle.c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return at(0, 0, 1);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return at(1 - d2 / (d2 - d6), 0, d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double alongBC = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return at(0, 1 - alongBC, alongBC);
  }
  const double scale = 1 / (va + vb + vc), wb = vb * scale, wc = vc * scale;
  return at(1 - wb - wc, wb, wc);
}

// Smaller root of a t^2 + 2 b t + c with c >= 0 and b < 0, in the form without cancellation: the sign of t is that of
// c. Negative without a root.
static double firstRoot(double a, double b, double c) {
  const double discriminant = b * b - a * c;
  return discriminant < 0 ? -1 : c / (-b + std::sqrt(discriminant));
}

// Edges and corners. A centre that starts inside an edge's infinite cylinder enters the rounded triangle through a
// corner's sphere, so that edge need not be tested.
static bool sweepRim(const Vector3d& centre, const Vector3d& motion, double radius, const Triangle& triangle,
                     double tMax, SweepHit& hit) {
  const Vector3d* corners[3] = {&triangle.a, &triangle.b, &triangle.c};
  const double motion2 = motion.squaredNorm(), radius2 = radius * radius;
  bool found = false;
  double best = tMax;
  for (int k = 0; k < 3; ++k) {
    const Vector3d edge = *corners[(k + 1) % 3] - *corners[k], m = centre - *corners[k];
    const double ee = edge.squaredNorm(), ed = edge.dot(motion), em = edge.dot(m), dm = m.dot(motion);
    const double mm = m.squaredNorm();
    if (dm < 0 && mm >= radius2) {
      const double t = firstRoot(motion2, dm, mm - radius2);
      if (t >= 0 && t <= best) {
        best = t;
        hit = {t, (m + t * motion).normalized()};
        found = true;
      }
    }
    const double a = ee * motion2 - ed * ed, b = ee * dm - em * ed, c = ee * (mm - radius2) - em * em;
    if (a <= 1e-30 * ee * motion2 || b >= 0 || c < 0) continue;
    const double t = firstRoot(a, b, c), along = em + t * ed;
    if (t >= 0 && t <= best && along >= 0 && along <= ee) {
      best = t;
      hit = {t, (m + t * motion - (along / ee) * edge).normalized()};
      found = true;
    }
  }
  return found;
}

static bool isInside(const Triangle& triangle, const Vector3d& normal, const Vector3d& q) {
  return normal.dot((triangle.b - triangle.a).cross(q - triangle.a)) >= 0 &&
         normal.dot((triangle.c - triangle.b).cross(q - triangle.b)) >= 0 &&
         normal.dot((triangle.a - triangle.c).cross(q - triangle.c)) >= 0;
}

bool sweepSphere(const Vector3d& centre, const Vector3d& motion, double radius, const Triangle& triangle, double tMax,
                 SweepHit& hit) {
  const Vector3d ab = triangle.b - triangle.a, ac = triangle.c - triangle.a;
  Vector3d doubleArea = ab.cross(ac);
  const bool hasFace = !isDegenerate(ab, ac, doubleArea);
  const double touching = radius * (1 + 5e-10);
  if (hasFace) {
    const Vector3d normal = doubleArea / doubleArea.norm();
    const double height = normal.dot(centre - triangle.a), side = height < 0 ? -1 : 1;
    const double distance = side * height, approach = -side * normal.dot(motion);
    if (distance >= touching) {
      if (approach <= 0) return false;
      const double t = (distance - radius) / approach;
      if (t > tMax) return false;
      if (isInside(triangle, normal, centre + t * motion)) {
        hit = {t, side * normal};
        return true;
      }
      return sweepRim(centre, motion, radius, triangle, tMax, hit);
    }
  }
  const Vector3d away = centre - closestPoint(triangle, centre).point;
  const double distance = away.norm();
  if (distance >= touching) return sweepRim(centre, motion, radius, triangle, tMax, hit);
  // The centre lies in the triangle's plane exactly: either side is as good.
  const Vector3d normal = distance > 0 ? Vector3d(away / distance) : Vector3d(doubleArea.normalized());
  if (normal.dot(motion) >= 0) return false;
  hit = {0, normal};
  return true;
}

}  // namespace medulla
