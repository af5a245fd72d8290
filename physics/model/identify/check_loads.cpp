#include "physics/model/identify/check_loads.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "physics/model/mesh_topology.h"
#include "physics/model/surface_samples.h"

namespace medulla {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;

NodeSurface measureNodes(const TriangleMesh& mesh, const std::vector<FixedPatch>& patches) {
  NodeSurface out{vertexAreas(mesh), vertexNormals(mesh), std::vector<bool>(mesh.vertices.size(), false)};
  for (const FixedPatch& patch : patches)
    for (const int n : patch.nodes) out.held[n] = true;
  return out;
}

Eigen::VectorXd freeAreas(const NodeSurface& surface) {
  Eigen::VectorXd out(static_cast<Index>(surface.areas.size()));
  for (Index n = 0; n < out.size(); ++n) out[n] = surface.held[n] ? 0 : surface.areas[n];
  return out;
}

namespace {

// Indices of the three free nodes nearest to the point.
std::vector<int> nearestFree(const TriangleMesh& mesh, const NodeSurface& surface, const Vector3d& point) {
  std::vector<int> free;
  for (int n = 0; n < static_cast<int>(mesh.vertices.size()); ++n)
    if (!surface.held[n]) free.push_back(n);
  if (free.size() < 3) throw std::runtime_error("fewer than three nodes of the surface are free: nothing to identify");
  std::stable_sort(free.begin(), free.end(), [&](int a, int b) {
    return (mesh.vertices[a] - point).squaredNorm() < (mesh.vertices[b] - point).squaredNorm();
  });
  free.resize(3);
  return free;
}

}  // namespace

RowMatrix randomLoads(const TriangleMesh& mesh, const NodeSurface& surface, LoadKind kind, double lengthScale,
                      int count, std::uint64_t seed) {
  constexpr int tries = 20;  // for a patch clear of what is held; then any will do
  RandomSequence random{seed};
  const double diagonal = boundsDiagonal(mesh);
  const std::vector<SurfaceSample> centres = sampleSurface(mesh, count * tries, seed);
  RowMatrix forces = RowMatrix::Zero(3 * static_cast<Index>(mesh.vertices.size()), count);
  for (int load = 0; load < count; ++load) {
    const bool poke = kind == LoadKind::poke;
    const double share = random.uniform();
    const double radius = poke ? (1 + 2 * share) / 3 * lengthScale : (1 + share) / 8 * diagonal;
    const Vector3d direction = random.normal().normalized();
    const auto push = [&](std::size_t n, const SurfaceSample& centre) {
      forces.block<3, 1>(3 * static_cast<Index>(n), load) =
          surface.areas[n] * (poke ? Vector3d(-centre.normal) : direction);
    };
    for (int k = 0; k < tries; ++k) {
      // Samples run along the surface: every load tries one in each of `tries` parts of it.
      const SurfaceSample& centre = centres[(load + k * count + (load * 7 % tries) * count) % (count * tries)];
      int nodes = 0;
      bool clear = true;
      forces.col(load).setZero();
      for (std::size_t n = 0; n < mesh.vertices.size(); ++n) {
        if ((mesh.vertices[n] - centre.point).norm() > radius || surface.normals[n].dot(centre.normal) < 0.2) continue;
        if (surface.held[n]) {
          clear = false;
          continue;
        }
        push(n, centre);
        ++nodes;
      }
      if (nodes >= 3 && clear) break;
      if (nodes < 3 && k + 1 == tries) {
        forces.col(load).setZero();
        for (const int n : nearestFree(mesh, surface, centre.point)) push(n, centre);
      }
    }
  }
  return forces;
}

RowMatrix consistentForces(const TriangleMesh& mesh, const RowMatrix& tractions) {
  RowMatrix out = RowMatrix::Zero(tractions.rows(), tractions.cols());
  for (const std::array<int, 3>& t : mesh.triangles) {
    const Vector3d normal =
        (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
    for (const int i : t)
      for (const int j : t)
        out.middleRows<3>(3 * i) += (i == j ? 2 : 1) * normal.norm() / 24 * tractions.middleRows<3>(3 * j);
  }
  return out;
}

IdentifiedError errorOf(const MatrixXd& found, const MatrixXd& expected) {
  if (!found.allFinite() || !expected.allFinite()) throw std::runtime_error("displacements under loads are not finite");
  IdentifiedError error;
  double squares = 0;
  int counted = 0;
  const Index nodes = expected.rows() / 3;
  for (Index load = 0; load < expected.cols(); ++load) {
    double largest = 0, worst = 0, sum = 0;
    for (Index n = 0; n < nodes; ++n) {
      largest = std::max(largest, expected.block<3, 1>(3 * n, load).norm());
      const double off = (found.block<3, 1>(3 * n, load) - expected.block<3, 1>(3 * n, load)).norm();
      worst = std::max(worst, off);
      sum += off * off;
    }
    if (!(largest > 0)) continue;
    error.maximum = std::max(error.maximum, 100 * worst / largest);
    ++counted;
    squares += sum / static_cast<double>(nodes) / (largest * largest);
  }
  if (counted > 0) error.rms = 100 * std::sqrt(squares / counted);
  return error;
}

}  // namespace medulla
