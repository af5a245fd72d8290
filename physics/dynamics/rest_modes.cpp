#include "physics/dynamics/rest_modes.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "physics/dynamics/rest_model.h"
#include "physics/model/symmetric_eigen.h"

namespace medulla {

namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Whole cells: what a sphere and its share of the surface weigh together.
struct CellMasses {
  std::vector<double> mass;
  std::vector<Matrix3d> inertia;
};

CellMasses cellMasses(const BodyDescription& body) {
  CellMasses out;
  for (std::size_t i = 0; i < body.model->spheres.size(); ++i) {
    const SphereCell s = sphereCell(body, static_cast<int>(i));
    out.mass.push_back(body.tissue.density * s.volume);
    out.inertia.push_back(body.tissue.density * (s.secondMoment.trace() * Matrix3d::Identity() - s.secondMoment));
  }
  return out;
}

// The rigid motions that the fixed freedoms allow, one per column, over the free freedoms.
MatrixXd freeRigidMotions(const SoftBodyModel& m, const std::vector<int>& freedom, int freeCount) {
  MatrixXd all = MatrixXd::Zero(6 * static_cast<int>(m.spheres.size()), 6);
  const Vector3d centre = m.spheres[0].restFrame;
  for (std::size_t i = 0; i < m.spheres.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      all(6 * i + k, k) = 1;
      all.block<3, 1>(6 * i, 3 + k) = Vector3d::Unit(k).cross(m.spheres[i].restFrame - centre);
      all(6 * i + 3 + k, 3 + k) = 1;
    }
  }
  MatrixXd fixed(all.rows() - freeCount, 6), free(freeCount, 6);
  for (int i = 0, f = 0; i < all.rows(); ++i) {
    if (freedom[i] >= 0) free.row(freedom[i]) = all.row(i);
    if (freedom[i] < 0) fixed.row(f++) = all.row(i);
  }
  if (fixed.rows() == 0) return free;
  const double size = std::max(1e-12, all.leftCols(6).cwiseAbs().maxCoeff());
  const SymmetricEigen eigen = symmetricEigen(fixed.transpose() * fixed);
  MatrixXd out(freeCount, 0);
  for (int k = 0; k < 6; ++k) {
    if (eigen.values[k] > 1e-12 * size * size) continue;
    out.conservativeResize(Eigen::NoChange, out.cols() + 1);
    out.rightCols(1) = free * eigen.vectors.col(k);
  }
  return out;
}

// `visit(i, j, value)` gets what the links' stiffness between the spheres' freedoms is the sum of.
template <class Visit>
void forEachStiffness(const std::vector<MeasureRow>& rows, const std::vector<StrainRow>& strains, const Visit& visit) {
  for (const MeasureRow& r : rows) {
    const int size = r.sphere1 < 0 ? 6 : 12;
    std::array<int, 12> index;
    Eigen::Matrix<double, 12, 1> row;
    row << -r.line, r.turn0, r.line, r.turn1;
    for (int k = 0; k < 12; ++k) index[k] = k < 6 ? 6 * r.sphere0 + k : 6 * r.sphere1 + k - 6;
    for (int i = 0; i < size; ++i)
      for (int j = 0; j < size; ++j) visit(index[i], index[j], r.stiffness * row[i] * row[j]);
  }
  for (const StrainRow& r : strains) {
    for (std::size_t a = 0; a < r.spheres.size(); ++a)
      for (std::size_t b = 0; b < r.spheres.size(); ++b)
        for (int i = 0; i < 36; ++i)
          visit(6 * r.spheres[a] + i / 6, 6 * r.spheres[b] + i % 6, r.rates[a][i / 6] * r.rates[b][i % 6]);
  }
}

double sumOfTraces(const std::vector<Matrix3d>& matrices) {
  double sum = 0;
  for (const Matrix3d& m : matrices) sum += m.trace();
  return sum;
}

Matrix3d positivePart(const Matrix3d& symmetric) {
  const SymmetricEigen e = symmetricEigen(symmetric);
  const Matrix3d vectors = e.vectors;
  return vectors * Vector3d(e.values.cwiseMax(0)).asDiagonal() * vectors.transpose();
}

}  // namespace

