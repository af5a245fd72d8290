#include "physics/dynamics/rest_model.h"

#include <Eigen/Dense>
#include <Eigen/SparseCore>
#include <cmath>
#include <stdexcept>
#include <utility>

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

}  // namespace

RestModel::RestModel(const BodyDescription& body, const BodyMechanics& mechanics)
    : model_(*body.model),
      mechanics_(mechanics),
      rows_(measureRows(*body.model, mechanics)),
      strains_(strainRows(*body.model, mechanics)),
      isBeam_(body.links == LinkModel::beam),
      thinning_(isBeam_ ? body.tissue.poisson : 0),
      spheres_(static_cast<int>(mechanics.sphereMass.size())),
      nodes_(body.surface != SurfaceMode::skin ? static_cast<int>(mechanics.attachments.size()) : 0) {
  for (const Matrix3d& i : mechanics.sphereInertia) inverseInertia_.push_back(i.inverse());
  for (std::size_t i = 0; i < mechanics.skin.size(); ++i)
    hosts_.push_back(hostRates(model_, mechanics.skin[i], static_cast<int>(i)));
}

VectorXd RestModel::stiffnessTimes(const VectorXd& x, double links, double surface) const {
  VectorXd y = VectorXd::Zero(size());
  addLinks(x, links, y);
  addStrains(x, links, y);
  if (nodes_ > 0) addSurface(x, surface, y);
  return y;
}

void RestModel::addLinks(const VectorXd& x, double scale, VectorXd& y) const {
  for (const MeasureRow& r : rows_) {
    const int i0 = 6 * r.sphere0, i1 = 6 * r.sphere1;
    if (i1 < 0) {
      const double f = scale * r.stiffness * (r.turn0.dot(x.segment<3>(i0 + 3)) - r.line.dot(x.segment<3>(i0)));
      y.segment<3>(i0) -= f * r.line;
      y.segment<3>(i0 + 3) += f * r.turn0;
      continue;
    }
    const double rate = r.line.dot(x.segment<3>(i1) - x.segment<3>(i0)) + r.turn0.dot(x.segment<3>(i0 + 3)) +
                        r.turn1.dot(x.segment<3>(i1 + 3));
    const double f = scale * r.stiffness * rate;
    y.segment<3>(i1) += f * r.line;
    y.segment<3>(i0) -= f * r.line;
    y.segment<3>(i0 + 3) += f * r.turn0;
    y.segment<3>(i1 + 3) += f * r.turn1;
  }
}

void RestModel::addStrains(const VectorXd& x, double scale, VectorXd& y) const {
  for (const StrainRow& r : strains_) {
    double rate = 0;
    for (std::size_t k = 0; k < r.spheres.size(); ++k) rate += r.rates[k].dot(x.segment<6>(6 * r.spheres[k]));
    for (std::size_t k = 0; k < r.spheres.size(); ++k) y.segment<6>(6 * r.spheres[k]) += scale * rate * r.rates[k];
  }
}

void RestModel::addSurface(const VectorXd& x, double scale, VectorXd& y) const {
  std::vector<Vector3d> displaced(nodes_), force(nodes_);
  std::vector<double> onLinks(model_.links.size(), 0), onSpheres(model_.spheres.size(), 0);  // volumes
  const auto volume = [&](const Attachment& a) -> double& { return (a.onLink ? onLinks : onSpheres)[a.host]; };
  for (int i = 0; i < nodes_; ++i) {
    displaced[i] = x.segment<3>(node(i)) - anchorRate(i, x);
    force[i] = mechanics_.attachmentStiffness[i] * displaced[i];
    const Attachment& a = mechanics_.attachments[i];
    volume(a) += a.area * mechanics_.normal[i].dot(displaced[i]);
  }
  for (int i = 0; i < nodes_; ++i) {
    const Attachment& a = mechanics_.attachments[i];
    const double bulk = (a.onLink ? mechanics_.linkBulk : mechanics_.sphereBulk)[a.host];
    force[i] += bulk * volume(a) * a.area * mechanics_.normal[i];
    if (!hosts_.empty())
      force[i] += mechanics_.normalExcess[i] * mechanics_.normal[i].dot(displaced[i]) * mechanics_.normal[i];
  }
  for (std::size_t e = 0; e < model_.edges.size(); ++e) {
    const auto& [a, b] = model_.edges[e];
    const Vector3d f = mechanics_.edgeStiffness[e] * (displaced[b] - displaced[a]);
    force[b] += f;
    force[a] -= f;
  }
  for (int i = 0; i < nodes_; ++i) {
    y.segment<3>(node(i)) += scale * force[i];
    addAnchorLoad(i, -scale * force[i], y);
  }
}

