#include "physics/dynamics/rest_modes.h"

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "physics/dynamics/identified_mechanics.h"
#include "physics/dynamics/rest_measures.h"

namespace medulla {

namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

class RestModel {
 public:
  RestModel(const BodyDescription& body, const BodyMechanics& mechanics)
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

  int size() const { return 6 * spheres_ + 3 * nodes_; }

  // y = (links * K_links + surface * K_surface) x
  VectorXd stiffnessTimes(const VectorXd& x, double links, double surface) const {
    VectorXd y = VectorXd::Zero(size());
    for (const MeasureRow& r : rows_) {
      const int i0 = 6 * r.sphere0, i1 = 6 * r.sphere1;
      if (i1 < 0) {
        const double f = links * r.stiffness * (r.turn0.dot(x.segment<3>(i0 + 3)) - r.line.dot(x.segment<3>(i0)));
        y.segment<3>(i0) -= f * r.line;
        y.segment<3>(i0 + 3) += f * r.turn0;
        continue;
      }
      const double rate = r.line.dot(x.segment<3>(i1) - x.segment<3>(i0)) + r.turn0.dot(x.segment<3>(i0 + 3)) +
                          r.turn1.dot(x.segment<3>(i1 + 3));
      const double f = links * r.stiffness * rate;
      y.segment<3>(i1) += f * r.line;
      y.segment<3>(i0) -= f * r.line;
      y.segment<3>(i0 + 3) += f * r.turn0;
      y.segment<3>(i1 + 3) += f * r.turn1;
    }
    addStrains(x, links, y);
    if (nodes_ == 0) return y;
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
      y.segment<3>(node(i)) += surface * force[i];
      addAnchorLoad(i, -surface * force[i], y);
    }
    return y;
  }

  // The largest eigenvalue of M^-1 K by power iteration from a fixed start; it is approached from below, within about 2
  // %.
  double largestEigenvalue(double links, double surface) const {
    constexpr int kIterations = 150;
    VectorXd x(size());
    for (int i = 0; i < size(); ++i) x[i] = startValue(i);
    x = divideByMass(x);
    double eigenvalue = 0;
    for (int k = 0; k < kIterations; ++k) {
      const double norm = std::sqrt(x.dot(timesMass(x)));
      if (!std::isfinite(norm)) throw std::runtime_error("stiffness over mass is not finite");
      if (!(norm > 0)) return 0;
      x /= norm;
      const VectorXd force = stiffnessTimes(x, links, surface);
      eigenvalue = x.dot(force);
      x = divideByMass(force);
    }
    return eigenvalue;
  }

