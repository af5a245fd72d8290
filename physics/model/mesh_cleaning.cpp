#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <stdexcept>

#include "physics/model/disjoint_sets.h"
#include "physics/model/mesh_repair_stages.h"
#include "physics/model/mesh_topology.h"

namespace medulla {

namespace {

// Vertices closer than this fraction of the usual shortest edge are one. Relative to an edge and not to the bounding
// box, which a single stray vertex can blow up until the whole mesh is "close".
constexpr double kWeld = 1e-3;
// Open flaps of at most this share of the surface are fins; more would be a guess about which part is the body.
constexpr double kFinArea = 0.25;
// A triangle lower than this fraction of its longest edge has no area.
constexpr double kNoHeight = 1e-6;

// m, median over triangles: a fan's diagonals are long, and a tolerance by these would weld its rim to a point.
double medianShortestEdge(const TriangleMesh& mesh) {
  std::vector<double> lengths;
  for (const std::array<int, 3>& t : mesh.triangles) {
    double shortest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k)
      if (const double length = (mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm(); length > 0)
        shortest = std::min(shortest, length);
    if (std::isfinite(shortest)) lengths.push_back(shortest);
  }
  if (lengths.empty()) throw std::runtime_error("all triangles are points: the mesh encloses no volume");
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

// For every vertex the lowest one that it coincides with, through chains of neighbours within `tolerance`.
std::vector<int> lowestCoincident(const std::vector<Eigen::Vector3d>& points, double tolerance) {
  // Sweep along a direction in which flat faces of boxes and grids do not line up.
  const Eigen::Vector3d direction = Eigen::Vector3d(0.61, 0.53, 0.59).normalized();
  std::vector<double> along(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) along[i] = direction.dot(points[i]);
  std::vector<int> order(points.size()), lowest(points.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](int i, int j) { return along[i] != along[j] ? along[i] < along[j] : i < j; });
  DisjointSets sets(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    for (std::size_t j = i + 1; j < order.size() && along[order[j]] - along[order[i]] <= tolerance; ++j)
      if ((points[order[i]] - points[order[j]]).norm() <= tolerance) sets.join(order[i], order[j]);
  }
  for (std::size_t i = 0; i < points.size(); ++i) lowest[i] = sets.of(static_cast<int>(i));
  return lowest;
}

// Keeps the triangles for which keep(index) is true and says how many went.
template <typename Keep>
std::size_t filterTriangles(TriangleMesh& mesh, const Keep& keep) {
  std::vector<std::array<int, 3>> kept;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (keep(t)) kept.push_back(mesh.triangles[t]);
  const std::size_t dropped = mesh.triangles.size() - kept.size();
  mesh.triangles.swap(kept);
  return dropped;
}

// Part of a surface between open and non-manifold edges.
struct Patch {
  std::vector<int> triangles;
  double area = 0;
  bool open = false, nonManifold = false;
};

std::vector<Patch> patchesOf(const TriangleMesh& mesh) {
  const auto adjacent = adjacentTriangles(mesh);
  const auto onEdge = trianglesOnEdges(mesh);
  std::vector<bool> seen(mesh.triangles.size(), false);
  std::vector<Patch> patches;
  for (std::size_t seed = 0; seed < seen.size(); ++seed) {
    if (seen[seed]) continue;
    Patch patch;
    patch.triangles = {static_cast<int>(seed)};
    seen[seed] = true;
    for (std::size_t i = 0; i < patch.triangles.size(); ++i) {
      const int t = patch.triangles[i];
      patch.area += areaVector(mesh, mesh.triangles[t]).norm();
      for (int k = 0; k < 3; ++k) {
        patch.open = patch.open || onEdge[t][k] == 1;
        patch.nonManifold = patch.nonManifold || onEdge[t][k] > 2;
        const int other = adjacent[t][k];
        if (other < 0 || seen[other]) continue;
        seen[other] = true;
        patch.triangles.push_back(other);
      }
    }
    patches.push_back(std::move(patch));
  }
  return patches;
}

}  // namespace

MeshUnderRepair weldVertices(const TriangleMesh& input) {
  const std::vector<int> lowest = lowestCoincident(input.vertices, kWeld * medianShortestEdge(input));
  MeshUnderRepair repair;
  repair.vertexOfInput.resize(input.vertices.size());
  for (int v = 0; v < static_cast<int>(input.vertices.size()); ++v) {
    if (lowest[v] == v) {
      repair.vertexOfInput[v] = static_cast<int>(repair.mesh.vertices.size());
      repair.mesh.vertices.push_back(input.vertices[v]);
      repair.inputOfVertex.push_back(v);
    } else {
      repair.vertexOfInput[v] = repair.vertexOfInput[lowest[v]];
    }
  }
  for (const auto& t : input.triangles) {
    repair.mesh.triangles.push_back(
        {repair.vertexOfInput[t[0]], repair.vertexOfInput[t[1]], repair.vertexOfInput[t[2]]});
  }
  const std::size_t welded = input.vertices.size() - repair.mesh.vertices.size();
  if (welded > 0)
    repair.notes.push_back(fmt::format("welded {}", counted(welded, "duplicate vertex", "duplicate vertices")));
  return repair;
}

void dropRepeatedTriangles(MeshUnderRepair& repair) {
  TriangleMesh& mesh = repair.mesh;
  const std::size_t degenerate = filterTriangles(mesh, [&mesh](std::size_t i) {
    const auto& t = mesh.triangles[i];
    return t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
  });
  // Duplicates by their corners, whichever way they are wound: the first stays.
  std::set<std::array<int, 3>> seen;
  const std::size_t duplicate = filterTriangles(mesh, [&mesh, &seen](std::size_t i) {
    std::array<int, 3> key = mesh.triangles[i];
    std::sort(key.begin(), key.end());
    return seen.insert(key).second;
  });
  if (degenerate > 0) {
    repair.notes.push_back(
        fmt::format("dropped {}", counted(degenerate, "degenerate triangle", "degenerate triangles")));
  }
  if (duplicate > 0)
    repair.notes.push_back(fmt::format("dropped {}", counted(duplicate, "duplicate triangle", "duplicate triangles")));
  if (mesh.triangles.empty()) throw std::runtime_error("all triangles are degenerate: the mesh encloses no volume");
}

// A fin is an open flap that hangs on the surface by an edge of three or more triangles, or a lone triangle. Without it
// that edge may be manifold again and further patches join: repeat until nothing changes.
void dropFins(MeshUnderRepair& repair) {
  const double allowed = kFinArea * surfaceArea(repair.mesh);
  double dropped = 0;
  std::size_t fins = 0;
  for (;;) {
    const std::vector<Patch> patches = patchesOf(repair.mesh);
    const auto largest = std::max_element(patches.begin(), patches.end(),
                                          [](const Patch& a, const Patch& b) { return a.area < b.area; });
    std::vector<bool> isFin(repair.mesh.triangles.size(), false);
    double area = 0;
    for (auto patch = patches.begin(); patch != patches.end(); ++patch) {
      if (patch == largest || !patch->open || (!patch->nonManifold && patch->triangles.size() > 1)) continue;
      area += patch->area;
      for (const int t : patch->triangles) isFin[t] = true;
    }
    if (dropped + area > allowed) break;
    const std::size_t count = filterTriangles(repair.mesh, [&isFin](std::size_t t) { return !isFin[t]; });
    if (count == 0) break;
    dropped += area;
    fins += count;
  }
  if (fins > 0) repair.notes.push_back(fmt::format("dropped {}", counted(fins, "fin triangle", "fin triangles")));
}

void dropUnusedVertices(MeshUnderRepair& repair) {
  std::vector<int> renumbered(repair.mesh.vertices.size(), -1);
  for (const auto& t : repair.mesh.triangles)
    for (const int v : t) renumbered[v] = 0;
  int used = 0;
  for (std::size_t v = 0; v < renumbered.size(); ++v) {
    if (renumbered[v] < 0) continue;
    repair.mesh.vertices[used] = repair.mesh.vertices[v];
    repair.inputOfVertex[used] = repair.inputOfVertex[v];
    renumbered[v] = used++;
  }
  const std::size_t unused = renumbered.size() - used;
  repair.mesh.vertices.resize(used);
  repair.inputOfVertex.resize(used);
  for (auto& t : repair.mesh.triangles)
    for (int& v : t) v = renumbered[v];
  for (int& v : repair.vertexOfInput) v = renumbered[v];
  if (unused > 0)
    repair.notes.push_back(fmt::format("dropped {}", counted(unused, "unused vertex", "unused vertices")));
}

// A vertex in which two sheets touch has a closed ring of triangles for each of them. Every ring but the first gets a
// vertex of its own at the same place (Gueziec and others 2001, "Cutting and stitching").
void splitPinchedVertices(MeshUnderRepair& repair) {
  TriangleMesh& mesh = repair.mesh;
  const auto adjacent = adjacentTriangles(mesh);
  const IndexLists around = trianglesOfVertices(mesh);
  const int count = static_cast<int>(mesh.vertices.size());
  std::vector<int> ringOf(mesh.triangles.size(), -1);  // last vertex whose ring took this triangle
  const std::vector<std::array<int, 3>> corners = mesh.triangles;
  for (int v = 0; v < count; ++v) {
    bool first = true;
    for (int i = around.first[v]; i < around.first[v + 1]; ++i) {
      if (ringOf[around.item[i]] == v) continue;
      int target = v;
      if (!first) {
        target = static_cast<int>(mesh.vertices.size());
        mesh.vertices.push_back(Eigen::Vector3d(mesh.vertices[v]));
        repair.inputOfVertex.push_back(repair.inputOfVertex[v]);
      }
      first = false;
      for (int t = around.item[i]; ringOf[t] != v;) {
        ringOf[t] = v;
        const int k = static_cast<int>(std::find(corners[t].begin(), corners[t].end(), v) - corners[t].begin());
        mesh.triangles[t][k] = target;
        t = adjacent[t][k];  // turn about v over the edge that leaves it: triangles agree in winding
        assert(t >= 0);
      }
    }
  }
  const std::size_t split = mesh.vertices.size() - count;
  if (split > 0) {
    repair.notes.push_back(fmt::format("split {}", counted(split, "vertex where the surface touched itself",
                                                           "vertices where the surface touched itself")));
  }
}

namespace {

// Height over the longest edge as a fraction of it; the corner where that edge begins in `longest`.
double relativeHeight(const TriangleMesh& mesh, const std::array<int, 3>& t, int* longest = nullptr) {
  double most = 0;
  for (int k = 0; k < 3; ++k) {
    const double squared = (mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[t[k]]).squaredNorm();
    if (squared <= most) continue;
    most = squared;
    if (longest != nullptr) *longest = k;
  }
  return most > 0 ? 2 * areaVector(mesh, t).norm() / most : 0;
}

// One pass over disjoint pairs of triangles; `edges` is kept current. Returns the number of flips.
std::size_t flipOnce(TriangleMesh& mesh, std::set<std::array<int, 2>>& edges) {
  const auto adjacent = adjacentTriangles(mesh);
  std::vector<bool> changed(mesh.triangles.size(), false);
  std::size_t flips = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    int k = 0;
    const double height = relativeHeight(mesh, mesh.triangles[t], &k);
    const int other = adjacent[t][k];
    if (height > kNoHeight || changed[t] || changed[other]) continue;
    const int from = mesh.triangles[t][k], to = mesh.triangles[t][(k + 1) % 3], apex = mesh.triangles[t][(k + 2) % 3];
    int far = -1;
    for (const int v : mesh.triangles[other])
      if (v != from && v != to) far = v;
    const std::array<int, 2> edge = edgeOf(apex, far);
    if (far == apex || edges.contains(edge)) continue;
    const std::array<int, 3> first{apex, from, far}, second{apex, far, to};
    const double before = std::min(height, relativeHeight(mesh, mesh.triangles[other]));
    if (std::min(relativeHeight(mesh, first), relativeHeight(mesh, second)) <= before) continue;
    edges.erase(edgeOf(from, to));
    edges.insert(edge);
    mesh.triangles[t] = first;
    mesh.triangles[other] = second;
    changed[t] = changed[other] = true;
    ++flips;
  }
  return flips;
}

}  // namespace