// Lanczos' recurrence in the masses' inner product (Golub and Van Loan, Matrix Computations, 10.1). Only two vectors
// are kept: lost orthogonality brings copies of eigenvalues, which do not move the largest. Power iteration asks for
// several times the products and ends below it.
double RestModel::largestEigenvalue(double links, double surface) const {
  constexpr int kMostSteps = 200, kStepsPerLook = 8;
  constexpr double kAccuracy = 1e-3;
  VectorXd before = VectorXd::Zero(size()), x(size());
  for (int i = 0; i < size(); ++i) x[i] = startValue(i);
  x = divideByMass(x);
  std::vector<double> diagonal, beside;  // of the tridiagonal matrix that M^-1 K is in the vectors so far
  double norm = std::sqrt(x.dot(timesMass(x))), largest = 0;
  while (norm > 0) {
    x /= norm;
    const VectorXd force = stiffnessTimes(x, links, surface);
    diagonal.push_back(x.dot(force));
    VectorXd next = divideByMass(force) - diagonal.back() * x;
    if (!beside.empty()) next -= beside.back() * before;
    norm = std::sqrt(next.dot(timesMass(next)));
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
  MatrixXd k(6 * spheres_, 6 * spheres_);
  for (int i = 0; i < k.cols(); ++i) k.col(i) = stiffnessTimes(VectorXd::Unit(size(), i), 1, 0).head(k.rows());
  return k;
}

MatrixXd RestModel::carriedMass() const {
  const int count = 6 * spheres_;
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < nodes_; ++i) {
    const double root = mechanics_.nodeMoves[i] ? std::sqrt(mechanics_.nodeMass[i]) : 0;
    for (const int host : hostsOf(i))
      for (int k = 6 * host; k < 6 * host + 6; ++k) {
        const Vector3d rate = root * anchorRate(i, VectorXd::Unit(count, k));
        for (int c = 0; c < 3; ++c) entries.emplace_back(3 * i + c, k, rate[c]);
      }
  }
  Eigen::SparseMatrix<double> motion(3 * nodes_, count);
  motion.setFromTriplets(entries.begin(), entries.end());
  MatrixXd mass = motion.transpose() * motion;
  for (int i = 0; i < spheres_; ++i) {
    mass.block<3, 3>(6 * i, 6 * i) += mechanics_.sphereMass[i] * Matrix3d::Identity();
    mass.block<3, 3>(6 * i + 3, 6 * i + 3) += mechanics_.sphereInertia[i];
  }
  return mass;
}

MatrixXd RestModel::carried(const MatrixXd& motions) const {
  MatrixXd out(3 * static_cast<Eigen::Index>(mechanics_.attachments.size()), motions.cols());
  for (Eigen::Index load = 0; load < out.cols(); ++load) {
    const VectorXd x = motions.col(load);
    for (int i = 0; 3 * i < out.rows(); ++i) out.block<3, 1>(3 * i, load) = anchorRate(i, x);
  }
  return out;
}

MatrixXd RestModel::onSpheres(const MatrixXd& forces) const {
  MatrixXd out(6 * spheres_, forces.cols());
  for (Eigen::Index load = 0; load < out.cols(); ++load) {
    VectorXd y = VectorXd::Zero(6 * spheres_);
    for (int i = 0; 3 * i < forces.rows(); ++i) addAnchorLoad(i, forces.block<3, 1>(3 * i, load), y);
    out.col(load) = y;
  }
  return out;
}

double RestModel::startValue(int i) {
  const double a = 0.6180339887498949 * (i + 1);
  return a - std::floor(a) - 0.5;
}

std::vector<int> RestModel::hostsOf(int i) const {
  std::vector<int> out;
  if (!hosts_.empty()) {
    for (const HostRate& h : hosts_[i]) out.push_back(h.sphere);
    return out;
  }
  const Attachment& a = mechanics_.attachments[i];
  if (!a.onLink) return {a.host};
  return {model_.links[a.host].sphere0, model_.links[a.host].sphere1};
}

RestModel::LinkAnchor RestModel::linkAnchor(int i) const {
  const Attachment& a = mechanics_.attachments[i];
  const ElasticLink& l = model_.links[a.host];
  const LinkSpan& span = mechanics_.spans[a.host];
  const Vector3d line = span.end1 - span.end0;
  const double length = line.norm();
  return {6 * l.sphere0,
          6 * l.sphere1,
          a.along,
          mechanics_.twistShare[i],
          length,
          thinning_ / length,
          line / length,
          span.end0 - model_.spheres[l.sphere0].restFrame,
          span.end1 - model_.spheres[l.sphere1].restFrame,
          a.restOffset,
          0.5 * a.along * (1 - a.along) * (isBeam_ ? length : 0)};
}

