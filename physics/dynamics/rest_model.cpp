#include "physics/dynamics/rest_model.h"

#include <Eigen/Dense>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

namespace medulla {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

// The largest eigenvalue, and the last component of its unit vector. `beside` is one shorter than `diagonal`.
std::pair<double, double> largestOfTridiagonal(const std::vector<double>& diagonal, const std::vector<double>& beside) {
  const auto n = static_cast<Eigen::Index>(diagonal.size());
  Eigen::SelfAdjointEigenSolver<MatrixXd> solver;
  solver.computeFromTridiagonal(VectorXd::Map(diagonal.data(), n), VectorXd::Map(beside.data(), n - 1));
  return {solver.eigenvalues()[n - 1], std::abs(solver.eigenvectors()(n - 1, n - 1))};
}

class Masses {
 public:
  Masses(const BodyMechanics& m, int spheres, int nodes) : m_(m), spheres_(spheres), nodes_(nodes) {
    for (const Matrix3d& i : m.sphereInertia) inverseInertia_.push_back(i.inverse());
  }
  VectorXd times(const VectorXd& x) const {
    VectorXd y = x;
    for (int i = 0; i < spheres_; ++i) {
      y.segment<3>(6 * i) *= m_.sphereMass[i];
      y.segment<3>(6 * i + 3) = m_.sphereInertia[i] * x.segment<3>(6 * i + 3);
    }
    for (int i = 0; i < nodes_; ++i) y.segment<3>(6 * spheres_ + 3 * i) *= m_.nodeMass[i];
    return y;
  }
  VectorXd divide(const VectorXd& x) const {  // fixed freedoms have no inverse mass
    VectorXd y = x;
    for (int i = 0; i < spheres_; ++i) {
      y.segment<3>(6 * i) *= m_.moves[i] ? 1 / m_.sphereMass[i] : 0;
      y.segment<3>(6 * i + 3) = (m_.turns[i] ? 1.0 : 0.0) * (inverseInertia_[i] * x.segment<3>(6 * i + 3));
    }
    for (int i = 0; i < nodes_; ++i) y.segment<3>(6 * spheres_ + 3 * i) *= m_.nodeMoves[i] ? 1 / m_.nodeMass[i] : 0;
    return y;
  }

 private:
  const BodyMechanics& m_;
  int spheres_, nodes_;
  std::vector<Matrix3d> inverseInertia_;
};

}  // namespace

RestModel::RestModel(const BodyDescription& body, const BodyMechanics& mechanics)
    : spheres_(static_cast<int>(mechanics.sphereMass.size())),
      nodes_(body.surface != SurfaceMode::skin ? static_cast<int>(mechanics.attachments.size()) : 0),
      links_(linkRates(*body.model, mechanics)),
      layer_(layerStiffness(*body.model, mechanics)),
      pressure_(pressureRates(*body.model, mechanics)) {
  for (std::size_t i = 0; i < mechanics.attachments.size(); ++i)
    anchors_.push_back(anchorRates(body, mechanics, static_cast<int>(i)));
}

VectorXd RestModel::stiffnessTimes(const VectorXd& x, double links, double surface) const {
  const int count = 6 * spheres_;
  VectorXd y = VectorXd::Zero(size());
  if (links != 0) y.head(count) = links * (links_.transpose() * (links_ * x.head(count)));
  if (surface == 0 || nodes_ == 0) return y;
  const VectorXd displaced = x.tail(3 * nodes_) - carriedBy(x);
  const VectorXd force = surface * (layer_ * displaced + pressure_ * (pressure_.transpose() * displaced));
  y.tail(3 * nodes_) = force;
  addOnSpheres(-force, y);
  return y;
}

