#include "physics/model/self_intersection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace medulla {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Distances from a plane below this fraction of the triangles' size count as zero: rounding of double coordinates is
// about 1e-13 of it, wanted crossings are far above.
constexpr double kOnPlane = 1e-10;
// A triangle lower than this fraction of its longest edge has no plane worth speaking of.
constexpr double kNoArea = 1e-9;
// A common segment shorter than this fraction of the triangles' size is a touch.
constexpr double kTouch = 1e-6;

struct Corners {
  std::array<Vector3d, 3> point;
  std::array<bool, 3> shared;  // with the other triangle
  Vector3d normal;             // unit, zero without area
};

double longestEdge(const Corners& c) {
  return std::max(
      {(c.point[1] - c.point[0]).norm(), (c.point[2] - c.point[1]).norm(), (c.point[0] - c.point[2]).norm()});
}

Corners cornersOf(const TriangleMesh& mesh, int triangle, int other) {
  Corners c;
  const std::array<int, 3>&t = mesh.triangles[triangle], &o = mesh.triangles[other];
  // About a corner of the lower triangle, so that the test does not lose digits far from the origin.
  const Vector3d& origin = mesh.vertices[mesh.triangles[std::min(triangle, other)][0]];
  for (int k = 0; k < 3; ++k) {
    c.point[k] = mesh.vertices[t[k]] - origin;
    c.shared[k] = std::find(o.begin(), o.end(), t[k]) != o.end();
  }
  const Vector3d area = (c.point[1] - c.point[0]).cross(c.point[2] - c.point[0]);
  const double longest = longestEdge(c);
  c.normal.setZero();
  if (area.norm() > kNoArea * longest * longest) c.normal = area.normalized();
  return c;
}

// Signed distances of `c` from the plane of `plane`.
std::array<double, 3> distances(const Corners& c, const Corners& plane, double zero) {
  std::array<double, 3> d;
  for (int k = 0; k < 3; ++k) {
    d[k] = plane.normal.dot(c.point[k] - plane.point[0]);
    if (c.shared[k] || std::abs(d[k]) < zero) d[k] = 0;
  }
  return d;
}

struct Interval {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  bool straddles = false;  // the triangle has corners strictly on both sides
  void add(double t) {
    low = std::min(low, t);
    high = std::max(high, t);
  }
};

// Where the line `along`, common to both planes, runs inside the triangle.
Interval intervalOnLine(const Corners& c, const std::array<double, 3>& d, const Vector3d& along) {
  Interval interval;
  for (int k = 0; k < 3; ++k) {
    const int n = (k + 1) % 3;
    const double here = along.dot(c.point[k]);
    if (d[k] == 0) interval.add(here);
    if ((d[k] < 0 && d[n] > 0) || (d[k] > 0 && d[n] < 0)) {
      interval.straddles = true;
      interval.add(here + (along.dot(c.point[n]) - here) * d[k] / (d[k] - d[n]));
    }
  }
  return interval;
}

double cross(const Vector2d& a, const Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// Half the perimeter of the overlap of two triangles in one plane, 0 where they share no area. Sutherland and Hodgman
// 1974: the first is clipped by the sides of the second.
double coplanarOverlap(const Corners& first, const Corners& second, double size) {
  const Vector3d u = (first.point[1] - first.point[0]).normalized(), v = first.normal.cross(u);
  const auto flat = [&](const Vector3d& p) { return Vector2d(u.dot(p), v.dot(p)); };
  std::vector<Vector2d> polygon, clipped;
  for (const auto& p : first.point) polygon.push_back(flat(p));
  std::array<Vector2d, 3> window{flat(second.point[0]), flat(second.point[1]), flat(second.point[2])};
  if (cross(window[1] - window[0], window[2] - window[0]) < 0) std::swap(window[1], window[2]);
  for (int k = 0; k < 3; ++k) {
    const Vector2d origin = window[k], side = window[(k + 1) % 3] - origin;
    clipped.clear();
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      const double da = cross(side, a - origin), db = cross(side, b - origin);
      if (da >= 0) clipped.push_back(a);
      if ((da > 0 && db < 0) || (da < 0 && db > 0)) clipped.emplace_back(a + (b - a) * (da / (da - db)));
    }
    polygon.swap(clipped);
  }
  double area = 0, perimeter = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    area += 0.5 * cross(a - polygon[0], b - polygon[0]);
    perimeter += (b - a).norm();
  }
  return area > kTouch * size * perimeter ? perimeter / 2 : 0;
}

