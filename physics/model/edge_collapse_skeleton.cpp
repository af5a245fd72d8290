#include "physics/model/edge_collapse_skeleton.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "physics/model/mesh_topology.h"

namespace medulla {

namespace {

// The mesh on its way to a skeleton. Every edge with a triangle is in `queue`; every edge without is in `skeletal`.
struct Complex {
  std::vector<Eigen::Vector3d> positions;
  std::vector<char> alive, fixed;
  std::vector<std::array<int, 3>> triangles;
  std::vector<std::set<int>> trianglesOf, neighbours;  // per node
  std::set<std::tuple<double, int, int>> queue;        // length, lower node, higher node
  std::set<std::array<int, 2>> skeletal;               // lower node first
};

std::tuple<double, int, int> queueKey(const Complex& c, int a, int b) {
  const auto [low, high] = edgeOf(a, b);
  return {(c.positions[low] - c.positions[high]).norm(), low, high};
}

Complex makeComplex(const TriangleMesh& mesh) {
  Complex c;
  c.positions = mesh.vertices;
  c.triangles = mesh.triangles;
  const std::size_t nodes = mesh.vertices.size();
  c.alive.assign(nodes, 0);
  c.fixed.assign(nodes, 0);
  c.trianglesOf.resize(nodes);
  c.neighbours.resize(nodes);
  for (std::size_t t = 0; t < c.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int a = c.triangles[t][k], b = c.triangles[t][(k + 1) % 3];
      c.alive[a] = 1;
      c.trianglesOf[a].insert(static_cast<int>(t));
      c.neighbours[a].insert(b);
      c.neighbours[b].insert(a);
      c.queue.insert(queueKey(c, a, b));
    }
  }
  return c;
}

bool hasNode(const std::array<int, 3>& t, int node) {
  return t[0] == node || t[1] == node || t[2] == node;
}

bool edgeHasTriangle(const Complex& c, int a, int b) {
  return std::any_of(c.trianglesOf[a].begin(), c.trianglesOf[a].end(),
                     [&](int t) { return hasNode(c.triangles[t], b); });
}

void removeTriangle(Complex& c, int t) {
  for (const int node : c.triangles[t]) c.trianglesOf[node].erase(t);
}

// Triangles at `gone` move to `kept`; those that held both are flat now, and of two with the same nodes one remains.
void mergeTriangles(Complex& c, int kept, int gone) {
  const std::set<int> moved = c.trianglesOf[gone];
  for (const int t : moved) {
    std::array<int, 3>& corners = c.triangles[t];
    if (hasNode(corners, kept)) {
      removeTriangle(c, t);
      continue;
    }
    std::replace(corners.begin(), corners.end(), gone, kept);
    c.trianglesOf[gone].erase(t);
    const bool twin = std::any_of(c.trianglesOf[kept].begin(), c.trianglesOf[kept].end(), [&](int other) {
      return std::is_permutation(corners.begin(), corners.end(), c.triangles[other].begin());
    });
    c.trianglesOf[kept].insert(t);
    if (twin) removeTriangle(c, t);
  }
}

void mergeSkeletalEdges(Complex& c, int kept, int gone) {
  for (const int other : c.neighbours[gone])
    if (c.skeletal.erase(edgeOf(gone, other)) > 0 && other != kept) c.skeletal.insert(edgeOf(kept, other));
}

void mergeNeighbours(Complex& c, int kept, int gone) {
  c.neighbours[kept].erase(gone);
  for (const int other : c.neighbours[gone]) {
    if (other == kept) continue;
    c.neighbours[other].erase(gone);
    c.neighbours[other].insert(kept);
    c.neighbours[kept].insert(other);
  }
  c.neighbours[gone].clear();
}

void collapse(Complex& c, int kept, int gone) {
  for (const int end : {kept, gone})
    for (const int other : c.neighbours[end]) c.queue.erase(queueKey(c, end, other));
  if (!c.fixed[kept])
    c.positions[kept] = c.fixed[gone] ? c.positions[gone] : ((c.positions[kept] + c.positions[gone]) / 2).eval();
  c.fixed[kept] = c.fixed[kept] | c.fixed[gone];
  c.alive[gone] = 0;
  mergeTriangles(c, kept, gone);
  mergeSkeletalEdges(c, kept, gone);
  mergeNeighbours(c, kept, gone);
  // Only edges at the merged node can have lost their last triangle.
  for (const int other : c.neighbours[kept])
    if (edgeHasTriangle(c, kept, other))
      c.queue.insert(queueKey(c, kept, other));
    else if (c.skeletal.insert(edgeOf(kept, other)).second)
      c.fixed[kept] = c.fixed[other] = 1;
}

Skeleton skeletonOf(const Complex& c) {
  Skeleton skeleton;
  std::map<int, int> number;
  for (std::size_t node = 0; node < c.positions.size(); ++node) {
    if (!c.alive[node]) continue;
    number[static_cast<int>(node)] = static_cast<int>(skeleton.nodes.size());
    skeleton.nodes.push_back(c.positions[node]);
  }
  for (const auto& [a, b] : c.skeletal) skeleton.links.push_back({number[a], number[b]});
  return skeleton;
}

}  // namespace

Skeleton collapseEdges(const TriangleMesh& mesh) {
  Complex c = makeComplex(mesh);
  while (!c.queue.empty()) {
    const auto [length, kept, gone] = *c.queue.begin();
    collapse(c, kept, gone);
  }
  return skeletonOf(c);
}

}  // namespace medulla