double lowestFrequency(const BodyDescription& body, const BodyMechanics& mechanics) {
  const SoftBodyModel& m = *body.model;
  const int spheres = static_cast<int>(m.spheres.size());
  std::vector<int> freedom(6 * spheres, -1);
  int count = 0;
  for (int i = 0; i < spheres; ++i)
    for (int k = 0; k < 6; ++k)
      if (k < 3 ? mechanics.moves[i] : mechanics.turns[i]) freedom[6 * i + k] = count++;
  const std::vector<MeasureRow> rows = measureRows(m, mechanics);
  if (count == 0 || rows.empty()) return 0;

  const CellMasses cells = cellMasses(body);
  using Triplet = Eigen::Triplet<double>;
  std::vector<Triplet> stiffness, mass;
  const auto put = [&](std::vector<Triplet>& to, int i, int j, double value) {
    if (freedom[i] >= 0 && freedom[j] >= 0) to.emplace_back(freedom[i], freedom[j], value);
  };
  forEachStiffness(rows, strainRows(m, mechanics), [&](int i, int j, double value) { put(stiffness, i, j, value); });
  for (int i = 0; i < spheres; ++i) {
    for (int k = 0; k < 3; ++k) {
      put(mass, 6 * i + k, 6 * i + k, cells.mass[i]);
      for (int l = 0; l < 3; ++l) put(mass, 6 * i + 3 + k, 6 * i + 3 + l, cells.inertia[i](k, l));
    }
  }
  Eigen::SparseMatrix<double> k(count, count), mm(count, count);
  k.setFromTriplets(stiffness.begin(), stiffness.end());
  mm.setFromTriplets(mass.begin(), mass.end());

  // Inverse iteration, rigid motions projected out; a shift far below any mode keeps the factorisation regular.
  const bool held = std::any_of(rows.begin(), rows.end(), [](const MeasureRow& r) { return r.sphere1 < 0; });
  MatrixXd rigid = held ? MatrixXd(count, 0) : freeRigidMotions(m, freedom, count);
  for (int i = 0; i < rigid.cols(); ++i) {
    for (int j = 0; j < i; ++j) rigid.col(i) -= rigid.col(j).dot(mm * rigid.col(i)) * rigid.col(j);
    rigid.col(i) /= std::sqrt(rigid.col(i).dot(mm * rigid.col(i)));
  }
  if (rigid.cols() >= count) return 0;
  VectorXd ratio = k.diagonal().cwiseQuotient(mm.diagonal());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(k + 1e-12 * ratio.maxCoeff() * mm);
  VectorXd x(count);
  for (int i = 0; i < count; ++i) x[i] = RestModel::startValue(i);
  constexpr int kIterations = 40;
  for (int i = 0; i < kIterations; ++i) {
    for (int j = 0; j < rigid.cols(); ++j) x -= rigid.col(j).dot(mm * x) * rigid.col(j);
    x /= std::sqrt(x.dot(mm * x));
    if (i + 1 < kIterations) x = factor.solve(mm * x);
  }
  return std::sqrt(std::max(0.0, x.dot(k * x)));
}

std::vector<double> naturalFrequencies(const BodyDescription& body, const BodyMechanics& mechanics, int count) {
  constexpr double kRigid = 1e-9;  // of the largest eigenvalue: motion that deforms nothing
  const RestModel rest(body, mechanics);
  std::vector<int> free;
  for (int i = 0; i < static_cast<int>(mechanics.sphereMass.size()); ++i)
    for (int k = 0; k < 6; ++k)
      if (k < 3 ? mechanics.moves[i] : mechanics.turns[i]) free.push_back(6 * i + k);
  if (free.empty()) return {};
  const MatrixXd stiffness = rest.linkStiffness()(free, free), mass = rest.carriedMass()(free, free);
  const VectorXd modes = eigenvaluesOf(stiffness, mass);
  std::vector<double> out;
  for (const double squared : modes)
    if (squared > kRigid * modes.maxCoeff() && static_cast<int>(out.size()) < count)
      out.push_back(std::sqrt(squared) / (2 * std::numbers::pi));
  return out;
}

void raiseRotaryInertia(const BodyDescription& body, BodyMechanics& mechanics) {
  // A step that is shorter by 2.5 % is let be; moments of inertia grow by a hundredth in all at most.
  constexpr double kExcess = 1.05, kMostAdded = 0.01, kLeastShare = 0.125;
  BodyMechanics locked = mechanics;
  locked.turns.assign(locked.turns.size(), false);
  const double moving = RestModel(body, locked).largestEigenvalue(1, 1);
  if (!(moving > 0)) return;
  const double most = (1 + kMostAdded) * sumOfTraces(mechanics.sphereInertia);
  const RestModel rest(body, mechanics);
  double fastest = rest.largestEigenvalue(1, 1);
  std::vector<Matrix3d> stiffness;
  for (int i = 0; fastest > kExcess * moving && i < static_cast<int>(mechanics.turns.size()); ++i)
    stiffness.push_back(mechanics.turns[i] ? rest.turningStiffness(i) : Matrix3d::Zero());
  for (double share = 1; fastest > kExcess * moving && share >= kLeastShare; share /= 2) {
    BodyMechanics raised = mechanics;
    for (std::size_t i = 0; i < stiffness.size(); ++i)
      raised.sphereInertia[i] += positivePart(stiffness[i] / (share * moving) - mechanics.sphereInertia[i]);
    if (sumOfTraces(raised.sphereInertia) > most) return;
    fastest = RestModel(body, raised).largestEigenvalue(1, 1);
    mechanics = std::move(raised);
  }
}

