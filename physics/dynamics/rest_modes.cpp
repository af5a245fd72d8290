#include "physics/dynamics/rest_modes.h"

#include <Eigen/Cholesky>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "physics/dynamics/identified_mechanics.h"
#include "physics/dynamics/rest_model.h"
#include "physics/dynamics/rigid_support.h"
#include "physics/model/cross_matrix.h"
#include "physics/model/mass_properties.h"
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
    out.inertia.push_back(body.tissue.density * inertia(s.secondMoment));
  }
  return out;
}

// Of the spheres' 6 each, those that are not fixed; ascending.
std::vector<int> freeFreedoms(const BodyMechanics& mechanics) {
  std::vector<int> out;
  for (int i = 0; i < static_cast<int>(mechanics.moves.size()); ++i)
    for (int k = 0; k < 6; ++k)
      if (k < 3 ? mechanics.moves[i] : mechanics.turns[i]) out.push_back(6 * i + k);
  return out;
}

// Of all freedoms, which of the free ones each is; -1: held.
std::vector<int> placesOf(const std::vector<int>& free, const SoftBodyModel& model) {
  std::vector<int> out(6 * model.spheres.size(), -1);
  for (std::size_t f = 0; f < free.size(); ++f) out[free[f]] = static_cast<int>(f);
  return out;
}