// Lanczos' recurrence in the masses' inner product (Golub and Van Loan, Matrix Computations, 10.1). Only two vectors
// are kept: lost orthogonality brings copies of eigenvalues, which do not move the largest. Power iteration asks for
// several times the products and ends below it.
double RestModel::largestEigenvalue(const BodyMechanics& masses, double links, double surface, double spheres) const {
  constexpr int kMostSteps = 200, kStepsPerLook = 8;
  constexpr double kAccuracy = 1e-3;
  const Masses mass(masses, spheres_, nodes_);
  VectorXd before = VectorXd::Zero(size()), x(size());
  for (int i = 0; i < size(); ++i) x[i] = startValue(i);
  x = mass.divide(x);
  std::vector<double> diagonal, beside;  // of the tridiagonal matrix that M^-1 K is in the vectors so far
  double norm = std::sqrt(x.dot(mass.times(x))), largest = 0;
  while (norm > 0) {
    x /= norm;
    VectorXd force = stiffnessTimes(x, links, surface);
    if (spheres != 0) force.head(6 * spheres_) += spheres * mass.times(x).head(6 * spheres_);
    diagonal.push_back(x.dot(force));
    VectorXd next = mass.divide(force) - diagonal.back() * x;
    if (!beside.empty()) next -= beside.back() * before;
    norm = std::sqrt(next.dot(mass.times(next)));
    if (!std::isfinite(norm)) throw std::runtime_error("stiffness over mass is not finite");
    before = x;
    x = next;
    const int steps = static_cast<int>(diagonal.size());
    if (norm == 0 || steps % kStepsPerLook == 0 || steps == size()) {
      const auto [value, weight] = largestOfTridiagonal(diagonal, beside);
      largest = value;
      if (steps == kMostSteps || steps == size() || weight * norm <= kAccuracy * value) break;
    }
    beside.push_back(norm);
  }
  return largest;
}

Matrix3d RestModel::turningStiffness(int i) const {
  Matrix3d k;
  for (int c = 0; c < 3; ++c)
    k.col(c) = stiffnessTimes(VectorXd::Unit(size(), 6 * i + 3 + c), 1, 1).segment<3>(6 * i + 3);
  return k;
}

MatrixXd RestModel::linkStiffness() const {
  return MatrixXd(links_.transpose() * links_);
}

MatrixXd RestModel::carriedMass(const BodyMechanics& masses) const {
  MatrixXd mass = MatrixXd::Zero(6 * spheres_, 6 * spheres_);
  for (int i = 0; i < nodes_; ++i) {
    if (!masses.nodeMoves[i]) continue;
    for (const HostRate& a : anchors_[i]) {
      for (const HostRate& b : anchors_[i]) {
        Eigen::Matrix<double, 3, 6> rateA, rateB;
        rateA << a.linear, a.angular;
        rateB << b.linear, b.angular;
        mass.block<6, 6>(6 * a.sphere, 6 * b.sphere) += masses.nodeMass[i] * rateA.transpose() * rateB;
      }
    }
  }
  for (int i = 0; i < spheres_; ++i) {
    mass.block<3, 3>(6 * i, 6 * i) += masses.sphereMass[i] * Matrix3d::Identity();
    mass.block<3, 3>(6 * i + 3, 6 * i + 3) += masses.sphereInertia[i];
  }
  return mass;
}

MatrixXd RestModel::carried(const MatrixXd& motions) const {
  MatrixXd out(3 * static_cast<Eigen::Index>(anchors_.size()), motions.cols());
  for (Eigen::Index load = 0; load < out.cols(); ++load) out.col(load) = carriedBy(motions.col(load));
  return out;
}

MatrixXd RestModel::onSpheres(const MatrixXd& forces) const {
  MatrixXd out(6 * spheres_, forces.cols());
  for (Eigen::Index load = 0; load < out.cols(); ++load) {
    VectorXd y = VectorXd::Zero(6 * spheres_);
    addOnSpheres(forces.col(load), y);
    out.col(load) = y;
  }
  return out;
}

double RestModel::startValue(int i) {
  std::uint64_t x = (static_cast<std::uint64_t>(i) + 1) * 0x9e3779b97f4a7c15U;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebU;
  return static_cast<double>(x >> 11) * 0x1p-53 - 0.5;
}

VectorXd RestModel::carriedBy(const VectorXd& spheres) const {
  VectorXd out(3 * static_cast<Eigen::Index>(anchors_.size()));
  for (Eigen::Index i = 0; 3 * i < out.size(); ++i) {
    Vector3d sum = Vector3d::Zero();
    for (const HostRate& h : anchors_[i])
      sum += h.linear * spheres.segment<3>(6 * h.sphere) + h.angular * spheres.segment<3>(6 * h.sphere + 3);
    out.segment<3>(3 * i) = sum;
  }
  return out;
}

void RestModel::addOnSpheres(const VectorXd& forces, VectorXd& y) const {
  for (Eigen::Index i = 0; 3 * i < forces.size(); ++i) {
    const Vector3d f = forces.segment<3>(3 * i);
    for (const HostRate& h : anchors_[i]) {
      y.segment<3>(6 * h.sphere) += h.linear.transpose() * f;
      y.segment<3>(6 * h.sphere + 3) += h.angular.transpose() * f;
    }
  }
}

}  // namespace medulla
