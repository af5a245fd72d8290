#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "physics/model/mesh_repair_stages.h"
#include "physics/model/mesh_topology.h"
#include "physics/model/self_intersection.h"
#include "physics/model/symmetric_eigen.h"
#include "physics/sort_unique.h"

namespace medulla {

namespace {

// m; beyond these a mesh is in another unit than the caller believes, and fourth powers leave the range of double.
constexpr double kLargestCoordinate = 1e6;
constexpr double kSmallestDiagonal = 1e-6;
// Of the mesh's size, from the origin: beyond, places round to a share of it that the model shows.
constexpr double kFarthestPlace = 1e4;

// A far vertex lies further from the middle than this many times the distance that 90 % of the vertices keep ...
constexpr double kFarFromMiddle = 5;
// ... and all its edges are longer than this many median edges: the tip of a long but meshed limb has short ones.
constexpr double kFarFromNeighbours = 20;

// Flat: the thinnest principal direction, or the mean thickness 2 V / A, as a fraction of the size.
constexpr double kFlatExtent = 1e-5;
constexpr double kFlatThickness = 1e-4;

// Total length of the cuts, as a fraction of the diagonal, up to which they are a local flaw: a fold of a few
// triangles stays below, a limb of a fortieth of the diagonal that runs into another place of the body does not.
constexpr double kSmallCuts = 0.15;

double quantile(std::vector<double> values, double fraction) {
  const std::size_t index = static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(index), values.end());
  return values[index];
}

std::string place(const Eigen::Vector3d& p) {
  return fmt::format("({:.4g} {:.4g} {:.4g}) m", p.x(), p.y(), p.z());
}

double totalLength(const std::vector<TriangleCut>& cuts) {
  double length = 0;
  for (const TriangleCut& cut : cuts) length += cut.length;
  return length;
}

std::string describe(const TriangleMesh& mesh, const std::vector<TriangleCut>& cuts) {
  return fmt::format("the surface cuts through itself along {} ({} of triangles, the first near {})",
                     millimetres(totalLength(cuts)), counted(cuts.size(), "pair", "pairs"),
                     place(centroid(mesh, mesh.triangles[cuts[0].triangle0])));
}

}  // namespace

std::string millimetres(double length) {
  return fmt::format("{:.3g} mm", 1e3 * length);
}

std::string counted(std::size_t count, const std::string& singular, const std::string& plural) {
  return fmt::format("{} {}", count, count == 1 ? singular : plural);
}

void requireUsableNumbers(const TriangleMesh& input) {
  if (input.triangles.empty()) throw std::runtime_error("the mesh has no triangles, expected a closed surface");
  const int count = static_cast<int>(input.vertices.size());
  for (int v = 0; v < count; ++v) {
    if (!input.vertices[v].allFinite())
      throw std::runtime_error(fmt::format("vertex {} is not finite, expected a place in metres", v));
    if (input.vertices[v].cwiseAbs().maxCoeff() > kLargestCoordinate) {
      throw std::runtime_error(fmt::format("vertex {} at {} lies beyond {:g} m: is the unit right?", v,
                                           place(input.vertices[v]), kLargestCoordinate));
    }
  }
  for (std::size_t t = 0; t < input.triangles.size(); ++t) {
    for (const int v : input.triangles[t]) {
      if (v >= 0 && v < count) continue;
      throw std::runtime_error(fmt::format("triangle {} refers to vertex {}, expected 0 to {}", t, v, count - 1));
    }
  }
  const double diagonal = boundsDiagonal(input);
  if (diagonal < kSmallestDiagonal) {
    throw std::runtime_error(fmt::format("the mesh is {:.3g} m across, expected at least {:g} m: is the unit right?",
                                         diagonal, kSmallestDiagonal));
  }
  const double away = input.vertices[input.triangles[0][0]].norm();
  if (away > kFarthestPlace * diagonal) {
    throw std::runtime_error(
        fmt::format("the mesh of {:.3g} m lies {:.3g} m from the origin, expected at most {:g} times its size: move it "
                    "there, and the body in the scene",
                    diagonal, away, kFarthestPlace));
  }
}