// The rigid motions that the fixed freedoms and held nodes allow, one per column, over the free freedoms.
MatrixXd freeRigidMotions(const SoftBodyModel& m, const std::vector<Vector3d>& heldNodes,
                          const std::vector<int>& freedom, int freeCount) {
  MatrixXd all = MatrixXd::Zero(6 * static_cast<int>(m.spheres.size()), 6);
  const Vector3d centre = m.spheres[0].restFrame;
  for (std::size_t i = 0; i < m.spheres.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      all(6 * i + k, k) = 1;
      all.block<3, 1>(6 * i, 3 + k) = Vector3d::Unit(k).cross(m.spheres[i].restFrame - centre);
      all(6 * i + 3 + k, 3 + k) = 1;
    }
  }
  MatrixXd fixed(all.rows() - freeCount + 3 * static_cast<Eigen::Index>(heldNodes.size()), 6), free(freeCount, 6);
  Eigen::Index f = 0;
  for (int i = 0; i < all.rows(); ++i) {
    if (freedom[i] >= 0) free.row(freedom[i]) = all.row(i);
    if (freedom[i] < 0) fixed.row(f++) = all.row(i);
  }
  for (const Vector3d& node : heldNodes) {
    fixed.middleRows<3>(f) << Matrix3d::Identity(), -crossMatrix(node - centre);
    f += 3;
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

// Columns: the free among `freedom`'s freedoms.
RestRates freeOnly(const std::vector<int>& freedom, int freeCount) {
  std::vector<Eigen::Triplet<double>> ones;
  for (std::size_t i = 0; i < freedom.size(); ++i)
    if (freedom[i] >= 0) ones.emplace_back(static_cast<int>(i), freedom[i], 1);
  RestRates out(static_cast<Eigen::Index>(freedom.size()), freeCount);
  out.setFromTriplets(ones.begin(), ones.end());
  return out;
}

bool holdsByLinks(const BodyDescription& body, const BodyMechanics& mechanics) {
  const auto held = [&](const IdentifiedLink& l) { return l.frame1 >= static_cast<int>(body.model->spheres.size()); };
  return !mechanics.identifiedLinks.empty() &&
         std::any_of(body.model->identified->links.begin(), body.model->identified->links.end(), held);
}

MatrixXd rigidMotionsLeft(const BodyDescription& body, const BodyMechanics& mechanics, const std::vector<int>& freedom,
                          int freeCount) {
  if (holdsByLinks(body, mechanics)) return MatrixXd(freeCount, 0);
  return freeRigidMotions(*body.model, heldNodes(body), freedom, freeCount);
}

// Of nodes that are held while the spheres that carry them are not. Identified links hold their patches themselves: no
// rows then.
RestRates heldRates(const BodyDescription& body, const BodyMechanics& mechanics) {
  if (holdsByNodes(body) && !holdsByLinks(body, mechanics)) return heldNodeRates(body, mechanics);
  return RestRates(0, 6 * static_cast<Eigen::Index>(body.model->spheres.size()));
}

// N m times two, of attachments and of all.
struct LayerEnergy {
  double attached = 0, all = 0;
};

// Of the layer at rest while the spheres move by `motion` (6 each) and held nodes stay. Edges, which have no dampers,
// carry what one node is held by to the next.
LayerEnergy layerEnergy(const BodyDescription& body, const BodyMechanics& mechanics, const VectorXd& motion) {
  const RestRates stiffness = layerStiffness(*body.model, mechanics);
  std::vector<int> moving(stiffness.rows(), 0);
  VectorXd u = VectorXd::Zero(stiffness.rows());  // off the anchors
  for (const int n : body.fixedNodes) {
    u.segment<3>(3 * n).setZero();
    for (const HostRate& rate : anchorRates(body, mechanics, n))
      u.segment<3>(3 * n) -=
          rate.linear * motion.segment<3>(6 * rate.sphere) + rate.angular * motion.segment<3>(6 * rate.sphere + 3);
    for (int k = 0; k < 3; ++k) moving[3 * n + k] = -1;
  }
  int count = 0;
  for (int& m : moving) m = m < 0 ? -1 : count++;
  const RestRates toMoving = freeOnly(moving, count);
  const Eigen::SparseMatrix<double> free = toMoving.transpose() * stiffness * toMoving;
  const Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver(free);
  u += toMoving * solver.solve(-(toMoving.transpose() * (stiffness * u)));
  LayerEnergy out;
  out.all = u.dot(stiffness * u);
  for (Eigen::Index n = 0; n < u.size() / 3; ++n) {
    const Vector3d x = u.segment<3>(3 * n);
    out.attached += mechanics.attachmentStiffness[n] * x.squaredNorm();
    if (!mechanics.normalExcess.empty())
      out.attached += mechanics.normalExcess[n] * mechanics.normal[n].dot(x) * mechanics.normal[n].dot(x);
  }
  return out;
}

struct LowestMode {
  double frequency = 0;  // rad/s
  // Of its energy: what lies in links, and in attachments where nodes are held.
  double linkShare = 1, attachedShare = 0;
  // Of its kinetic energy: what alpha acts on, of spheres without nodes, on spins by the least moment.
  double ownShare = 1;
};

// Of all freedoms, of which `freedom` numbers the free ones.
Eigen::SparseMatrix<double> wholeMasses(const BodyDescription& body, const std::vector<int>& freedom, int count) {
  const CellMasses cells = cellMasses(body);
  std::vector<Eigen::Triplet<double>> mass;
  const auto put = [&](int i, int j, double value) {
    if (freedom[i] >= 0 && freedom[j] >= 0) mass.emplace_back(freedom[i], freedom[j], value);
  };
  for (int i = 0; i < static_cast<int>(cells.mass.size()); ++i) {
    for (int k = 0; k < 3; ++k) {
      put(6 * i + k, 6 * i + k, cells.mass[i]);
      for (int l = 0; l < 3; ++l) put(6 * i + 3 + k, 6 * i + 3 + l, cells.inertia[i](k, l));
    }
  }
  Eigen::SparseMatrix<double> out(count, count);
  out.setFromTriplets(mass.begin(), mass.end());
  return out;
}

// Of the kinetic energy of `motion` (6 per sphere, whole cells' energy 1).
double ownShareOf(const BodyMechanics& mechanics, const VectorXd& motion) {
  double sum = 0;
  for (std::size_t i = 0; i < mechanics.sphereMass.size(); ++i) {
    const auto at = 6 * static_cast<Eigen::Index>(i);
    sum += mechanics.sphereMass[i] * motion.segment<3>(at).squaredNorm() +
           symmetricEigen(mechanics.sphereInertia[i]).values[0] * motion.segment<3>(at + 3).squaredNorm();
  }
  return sum;
}

LowestMode lowestMode(const BodyDescription& body, const BodyMechanics& mechanics) {
  const SoftBodyModel& m = *body.model;
  const std::vector<int> free = freeFreedoms(mechanics);
  const int count = static_cast<int>(free.size());
  const std::vector<int> freedom = placesOf(free, m);
  const RestRates links = linkRates(m, mechanics);
  const RestRates held = heldRates(body, mechanics);
  if (count == 0 || links.rows() + held.rows() == 0) return {};

  const RestRates toFree = freeOnly(freedom, count), ofLinks = links * toFree, ofNodes = held * toFree;
  Eigen::SparseMatrix<double> k = ofLinks.transpose() * ofLinks;
  if (ofNodes.rows() > 0) k += Eigen::SparseMatrix<double>(ofNodes.transpose() * ofNodes);
  const Eigen::SparseMatrix<double> mm = wholeMasses(body, freedom, count);

  // Inverse iteration, rigid motions projected out; a shift far below any mode keeps the factorisation regular.
  MatrixXd rigid = rigidMotionsLeft(body, mechanics, freedom, count);
  for (int i = 0; i < rigid.cols(); ++i) {
    for (int j = 0; j < i; ++j) rigid.col(i) -= rigid.col(j).dot(mm * rigid.col(i)) * rigid.col(j);
    rigid.col(i) /= std::sqrt(rigid.col(i).dot(mm * rigid.col(i)));
  }
  if (rigid.cols() >= count) return {};
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
  const double squared = x.dot(k * x);
  if (!(squared > 0)) return {};
  LowestMode out{.frequency = std::sqrt(squared)};
  const VectorXd motion = toFree * x;
  if (ofNodes.rows() > 0) {
    const LayerEnergy layer = layerEnergy(body, mechanics, motion);
    const double ofLinksAlone = (ofLinks * x).squaredNorm(), all = ofLinksAlone + layer.all;
    out.linkShare = ofLinksAlone / all;
    out.attachedShare = layer.attached / all;
  }
  out.ownShare = ownShareOf(mechanics, motion);
  return out;
}

}  // namespace