  // Stiffness of the links, and mass with the nodes' through their anchors' motion J: M + J^T m J. 6 spheres square.
  MatrixXd linkStiffness() const {
    MatrixXd k(6 * spheres_, 6 * spheres_);
    for (int i = 0; i < k.cols(); ++i) k.col(i) = stiffnessTimes(VectorXd::Unit(size(), i), 1, 0).head(k.rows());
    return k;
  }
  MatrixXd carriedMass() const {
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

  // Where the spheres' motions (6 spheres x loads) carry the nodes, and what forces on the nodes do to the spheres.
  MatrixXd carried(const MatrixXd& motions) const {
    MatrixXd out(3 * static_cast<Eigen::Index>(mechanics_.attachments.size()), motions.cols());
    for (Eigen::Index load = 0; load < out.cols(); ++load) {
      const VectorXd x = motions.col(load);
      for (int i = 0; 3 * i < out.rows(); ++i) out.block<3, 1>(3 * i, load) = anchorRate(i, x);
    }
    return out;
  }
  MatrixXd onSpheres(const MatrixXd& forces) const {
    MatrixXd out(6 * spheres_, forces.cols());
    for (Eigen::Index load = 0; load < out.cols(); ++load) {
      VectorXd y = VectorXd::Zero(6 * spheres_);
      for (int i = 0; 3 * i < forces.rows(); ++i) addAnchorLoad(i, forces.block<3, 1>(3 * i, load), y);
      out.col(load) = y;
    }
    return out;
  }

  // A repeatable, structureless start vector: the fractional parts of multiples of the golden ratio.
  static double startValue(int i) {
    const double a = 0.6180339887498949 * (i + 1);
    return a - std::floor(a) - 0.5;
  }

 private:
  int node(int i) const { return 6 * spheres_ + 3 * i; }

  void addStrains(const VectorXd& x, double scale, VectorXd& y) const {
    for (const StrainRow& r : strains_) {
      double rate = 0;
      for (std::size_t k = 0; k < r.spheres.size(); ++k) rate += r.rates[k].dot(x.segment<6>(6 * r.spheres[k]));
      for (std::size_t k = 0; k < r.spheres.size(); ++k) y.segment<6>(6 * r.spheres[k]) += scale * rate * r.rates[k];
    }
  }

  std::vector<int> hostsOf(int i) const {
    std::vector<int> out;
    if (!hosts_.empty()) {
      for (const HostRate& h : hosts_[i]) out.push_back(h.sphere);
      return out;
    }
    const Attachment& a = mechanics_.attachments[i];
    if (!a.onLink) return {a.host};
    return {model_.links[a.host].sphere0, model_.links[a.host].sphere1};
  }

  // An anchor on a link, at rest.
  struct LinkAnchor {
    int s0, s1;  // the spheres' places in the vector of freedoms
    double along, twistShare, length, thinning;
    Vector3d n, arm0, arm1, offset;
    double bump;  // m, of the centre line per turn of its ends against each other (anchor.h); 0 where it stays a chord
  };

  LinkAnchor linkAnchor(int i) const {
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
  Vector3d anchorRate(int i, const VectorXd& x) const {
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
  void addAnchorLoad(int i, const Vector3d& f, VectorXd& y) const {
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

  VectorXd timesMass(const VectorXd& x) const {
    VectorXd y = x;
    for (int i = 0; i < spheres_; ++i) {
      y.segment<3>(6 * i) *= mechanics_.sphereMass[i];
      y.segment<3>(6 * i + 3) = mechanics_.sphereInertia[i] * x.segment<3>(6 * i + 3);
    }
    for (int i = 0; i < nodes_; ++i) y.segment<3>(node(i)) *= mechanics_.nodeMass[i];
    return y;
  }

  // Fixed freedoms have no inverse mass.
  VectorXd divideByMass(const VectorXd& x) const {
    VectorXd y = x;
    for (int i = 0; i < spheres_; ++i) {
      y.segment<3>(6 * i) *= mechanics_.moves[i] ? 1 / mechanics_.sphereMass[i] : 0;
      y.segment<3>(6 * i + 3) = (mechanics_.turns[i] ? 1.0 : 0.0) * (inverseInertia_[i] * x.segment<3>(6 * i + 3));
    }
    for (int i = 0; i < nodes_; ++i) y.segment<3>(node(i)) *= mechanics_.nodeMoves[i] ? 1 / mechanics_.nodeMass[i] : 0;
    return y;
  }

  const SoftBodyModel& model_;
  const BodyMechanics& mechanics_;
  std::vector<MeasureRow> rows_;
  std::vector<StrainRow> strains_;
  std::vector<Matrix3d> inverseInertia_;
  std::vector<std::vector<HostRate>> hosts_;  // per node of an identified body; empty of others
  bool isBeam_;
  double thinning_;  // relative, of what hangs on a link, per relative stretch
  int spheres_, nodes_;
};

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
  // Of a square matrix, which needs no QR first.
  const Eigen::JacobiSVD<MatrixXd, Eigen::NoQRPreconditioner> svd(fixed.transpose() * fixed, Eigen::ComputeFullV);
  MatrixXd out(freeCount, 0);
  for (int k = 0; k < 6; ++k) {
    if (svd.singularValues()[k] > 1e-12 * size * size) continue;
    out.conservativeResize(Eigen::NoChange, out.cols() + 1);
    out.rightCols(1) = free * svd.matrixV().col(k);
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
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> modes(stiffness, mass, Eigen::EigenvaluesOnly);
  std::vector<double> out;
  for (const double squared : modes.eigenvalues())
    if (squared > kRigid * modes.eigenvalues().maxCoeff() && static_cast<int>(out.size()) < count)
      out.push_back(std::sqrt(squared) / (2 * std::numbers::pi));
  return out;
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