// Dropping a triangle without area whose corners differ would open a crack. Its longest edge is flipped instead: the
// surface stays where it is and the middle corner joins the triangle across.
void flipTrianglesWithoutArea(MeshUnderRepair& repair) {
  constexpr int kPasses = 20;  // each lifts the worst of a row of collinear corners; real meshes need one or two
  const auto countFlat = [&repair] {
    return std::count_if(repair.mesh.triangles.begin(), repair.mesh.triangles.end(),
                         [&repair](const auto& t) { return relativeHeight(repair.mesh, t) <= kNoHeight; });
  };
  if (countFlat() == 0) return;
  const auto list = uniqueEdges(repair.mesh);
  std::set<std::array<int, 2>> edges(list.begin(), list.end());
  std::size_t flips = 0;
  for (int pass = 0; pass < kPasses; ++pass) {
    const std::size_t more = flipOnce(repair.mesh, edges);
    if (more == 0) break;
    flips += more;
  }
  if (flips > 0) {
    repair.notes.push_back(
        fmt::format("flipped {}", counted(flips, "edge of triangles without area", "edges of triangles without area")));
  }
  const std::size_t kept = countFlat();
  if (kept > 0)
    repair.notes.push_back(fmt::format("kept {}", counted(kept, "triangle without area", "triangles without area")));
}

}  // namespace medulla
