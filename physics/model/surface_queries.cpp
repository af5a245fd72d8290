#include "physics/model/surface_queries.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "physics/model/mesh_topology.h"

namespace medulla {

using Eigen::Vector3d;

static constexpr int kLeafSize = 4;
static constexpr int kStackSize = 64;  // median splits keep the depth below 32

static int addNode(SurfaceTree& tree, const TriangleMesh& mesh, std::vector<int>& order, int begin, int end) {
  SurfaceTree::Node node;
  node.begin = begin;
  node.end = end;
  node.low.setConstant(std::numeric_limits<double>::infinity());
  node.high = -node.low;
  for (int i = begin; i < end; ++i) {
    for (const int corner : mesh.triangles[order[i]]) {
      node.low = node.low.cwiseMin(mesh.vertices[corner]);
      node.high = node.high.cwiseMax(mesh.vertices[corner]);
    }
  }
  const int index = static_cast<int>(tree.nodes.size());
  tree.nodes.push_back(node);
  if (end - begin <= kLeafSize) return index;

  int axis = 0;
  (node.high - node.low).maxCoeff(&axis);
  const int middle = (begin + end) / 2;
  std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end, [&](int a, int b) {
    const double ca = centroid(mesh, mesh.triangles[a])[axis], cb = centroid(mesh, mesh.triangles[b])[axis];
    return ca != cb ? ca < cb : a < b;
  });
  const int left = addNode(tree, mesh, order, begin, middle);
  const int right = addNode(tree, mesh, order, middle, end);
  tree.nodes[index].left = left;
  tree.nodes[index].right = right;
  return index;
}

SurfaceTree makeSurfaceTree(const TriangleMesh& mesh) {
  SurfaceTree tree;
  std::vector<int> order(mesh.triangles.size());
  std::iota(order.begin(), order.end(), 0);
  addNode(tree, mesh, order, 0, static_cast<int>(order.size()));
  for (const int t : order) {
    const std::array<int, 3>& c = mesh.triangles[t];
    tree.triangles.push_back(c);
    tree.corners.push_back({mesh.vertices[c[0]], mesh.vertices[c[1]], mesh.vertices[c[2]]});
  }
  return tree;
}

// Closest point on a triangle by the Voronoi regions of its corners and edges (Ericson 2005, Real-Time Collision
// Detection, 5.1.5).
Vector3d closestOnTriangle(const Vector3d& p, const std::array<Vector3d, 3>& t) {
  const Vector3d ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0];
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return t[0];
  const Vector3d bp = p - t[1];
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return t[1];
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return t[0] + d1 / (d1 - d3) * ab;
  const Vector3d cp = p - t[2];
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return t[2];
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return t[0] + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) return t[1] + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (t[2] - t[1]);
  const double sum = va + vb + vc;
  return t[0] + vb / sum * ab + vc / sum * ac;
}

static double squaredDistance(const SurfaceTree::Node& node, const Vector3d& p) {
  return (node.low - p).cwiseMax(p - node.high).cwiseMax(0).squaredNorm();
}

SurfacePoint closestPoint(const SurfaceTree& tree, const Vector3d& p, double within) {
  SurfacePoint best;
  double bestSquared = within * within;
  std::array<int, kStackSize> stack;
  int size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const SurfaceTree::Node& node = tree.nodes[stack[--size]];
    if (squaredDistance(node, p) >= bestSquared) continue;
    if (node.left < 0) {
      for (int i = node.begin; i < node.end; ++i) {
        const Vector3d q = closestOnTriangle(p, tree.corners[i]);
        const double squared = (p - q).squaredNorm();
        if (squared < bestSquared) {
          bestSquared = squared;
          best = {q, std::sqrt(squared)};
        }
      }
      continue;
    }
    const bool leftFirst = squaredDistance(tree.nodes[node.left], p) < squaredDistance(tree.nodes[node.right], p);
    stack[size++] = leftFirst ? node.right : node.left;
    stack[size++] = leftFirst ? node.left : node.right;
  }
  return best;
}

// Calls visit(triangle, in leaf order) for those of the leaves that are reached through nodes which all meet `enters`.
template <class Enters, class Visit>
static void visitLeaves(const SurfaceTree& tree, const Enters& enters, const Visit& visit) {
  std::array<int, kStackSize> stack;
  int size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const SurfaceTree::Node& node = tree.nodes[stack[--size]];
    if (!enters(node)) continue;
    if (node.left >= 0) {
      stack[size++] = node.left;
      stack[size++] = node.right;
      continue;
    }
    for (int i = node.begin; i < node.end; ++i) visit(i);
  }
}