double explicitLimit(const BodyDescription& body) {
  BodyMechanics mechanics = bodyMechanics(body);
  return dampBody(body, mechanics, Integrator::explicitEuler);
}

double lowestFrequency(const BodyDescription& body, const BodyMechanics& mechanics) {
  return lowestMode(body, mechanics).frequency;
}

std::vector<double> naturalFrequencies(const BodyDescription& body, const BodyMechanics& mechanics, int count) {
  constexpr double kNothing = 1e-15;  // of the largest eigenvalue: what no link resists
  const RestModel rest(body, mechanics);
  const std::vector<int> free = freeFreedoms(mechanics);
  if (free.empty()) return {};
  const RestRates held = heldRates(body, mechanics);
  const MatrixXd all = rest.linkStiffness() + MatrixXd(held.transpose() * held);
  const MatrixXd mass = rest.carriedMass(mechanics)(free, free);
  const VectorXd modes = eigenvaluesOf(all(free, free), mass);
  // As many as there are rigid motions are these. (By their size: of slender bodies true modes were below any share of
  // the largest that rounding leaves of rigid ones.)
  const auto freeCount = static_cast<int>(free.size());
  const Eigen::Index rigid = rigidMotionsLeft(body, mechanics, placesOf(free, *body.model), freeCount).cols();
  std::vector<double> out;
  for (Eigen::Index k = rigid; k < modes.size() && static_cast<int>(out.size()) < count; ++k)
    if (modes[k] > kNothing * modes.maxCoeff()) out.push_back(std::sqrt(modes[k]) / (2 * std::numbers::pi));
  return out;
}