// Length of the common segment, 0 where the triangles do not cut each other.
double cutLength(const TriangleMesh& mesh, int triangle0, int triangle1) {
  const Corners a = cornersOf(mesh, triangle0, triangle1), b = cornersOf(mesh, triangle1, triangle0);
  if (a.normal.isZero() || b.normal.isZero()) return 0;
  const double size = std::max(longestEdge(a), longestEdge(b));
  const auto da = distances(a, b, kOnPlane * size), db = distances(b, a, kOnPlane * size);
  const auto oneSided = [](const std::array<double, 3>& d) {
    return (d[0] > 0 && d[1] > 0 && d[2] > 0) || (d[0] < 0 && d[1] < 0 && d[2] < 0);
  };
  const auto inPlane = [](const std::array<double, 3>& d) { return d[0] == 0 && d[1] == 0 && d[2] == 0; };
  if (oneSided(da) || oneSided(db)) return 0;
  if (inPlane(da) || inPlane(db)) return coplanarOverlap(a, b, size);
  // Neighbours over an edge in different planes meet in that edge and nowhere else.
  if (std::count(a.shared.begin(), a.shared.end(), true) >= 2) return 0;
  const Vector3d line = a.normal.cross(b.normal);
  if (line.norm() < kOnPlane) return 0;
  const Vector3d along = line.normalized();
  const Interval ia = intervalOnLine(a, da, along), ib = intervalOnLine(b, db, along);
  // Two edges that lie on each other only touch: one of the two must reach through the other's plane.
  if (!ia.straddles && !ib.straddles) return 0;
  const double length = std::min(ia.high, ib.high) - std::max(ia.low, ib.low);
  return length > kTouch * size ? length : 0;
}

struct Box {
  Vector3d low, high;
};

}  // namespace

std::vector<TriangleCut> findSelfIntersections(const TriangleMesh& mesh) {
  std::vector<Box> boxes;
  boxes.reserve(mesh.triangles.size());
  Vector3d extentLow = Vector3d::Constant(std::numeric_limits<double>::infinity()), extentHigh = -extentLow;
  for (const auto& t : mesh.triangles) {
    const Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    boxes.push_back({a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)});
    extentLow = extentLow.cwiseMin(boxes.back().low);
    extentHigh = extentHigh.cwiseMax(boxes.back().high);
  }
  // Sweep and prune: along the longest axis of a body of n triangles about sqrt(n) others overlap each one.
  int axis = 0;
  (extentHigh - extentLow).maxCoeff(&axis);
  std::vector<int> order(boxes.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int i, int j) {
    return boxes[i].low[axis] != boxes[j].low[axis] ? boxes[i].low[axis] < boxes[j].low[axis] : i < j;
  });
  std::vector<TriangleCut> cuts;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Box& box = boxes[order[i]];
    for (std::size_t j = i + 1; j < order.size() && boxes[order[j]].low[axis] <= box.high[axis]; ++j) {
      const Box& other = boxes[order[j]];
      if ((other.low.array() > box.high.array()).any() || (box.low.array() > other.high.array()).any()) continue;
      const int triangle0 = std::min(order[i], order[j]), triangle1 = std::max(order[i], order[j]);
      const double length = cutLength(mesh, triangle0, triangle1);
      if (length > 0) cuts.push_back({triangle0, triangle1, length});
    }
  }
  std::sort(cuts.begin(), cuts.end(), [](const TriangleCut& a, const TriangleCut& b) {
    return a.triangle0 != b.triangle0 ? a.triangle0 < b.triangle0 : a.triangle1 < b.triangle1;
  });
  return cuts;
}

}  // namespace medulla