// Where freedoms' rates x carry the anchor of node i.
Vector3d RestModel::anchorRate(int i, const VectorXd& x) const {
  if (!hosts_.empty()) {
    Vector3d sum = Vector3d::Zero();
    for (const HostRate& h : hosts_[i])
      sum += h.linear * x.segment<3>(6 * h.sphere) + h.angular * x.segment<3>(6 * h.sphere + 3);
    return sum;
  }
  const Attachment& a = mechanics_.attachments[i];
  if (!a.onLink) return x.segment<3>(6 * a.host) + x.segment<3>(6 * a.host + 3).cross(a.restOffset);
  const LinkAnchor p = linkAnchor(i);
  const Vector3d w0 = x.segment<3>(p.s0 + 3), w1 = x.segment<3>(p.s1 + 3);
  const Vector3d v0 = x.segment<3>(p.s0) + w0.cross(p.arm0), dv = x.segment<3>(p.s1) + w1.cross(p.arm1) - v0;
  const double spin = p.n.dot((1 - p.twistShare) * w0 + p.twistShare * w1);
  const Vector3d leaning = isBeam_ ? Vector3d((1 - p.along) * w0 + p.along * w1) : p.n.cross(dv) / p.length;
  const Vector3d omega = leaning + (spin - p.n.dot(leaning)) * p.n;
  return v0 + p.along * dv + p.bump * (w0 - w1).cross(p.n) + omega.cross(p.offset) -
         p.thinning * p.n.dot(dv) * p.offset;
}

// The transpose: y += what a force f on the anchor of node i does to its spheres.
void RestModel::addAnchorLoad(int i, const Vector3d& f, VectorXd& y) const {
  if (!hosts_.empty()) {
    for (const HostRate& h : hosts_[i]) {
      y.segment<3>(6 * h.sphere) += h.linear.transpose() * f;
      y.segment<3>(6 * h.sphere + 3) += h.angular.transpose() * f;
    }
    return;
  }
  const Attachment& a = mechanics_.attachments[i];
  if (!a.onLink) {
    y.segment<3>(6 * a.host) += f;
    y.segment<3>(6 * a.host + 3) += a.restOffset.cross(f);
    return;
  }
  const LinkAnchor p = linkAnchor(i);
  const Vector3d moment = p.offset.cross(f);
  const Vector3d about = p.n.dot(moment) * p.n, lean = moment - about;
  const Vector3d swing = (isBeam_ ? Vector3d(Vector3d::Zero()) : Vector3d(moment.cross(p.n) / p.length)) -
                         p.thinning * p.offset.dot(f) * p.n;
  const Vector3d f0 = (1 - p.along) * f - swing, f1 = p.along * f + swing;
  const Vector3d bow = p.bump * p.n.cross(f);
  const double leaning = isBeam_ ? 1 : 0;
  y.segment<3>(p.s0) += f0;
  y.segment<3>(p.s1) += f1;
  y.segment<3>(p.s0 + 3) += (1 - p.twistShare) * about + leaning * (1 - p.along) * lean + bow + p.arm0.cross(f0);
  y.segment<3>(p.s1 + 3) += p.twistShare * about + leaning * p.along * lean - bow + p.arm1.cross(f1);
}

VectorXd RestModel::timesMass(const VectorXd& x) const {
  VectorXd y = x;
  for (int i = 0; i < spheres_; ++i) {
    y.segment<3>(6 * i) *= mechanics_.sphereMass[i];
    y.segment<3>(6 * i + 3) = mechanics_.sphereInertia[i] * x.segment<3>(6 * i + 3);
  }
  for (int i = 0; i < nodes_; ++i) y.segment<3>(node(i)) *= mechanics_.nodeMass[i];
  return y;
}

// Fixed freedoms have no inverse mass.
VectorXd RestModel::divideByMass(const VectorXd& x) const {
  VectorXd y = x;
  for (int i = 0; i < spheres_; ++i) {
    y.segment<3>(6 * i) *= mechanics_.moves[i] ? 1 / mechanics_.sphereMass[i] : 0;
    y.segment<3>(6 * i + 3) = (mechanics_.turns[i] ? 1.0 : 0.0) * (inverseInertia_[i] * x.segment<3>(6 * i + 3));
  }
  for (int i = 0; i < nodes_; ++i) y.segment<3>(node(i)) *= mechanics_.nodeMoves[i] ? 1 / mechanics_.nodeMass[i] : 0;
  return y;
}

}  // namespace medulla
