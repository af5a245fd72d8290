#include "physics/model/identify/layer_fit.h"

#include <Eigen/SparseCholesky>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "physics/model/identify/lbfgs.h"
#include "physics/model/mesh_topology.h"

namespace medulla {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using SparseMatrix = Eigen::SparseMatrix<double>;

namespace {

// Stiffness matrices per unit of normal, tangential and membrane; held nodes' rows are left empty.
std::array<SparseMatrix, 3> layerParts(const TriangleMesh& mesh, const NodeSurface& surface) {
  std::array<std::vector<Eigen::Triplet<double>>, 3> entries;
  const auto put = [&](int part, int a, int b, const Matrix3d& k) {
    if (surface.held[a] || surface.held[b]) return;  // a held node keeps still: its neighbours' springs to it stay
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) entries[part].emplace_back(3 * a + i, 3 * b + j, k(i, j));
  };
  for (int n = 0; n < static_cast<int>(mesh.vertices.size()); ++n) {
    const Matrix3d along = surface.normals[n] * surface.normals[n].transpose();
    put(0, n, n, surface.areas[n] * along);
    put(1, n, n, surface.areas[n] * (Matrix3d::Identity() - along));
  }
  visitEdges(mesh, [&](int i, int j, double area, double squaredLength) {
    const Matrix3d spring = area / squaredLength * Matrix3d::Identity();
    put(2, i, i, spring);
    put(2, j, j, spring);
    put(2, i, j, -spring);
    put(2, j, i, -spring);
  });
  std::array<SparseMatrix, 3> out;
  const auto size = 3 * static_cast<Index>(mesh.vertices.size());
  for (int part = 0; part < 3; ++part) {
    out[part].resize(size, size);
    out[part].setFromTriplets(entries[part].begin(), entries[part].end());
  }
  return out;
}

SparseMatrix identityOfHeld(const NodeSurface& surface) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int n = 0; n < static_cast<int>(surface.held.size()); ++n) {
    for (int k = 0; k < 3; ++k)
      if (surface.held[n]) entries.emplace_back(3 * n + k, 3 * n + k, 1);
  }
  SparseMatrix out(3 * static_cast<Index>(surface.held.size()), 3 * static_cast<Index>(surface.held.size()));
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

MatrixXd freeOnly(const RowMatrix& forces, const NodeSurface& surface) {
  MatrixXd out = forces;
  for (std::size_t n = 0; n < surface.held.size(); ++n)
    if (surface.held[n]) out.middleRows<3>(3 * static_cast<Index>(n)).setZero();
  return out;
}

}  // namespace

MatrixXd layerResponse(const TriangleMesh& mesh, const NodeSurface& surface, const IdentifiedLayer& layer,
                       const RowMatrix& forces) {
  assert(forces.rows() == 3 * static_cast<Index>(mesh.vertices.size()));
  const std::array<SparseMatrix, 3> parts = layerParts(mesh, surface);
  const SparseMatrix k =
      layer.normal * parts[0] + layer.tangential * parts[1] + layer.membrane * parts[2] + identityOfHeld(surface);
  const Eigen::SimplicialLLT<SparseMatrix> factors(k);
  if (factors.info() != Eigen::Success) throw std::runtime_error("the surface layer has no stiffness somewhere");
  return factors.solve(freeOnly(forces, surface));
}

IdentifiedLayer fitLayer(const TriangleMesh& mesh, const NodeSurface& surface, const RowMatrix& forces,
                         const MatrixXd& rest, const VectorXd& scales, double lengthScale,
                         const std::function<void()>& goOn) {
  assert(forces.rows() == 3 * static_cast<Index>(mesh.vertices.size()));
  const std::array<SparseMatrix, 3> parts = layerParts(mesh, surface);
  // Where frames leave little that springs could do, as at the end of a slender body, the loads say nothing of them.
  constexpr double kUsual = 0.1;  // of the objective, per squared logarithm
  const SparseMatrix still = identityOfHeld(surface);
  const MatrixXd loads = freeOnly(forces, surface);
  const MatrixXd target = freeOnly(rest, surface);
  const VectorXd weights = scales.unaryExpr([](double s) { return s > 0 ? 1 / (s * s) : 0.; });
  Eigen::SimplicialLLT<SparseMatrix> factors;
  factors.analyzePattern(SparseMatrix(parts[0] + parts[1] + parts[2] + still));
  const Vector3d units(1 / lengthScale, 1 / lengthScale, lengthScale);
  // Skins leave next to nothing to give across; stiffer springs there would only shorten the step.
  const Vector3d low(0, 0, std::log(1e-3)), high(std::log(1e3), std::log(2.), std::log(0.1));
  const auto objective = [&](const VectorXd& x, VectorXd& gradient) {
    if (goOn) goOn();
    if ((x - low).minCoeff() < 0 || (x - high).maxCoeff() > 0) return std::numeric_limits<double>::infinity();
    const Vector3d k = units.cwiseProduct(Vector3d(x.array().exp()));
    factors.factorize(SparseMatrix(k[0] * parts[0] + k[1] * parts[1] + k[2] * parts[2] + still));
    if (factors.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
    const MatrixXd moved = factors.solve(loads), off = target - moved;
    const MatrixXd pull = factors.solve(MatrixXd(off * weights.asDiagonal()));
    for (int p = 0; p < 3; ++p) gradient[p] = 2 * k[p] * pull.cwiseProduct(MatrixXd(parts[p] * moved)).sum();
    return (off * weights.asDiagonal()).cwiseProduct(off).sum();
  };
  // Between what the layer of a cylinder and of a gallbladder on their beds comes to where the frames are exact.
  const VectorXd usual = Vector3d(std::log(3.), std::log(1.2), std::log(0.03));
  VectorXd x = usual, slope(3);
  const double hold = kUsual * objective(usual, slope);
  const auto held = [&](const VectorXd& at, VectorXd& gradient) {
    const double f = objective(at, gradient);
    gradient += 2 * hold * (at - usual);
    return f + hold * (at - usual).squaredNorm();
  };
  descend(held, {40, 1e-6, 10}, x);
  const Vector3d k = units.cwiseProduct(Vector3d(x.array().exp()));
  return {k[0], k[1], k[2]};
}

}  // namespace medulla