double dampBody(const BodyDescription& body, BodyMechanics& mechanics, Integrator integrator) {
  // Damping at the old velocity costs step: h^2 K + 2 h C <= 4 (largest eigenvalues over mass).
  const auto stableStep = [](double stiffness, double damping) {
    if (!(stiffness > 0)) return std::numeric_limits<double>::infinity();
    return (std::sqrt(damping * damping + 4 * stiffness) - damping) / stiffness;
  };
  // The surface's own modes are fast and die within a few substeps even below their critical damping; giving them the
  // body's beta would only cost step. An eighth of critical at the fastest of them costs a tenth of it, a half a third.
  constexpr double kLargestSurfaceRatio = 0.125;
  // The links get the beta that damps the lowest mode as asked, unless the step would shrink by more than this. What is
  // missing then is the mass-proportional part of Rayleigh's damping, which costs no step: zeta = beta w / 2 + alpha /
  // 2w.
  constexpr double kLargestCost = 1.3;

  const RestModel rest(body, mechanics);
  const double all = rest.largestEigenvalue(1, 1), links = rest.largestEigenvalue(1, 0),
               surface = rest.largestEigenvalue(0, 1);
  double lowest = lowestFrequency(body, mechanics);
  if (!(lowest > 0)) lowest = std::sqrt(std::max(links, surface));
  const double asked = lowest > 0 ? 2 * body.tissue.damping / lowest : 0;
  mechanics.surfaceRelaxation = surface > 0 ? std::min(asked, 2 * kLargestSurfaceRatio / std::sqrt(surface)) : 0;
  const double shortest = stableStep(all, 0) / kLargestCost;
  const double largestDamping = (4 / shortest - shortest * all) / 2;
  const double bound = links > 0 ? (largestDamping - mechanics.surfaceRelaxation * surface) / links : asked;
  // An implicit step has no limit to keep.
  if (integrator == Integrator::implicit) mechanics.surfaceRelaxation = asked;
  mechanics.linkRelaxation = integrator == Integrator::implicit ? asked : std::min(asked, std::max(0.0, bound));
  // It acts on the spheres for all that hangs on them, too.
  double onSpheres = 0;
  for (const double mass : mechanics.sphereMass) onSpheres += mass;
  double whole = onSpheres;
  for (const double mass : mechanics.nodeMass) whole += mass;
  mechanics.massDamping = (asked - mechanics.linkRelaxation) * lowest * lowest * whole / onSpheres;
  // Both matrices are sums of the links' and the surface's, and the modes that are stiffest are not those damped most:
  // the step is searched for where the largest eigenvalue of h^2 K + 2 h C itself reaches 4.
  const double linkBeta = mechanics.linkRelaxation, surfaceBeta = mechanics.surfaceRelaxation;
  double stable = stableStep(all, rest.largestEigenvalue(linkBeta, surfaceBeta)), unstable = stableStep(all, 0);
  constexpr int kBisections = 8;  // to half a per cent at most
  for (int i = 0; i < kBisections && unstable < std::numeric_limits<double>::infinity(); ++i) {
    const double h = 0.5 * (stable + unstable), square = h * h;
    (rest.largestEigenvalue(square + 2 * h * linkBeta, square + 2 * h * surfaceBeta) < 4 ? stable : unstable) = h;
  }
  return stable;
}

MatrixXd skeletonResponse(const BodyDescription& body, const BodyMechanics& mechanics, const MatrixXd& forces) {
  const RestModel model(body, mechanics);
  std::vector<int> free;
  bool held = false;
  for (std::size_t i = 0; i < mechanics.moves.size(); ++i) {
    held = held || !(mechanics.moves[i] || mechanics.turns[i]);
    for (int k = 0; k < 6; ++k)
      if (k < 3 ? mechanics.moves[i] : mechanics.turns[i]) free.push_back(6 * static_cast<int>(i) + k);
  }
  if (!held) throw std::runtime_error("no sphere is fixed: forces have no answer at rest");
  const MatrixXd all = model.linkStiffness(), loads = model.onSpheres(forces);
  const auto count = static_cast<Eigen::Index>(free.size());
  MatrixXd stiffness(count, count), some(count, loads.cols());
  for (Eigen::Index i = 0; i < count; ++i) {
    some.row(i) = loads.row(free[i]);
    for (Eigen::Index j = 0; j < count; ++j) stiffness(i, j) = all(free[i], free[j]);
  }
  const MatrixXd solved = stiffness.llt().solve(some);
  MatrixXd motions = MatrixXd::Zero(loads.rows(), loads.cols());
  for (Eigen::Index i = 0; i < count; ++i) motions.row(free[i]) = solved.row(i);
  MatrixXd out = model.carried(motions);
  for (const int n : body.fixedNodes) out.middleRows<3>(3 * static_cast<Eigen::Index>(n)).setZero();
  return out;
}

}  // namespace medulla