void raiseRotaryInertia(const RestModel& rest, BodyMechanics& mechanics) {
  // A step that is shorter by 2.5 % is let be; moments of inertia grow by a hundredth in all at most.
  constexpr double kExcess = 1.05, kMostAdded = 0.01, kLeastShare = 0.125;
  BodyMechanics locked = mechanics;
  locked.turns.assign(locked.turns.size(), false);
  const double moving = rest.largestEigenvalue(locked, 1, 1);
  if (!(moving > 0)) return;
  const double most = (1 + kMostAdded) * sumOfTraces(mechanics.sphereInertia);
  double fastest = rest.largestEigenvalue(mechanics, 1, 1);
  std::vector<Matrix3d> stiffness;
  for (int i = 0; fastest > kExcess * moving && i < static_cast<int>(mechanics.turns.size()); ++i)
    stiffness.push_back(mechanics.turns[i] ? rest.turningStiffness(i) : Matrix3d::Zero());
  for (double share = 1; fastest > kExcess * moving && share >= kLeastShare; share /= 2) {
    BodyMechanics raised = mechanics;
    for (std::size_t i = 0; i < stiffness.size(); ++i)
      raised.sphereInertia[i] += positivePart(stiffness[i] / (share * moving) - mechanics.sphereInertia[i]);
    if (sumOfTraces(raised.sphereInertia) > most) return;
    fastest = rest.largestEigenvalue(raised, 1, 1);
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
  if (integrator == Integrator::explicitEuler) raiseRotaryInertia(rest, mechanics);
  const double all = rest.largestEigenvalue(mechanics, 1, 1), links = rest.largestEigenvalue(mechanics, 1, 0),
               surface = rest.largestEigenvalue(mechanics, 0, 1);
  const LowestMode mode = lowestMode(body, mechanics);
  double lowest = mode.frequency;
  if (!(lowest > 0)) lowest = std::sqrt(std::max(links, surface));
  mechanics.lowestFrequency = lowest;
  const double asked = lowest > 0 ? 2 * body.tissue.damping / lowest : 0;
  mechanics.surfaceRelaxation = surface > 0 ? std::min(asked, 2 * kLargestSurfaceRatio / std::sqrt(surface)) : 0;
  const double shortest = stableStep(all, 0) / kLargestCost;
  const double largestDamping = (4 / shortest - shortest * all) / 2;
  const double bound = links > 0 ? (largestDamping - mechanics.surfaceRelaxation * surface) / links : asked;
  mechanics.linkRelaxation = std::min(asked, std::max(0.0, bound));
  // An implicit step has no limit to keep, and beta alone: it makes up for the edges, which are not damped.
  if (integrator == Integrator::implicit)
    mechanics.linkRelaxation = mechanics.surfaceRelaxation = asked / (mode.linkShare + mode.attachedShare);
  // It acts on the spheres for all that hangs on them, too.
  const double relaxes = mode.linkShare * mechanics.linkRelaxation + mode.attachedShare * mechanics.surfaceRelaxation;
  const auto damping = [&](double relaxation) { return (relaxation - relaxes) * lowest * lowest / mode.ownShare; };
  mechanics.massDamping = integrator == Integrator::implicit ? 0 : damping(asked);
  // Nobody watches bodies settle: critical damping of the lowest mode brings them to rest soonest.
  mechanics.settlingDamping = lowest > 0 ? damping(std::max(asked, 2 / lowest)) : 0;
  // Both matrices are sums of the links' and the surface's, and the modes that are stiffest are not those damped most:
  // the step is searched for where the largest eigenvalue of h^2 K + 2 h C itself reaches 4. What the mass-proportional
  // part takes of the spheres' velocities in a step, l = h alpha / (1 + h alpha) of them, counts twice: at l = 1 a step
  // is one of gradient descent, which is stable up to h^2 K = 2.
  const double linkBeta = mechanics.linkRelaxation, surfaceBeta = mechanics.surfaceRelaxation;
  // That goes with a power of h between the first and the second, nearly the second: each round leaves a tenth of the
  // deviation, coming from a step that is too short.
  constexpr int kRounds = 2;
  const auto lost = [&](double h) { return 1 - 1 / (1 + h * mechanics.massDamping); };
  double step = stableStep(all, rest.largestEigenvalue(mechanics, linkBeta, surfaceBeta));
  if (mechanics.massDamping > 0) step *= std::sqrt(1 - 0.5 * lost(step));
  for (int i = 0; i < kRounds && step < std::numeric_limits<double>::infinity(); ++i) {
    const double square = step * step;
    step *= std::sqrt(4 / rest.largestEigenvalue(mechanics, square + 2 * step * linkBeta,
                                                 square + 2 * step * surfaceBeta, 2 * lost(step)));
  }
  return step;
}

std::optional<MatrixXd> skeletonResponse(const BodyDescription& body, const BodyMechanics& mechanics,
                                         const MatrixXd& forces) {
  const RestModel model(body, mechanics);
  const std::vector<int> free = freeFreedoms(mechanics);
  const RestRates held = heldNodeRates(body, mechanics);
  const MatrixXd all = model.linkStiffness() + MatrixXd(held.transpose() * held);
  const MatrixXd stiffness = all(free, free), loads = model.onSpheres(forces);
  const VectorXd unit = stiffness.diagonal().cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<MatrixXd> factor(unit.asDiagonal() * stiffness * unit.asDiagonal());
  constexpr double kFree = 1e-9;  // of what each freedom bears alone: a motion that nothing holds
  if (!free.empty() && !(factor.vectorD().minCoeff() > kFree)) return std::nullopt;
  MatrixXd motions = MatrixXd::Zero(loads.rows(), loads.cols());
  motions(free, Eigen::all) = unit.asDiagonal() * factor.solve(unit.asDiagonal() * loads(free, Eigen::all));
  MatrixXd out = model.carried(motions);
  for (const int n : body.fixedNodes) out.middleRows<3>(3 * static_cast<Eigen::Index>(n)).setZero();
  return out;
}

}  // namespace medulla