void requireNoFarVertex(const TriangleMesh& input) {
  std::vector<double> lengths;
  std::vector<double> shortest(input.vertices.size(), std::numeric_limits<double>::infinity());
  for (const auto& [a, b] : uniqueEdges(input)) {
    const double length = (input.vertices[a] - input.vertices[b]).norm();
    if (length == 0) continue;
    lengths.push_back(length);
    shortest[a] = std::min(shortest[a], length);
    shortest[b] = std::min(shortest[b], length);
  }
  if (lengths.empty()) return;
  // Medians, because the vertex that is looked for would move a mean or a bounding box.
  Eigen::Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> coordinates;
    for (const auto& v : input.vertices) coordinates.push_back(v[axis]);
    middle[axis] = quantile(std::move(coordinates), 0.5);
  }
  std::vector<double> distances;
  for (const auto& v : input.vertices) distances.push_back((v - middle).norm());
  const double usual = quantile(distances, 0.9), medianEdge = quantile(std::move(lengths), 0.5);
  for (std::size_t v = 0; v < input.vertices.size(); ++v) {
    if (distances[v] <= kFarFromMiddle * usual || shortest[v] <= kFarFromNeighbours * medianEdge) continue;
    const char* unused = std::isinf(shortest[v]) ? "; no triangle uses it" : "";
    throw std::runtime_error(
        fmt::format("vertex {} at {} lies {:.3g} times further out than the rest of the mesh{}; expected "
                    "{} times at most, or vertices between",
                    v, place(input.vertices[v]), distances[v] / usual, unused, kFarFromMiddle));
  }
}

void requireThickness(const MeshUnderRepair& repair) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& v : repair.mesh.vertices) mean += v;
  mean /= static_cast<double>(repair.mesh.vertices.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const auto& v : repair.mesh.vertices) covariance += (v - mean) * (v - mean).transpose();
  const Eigen::Vector3d variance = symmetricEigen(covariance).values;
  if (variance[0] > kFlatExtent * kFlatExtent * variance[2]) return;
  throw std::runtime_error("the mesh is flat and encloses no volume, expected a closed surface");
}

void requireManifoldEdges(const MeshUnderRepair& repair) {
  const auto count = trianglesOnEdges(repair.mesh);
  std::vector<std::array<int, 2>> bad;
  for (std::size_t t = 0; t < count.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      if (count[t][k] <= 2) continue;
      const int a = repair.inputOfVertex[repair.mesh.triangles[t][k]],
                b = repair.inputOfVertex[repair.mesh.triangles[t][(k + 1) % 3]];
      bad.push_back(edgeOf(a, b));
    }
  }
  if (bad.empty()) return;
  sortUnique(bad);
  throw std::runtime_error(
      fmt::format("non-manifold: {} shared by more than two triangles, the first between vertices {} and {}",
                  counted(bad.size(), "edge is", "edges are"), bad[0][0], bad[0][1]));
}

void requireVolume(const MeshUnderRepair& repair) {
  const double volume = enclosedVolume(repair.mesh), diagonal = boundsDiagonal(repair.mesh);
  const double thickness = 2 * volume / surfaceArea(repair.mesh);
  if (thickness > kFlatThickness * diagonal) return;
  throw std::runtime_error(fmt::format("the mesh is flat: it encloses {:.3g} m3, {} thick on average over {}", volume,
                                       millimetres(thickness), millimetres(diagonal)));
}

// Pieces that cut each other are neither one body nor a body with a cavity, however short the cut; taken for a cavity,
// one would leave the other a volume that says nothing.
void requireApart(const MeshUnderRepair& repair) {
  int components = 0;
  const std::vector<int> component = componentOfTriangles(repair.mesh, components);
  if (components == 1) return;
  std::vector<TriangleCut> cuts = findSelfIntersections(repair.mesh);
  std::erase_if(cuts, [&](const TriangleCut& c) { return component[c.triangle0] == component[c.triangle1]; });
  if (!cuts.empty())
    throw std::runtime_error(describe(repair.mesh, cuts) + ": separate pieces overlap, expected one closed surface");
}

void judgeSelfIntersections(MeshUnderRepair& repair) {
  const std::vector<TriangleCut> cuts = findSelfIntersections(repair.mesh);
  if (cuts.empty()) return;
  const std::string finding = describe(repair.mesh, cuts);
  if (totalLength(cuts) > kSmallCuts * boundsDiagonal(repair.mesh))
    throw std::runtime_error(finding + ", expected none");
  repair.notes.push_back(finding);
}

}  // namespace medulla
