#include "physics/model/identify/layer_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "physics/model/attachment.h"
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

std::array<SparseMatrix, 3> springParts(const TriangleMesh& mesh, const NodeSurface& surface) {
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

MatrixXd pressureOfCells(const SoftBodyModel& model, const std::vector<Attachment>& nodes, const NodeSurface& surface,
                         double bulk) {
  std::vector<double> depth;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    depth.push_back(attachmentDepth(model.attachments[i], surface.normals[i], model.spheres));
  const std::vector<double> volumes = hostVolumes(model, nodes, depth).spheres;
  MatrixXd out = MatrixXd::Zero(3 * static_cast<Index>(nodes.size()), static_cast<Index>(model.spheres.size()));
  for (Index i = 0; 3 * i < out.rows(); ++i) {
    const int cell = nodes[i].host;
    if (surface.held[i] || !(volumes[cell] > 0)) continue;
    out.block<3, 1>(3 * i, cell) = std::sqrt(bulk / volumes[cell]) * surface.areas[i] * surface.normals[i];
  }
  return out;
}

SparseMatrix springStiffness(const SurfaceLayer& surface, const Vector3d& k) {
  return k[0] * surface.parts[0] + k[1] * surface.parts[1] + k[2] * surface.parts[2] + surface.held;
}

// The springs' matrix and the pressures' Q Q^T (Woodbury).
class LayerSolver {
 public:
  explicit LayerSolver(const SurfaceLayer& surface) : surface_(surface) {
    factors_.analyzePattern(springStiffness(surface, Vector3d::Ones()));
  }
  bool factorise(const Vector3d& k) {  // false where there is no stiffness somewhere
    factors_.factorize(springStiffness(surface_, k));
    if (factors_.info() != Eigen::Success) return false;
    const MatrixXd& q = surface_.pressure;
    sprung_ = factors_.solve(q);
    closed_.compute(MatrixXd::Identity(q.cols(), q.cols()) + q.transpose() * sprung_);
    return closed_.info() == Eigen::Success;
  }
  MatrixXd solve(const MatrixXd& forces) const {
    MatrixXd x = factors_.solve(forces);
    x -= sprung_ * closed_.solve(surface_.pressure.transpose() * x);
    return x;
  }

 private:
  const SurfaceLayer& surface_;
  Eigen::SimplicialLLT<SparseMatrix> factors_;
  MatrixXd sprung_;  // the springs' answer to Q
  Eigen::LLT<MatrixXd> closed_;
};

// Squared errors of a trial layer's answer, relative to what it should be: of each load's displacements, and of what
// work its pokes do times kWork. Displacements alone, most of them beside the poke, put up with springs too stiff below
// it. `gradient`: over the logarithms of the stiffnesses k.
double misfit(const SurfaceLayer& surface, const LayerSolver& solver, const LayerLoads& loads, const Vector3d& k,
              VectorXd& gradient) {
  constexpr double kWork = 10;     // 20 bring pokes hardly nearer and tangential loads farther off
  constexpr double kLeast = 0.01;  // of the mean: what frames carry nearly whole leaves differences of large numbers
  const VectorXd squares = loads.left.colwise().squaredNorm();
  const double leastSquares = kLeast * squares.mean();
  const VectorXd weights = squares.unaryExpr([&](double s) { return s > 0 ? 1 / std::max(s, leastSquares) : 0.; });
  const MatrixXd moved = solver.solve(loads.forces), off = loads.left - moved;
  double sum = (off * weights.asDiagonal()).cwiseProduct(off).sum();
  // d moved = -K^-1 dK moved: what errors pull on `moved`, and of the work, forces . moved, `moved` itself.
  MatrixXd pull = 2 * solver.solve(off * weights.asDiagonal());
  const Index pokes = loads.pokeWork.size(), first = moved.cols() - pokes;
  const double leastWork = pokes > 0 ? kLeast * loads.pokeWork.cwiseMax(0).mean() : 0;
  for (Index poke = 0; poke < pokes; ++poke) {
    const double due = loads.pokeWork[poke];
    if (!(due > leastWork)) continue;
    const auto sunk = moved.col(first + poke);
    const double excess = loads.forces.col(first + poke).dot(sunk) / due - 1;
    sum += kWork * excess * excess;
    pull.col(first + poke) -= 2 * kWork * excess / due * sunk;
  }
  for (int part = 0; part < 3; ++part) gradient[part] = k[part] * pull.cwiseProduct(surface.parts[part] * moved).sum();
  return sum;
}

MatrixXd freeOnly(const SurfaceLayer& surface, const MatrixXd& x) {
  return x - surface.held * x;
}

}  // namespace

SurfaceLayer makeSurfaceLayer(const SoftBodyModel& model, const std::vector<std::vector<SkinFrame>>& skin,
                              const NodeSurface& surface, double poisson) {
  return {springParts({model.restNodes, model.triangles}, surface), identityOfHeld(surface),
          pressureOfCells(model, attachmentsToFrames(model, skin), surface, identifiedBulk(poisson))};
}

MatrixXd layerResponse(const SurfaceLayer& surface, const IdentifiedLayer& layer, const RowMatrix& forces) {
  assert(forces.rows() == surface.held.rows());
  LayerSolver solver(surface);
  if (!solver.factorise({layer.normal, layer.tangential, layer.membrane}))
    throw std::runtime_error("the surface layer has no stiffness somewhere");
  return solver.solve(freeOnly(surface, forces));
}

IdentifiedLayer fitLayer(const SurfaceLayer& surface, LayerLoads loads, double lengthScale,
                         const std::function<void()>& goOn) {
  assert(loads.forces.rows() == surface.held.rows() && loads.pokeWork.size() <= loads.forces.cols());
  loads.forces = freeOnly(surface, loads.forces);
  loads.left = freeOnly(surface, loads.left);
  // Where frames leave little that springs could do, as at the end of a slender body, the loads say nothing of them.
  constexpr double kUsual = 0.03;  // of the objective, per squared logarithm
  LayerSolver solver(surface);
  const Vector3d units(1 / lengthScale, 1 / lengthScale, lengthScale);
  // Skins leave next to nothing to give across; stiffer springs there would only shorten the step.
  const Vector3d low(0, 0, std::log(1e-3)), high(std::log(1e3), std::log(4.), std::log(0.1));
  const auto objective = [&](const VectorXd& x, VectorXd& gradient) {
    goOn();
    if ((x - low).minCoeff() < 0 || (x - high).maxCoeff() > 0) return std::numeric_limits<double>::infinity();
    const Vector3d k = units.cwiseProduct(Vector3d(x.array().exp()));
    if (!solver.factorise(k)) return std::numeric_limits<double>::infinity();
    return misfit(surface, solver, loads, k, gradient);
  };
  // About what livers, the cylinder and the gallbladder come to: 2 to 5, 1 to 2.5 and 0.02 to 0.06.
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