void trianglesWithin(const SurfaceTree& tree, const Vector3d& p, double within, std::vector<TriangleDistance>& out) {
  const std::size_t first = out.size();
  const auto isNear = [&](const SurfaceTree::Node& node) { return squaredDistance(node, p) < within * within; };
  visitLeaves(tree, isNear, [&](int i) {
    const double distance = (p - closestOnTriangle(p, tree.corners[i])).norm();
    if (distance < within) out.push_back({i, distance});
  });
  std::sort(out.begin() + static_cast<std::ptrdiff_t>(first), out.end(),
            [](const TriangleDistance& a, const TriangleDistance& b) {
              return a.distance != b.distance ? a.distance < b.distance : a.triangle < b.triangle;
            });
}

// `inverse`: of the direction, infinite along an axis that the ray is perpendicular to: there 0 times it, of an origin
// on the box's very side, would be no number.
static bool meetsBox(const SurfaceTree::Node& node, const Vector3d& origin, const Vector3d& inverse, double reach) {
  double enter = 0, leave = reach;
  for (int a = 0; a < 3; ++a) {
    if (std::isinf(inverse[a])) {
      if (origin[a] < node.low[a] || origin[a] > node.high[a]) return false;
      continue;
    }
    const double t0 = (node.low[a] - origin[a]) * inverse[a], t1 = (node.high[a] - origin[a]) * inverse[a];
    enter = std::max(enter, std::min(t0, t1));
    leave = std::min(leave, std::max(t0, t1));
  }
  return enter <= leave * (1 + 1e-12) + 1e-12;
}

// Calls visit(distance, index in leaf order) for every triangle hit by the ray within reach (Moeller and Trumbore
// 1997).
template <typename Visit>
static void forEachHit(const SurfaceTree& tree, const Vector3d& origin, const Vector3d& direction, double reach,
                       const Visit& visit) {
  const Vector3d inverse = direction.cwiseInverse();
  const auto isMet = [&](const SurfaceTree::Node& node) { return meetsBox(node, origin, inverse, reach); };
  visitLeaves(tree, isMet, [&](int i) {
    const std::array<Vector3d, 3>& c = tree.corners[i];
    const Vector3d e1 = c[1] - c[0], e2 = c[2] - c[0], h = direction.cross(e2);
    const double determinant = e1.dot(h);
    if (determinant == 0) return;
    const Vector3d s = origin - c[0], q = s.cross(e1);
    const double u = s.dot(h) / determinant, v = direction.dot(q) / determinant, t = e2.dot(q) / determinant;
    if (u >= 0 && v >= 0 && u + v <= 1 && t > 0 && t < reach) visit(t, i);
  });
}

bool isInside(const SurfaceTree& tree, const Vector3d& p) {
  static const std::array<Vector3d, 3> directions = {Vector3d(0.5773, 0.6123, 0.5401), Vector3d(-0.7071, 0.123, 0.6963),
                                                     Vector3d(0.1234, -0.891, -0.4367)};
  const SurfaceTree::Node& root = tree.nodes[0];
  if ((p.array() < root.low.array()).any() || (p.array() > root.high.array()).any()) return false;
  const double reach = 4 * (root.high - root.low).norm();
  int votes = 0;
  for (const Vector3d& direction : directions) {
    int crossings = 0;
    forEachHit(tree, p, direction, reach, [&](double, int) { ++crossings; });
    votes += crossings & 1;
    if (votes == 2) return true;
  }
  return false;
}

double inscribedRadius(const SurfaceTree& tree, const Vector3d& p) {
  return isInside(tree, p) ? closestPoint(tree, p).distance : 0;
}

double firstHit(const SurfaceTree& tree, const Vector3d& origin, const Vector3d& direction, double reach) {
  double first = std::numeric_limits<double>::infinity();
  forEachHit(tree, origin, direction, reach, [&](double t, int) { first = std::min(first, t); });
  return first;
}

bool segmentCrosses(const SurfaceTree& tree, const Vector3d& inner, const Vector3d& outer, int vertex) {
  const double length = (outer - inner).norm();
  if (length == 0) return false;
  bool crosses = false;
  forEachHit(tree, inner, (outer - inner) / length, length, [&](double, int i) {
    const std::array<int, 3>& t = tree.triangles[i];
    crosses = crosses || (t[0] != vertex && t[1] != vertex && t[2] != vertex);
  });
  return crosses;
}

}  // namespace medulla
