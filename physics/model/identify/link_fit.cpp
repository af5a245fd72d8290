#include "physics/model/identify/link_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/model/cross_matrix.h"
#include "physics/model/identify/lbfgs.h"
#include "physics/model/identify/parallel.h"
#include "physics/model/identify/skin_fit.h"
#include "physics/model/row_of_cells.h"
#include "physics/model/symmetric_eigen.h"

namespace medulla {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Matrix6x12d = Eigen::Matrix<double, 6, 12>;

namespace {

constexpr double kContactMin = 0.03;  // of the smaller cell's face: less is a corner or an edge

IdentifiedLink linkBetween(int frame0, int frame1, const Vector3d& from, const Vector3d& to) {
  IdentifiedLink link;
  link.frame0 = frame0;
  link.frame1 = frame1;
  link.restPoint0 = from;
  link.restPoint1 = to;
  const Vector3d d = to - from;
  const Vector3d along = d.norm() > 0 ? d.normalized().eval() : Vector3d::UnitX();
  const Vector3d aside = std::abs(along.z()) < 0.8 ? Vector3d::UnitZ() : Vector3d::UnitX();
  const Vector3d u = (aside - along * along.dot(aside)).normalized();
  link.axes << along.transpose(), u.transpose(), along.cross(u).transpose();
  return link;
}

// Area of the patch in each frame's cell, m2.
std::vector<double> heldAreas(const TriangleMesh& mesh, const CellFrames& cells, const std::vector<int>& triangles) {
  constexpr int parts = 4, points = parts * (parts + 1) / 2;
  std::vector<double> areas(cells.frames.size(), 0);
  for (const int t : triangles) {
    const Vector3d o = mesh.vertices[mesh.triangles[t][0]], u = mesh.vertices[mesh.triangles[t][1]] - o,
                   v = mesh.vertices[mesh.triangles[t][2]] - o;
    const double area = u.cross(v).norm() / 2 / points;
    for (int i = 0; i < parts; ++i)
      for (int j = 0; i + j < parts; ++j)
        areas[cellAt(cells.sites, o + (i + 1. / 3) / parts * u + (j + 1. / 3) / parts * v)] += area;
  }
  return areas;
}

}  // namespace

std::vector<IdentifiedLink> layOutLinks(const TriangleMesh& mesh, const CellFrames& cells,
                                        const std::vector<FixedPatch>& patches,
                                        const std::vector<std::vector<int>>& patchTriangles) {
  std::vector<IdentifiedLink> links;
  const auto face = [&](int i) { return std::cbrt(cells.frames[i].volume * cells.frames[i].volume); };
  std::vector<double> most(cells.frames.size(), 0);  // no cell goes without its largest contact
  for (const auto& [pair, area] : cells.contactArea) {
    most[pair.first] = std::max(most[pair.first], area);
    most[pair.second] = std::max(most[pair.second], area);
  }
  for (const auto& [pair, area] : cells.contactArea) {
    const auto [i, j] = pair;
    if (area < kContactMin * std::min(face(i), face(j)) && area < most[i] && area < most[j]) continue;
    links.push_back(linkBetween(i, j, cells.frames[i].restPosition, cells.frames[j].restPosition));
  }
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const std::vector<double> areas = heldAreas(mesh, cells, patchTriangles[p]);
    const double largest = *std::max_element(areas.begin(), areas.end());
    for (int i = 0; i < static_cast<int>(areas.size()); ++i) {
      if (areas[i] < kContactMin * face(i) && areas[i] < largest) continue;
      const Vector3d& from = cells.frames[i].restPosition;
      links.push_back(linkBetween(i, static_cast<int>(cells.frames.size() + p), from,
                                  mesh.vertices[nearestNode(mesh, patches[p], from)]));
    }
  }
  return links;
}

// Held at d + e instead of d, t = t' + e x w / 2. The trace of the stiffness on w is least, and what couples w and t
// symmetric, at (tr(A) 1 - A) e = -2 b, with A the stiffness on t and b the axial vector of that between w and t.
void centreClamp(double lengthScale, IdentifiedLink& link) {
  const Matrix3d a = link.stiffness.topLeftCorner<3, 3>(), b = lengthScale * link.stiffness.bottomLeftCorner<3, 3>();
  const Vector3d axial(b(1, 2) - b(2, 1), b(2, 0) - b(0, 2), b(0, 1) - b(1, 0));
  const Vector3d shift = -2 * (a.trace() * Matrix3d::Identity() - a).ldlt().solve(axial);
  const Vector3d to = link.restPoint1 + link.axes.transpose() * shift;
  constexpr double kLeast = 0.1;  // of the length scale: a cell that lies behind what is held is held at its own place
  if (!((to - link.restPoint0).norm() > kLeast * lengthScale)) return;
  IdentifiedLink moved = linkBetween(link.frame0, link.frame1, link.restPoint0, to);
  Matrix6d turn = Matrix6d::Zero();  // old measures from new ones
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = link.axes * moved.axes.transpose();
  turn.topRightCorner<3, 3>() = crossMatrix(shift) * turn.topLeftCorner<3, 3>() / (2 * lengthScale);
  const Matrix6d k = turn.transpose() * link.stiffness * turn;
  moved.stiffness = 0.5 * (k + k.transpose());
  moved.strain0 = turn.transpose() * link.strain0;
  link = moved;
}

Matrix6x12d linkMeasures(const IdentifiedLink& link, double lengthScale) {
  Matrix6x12d g = Matrix6x12d::Zero();
  const Matrix3d bend = link.axes * crossMatrix(link.restPoint1 - link.restPoint0) / (2 * lengthScale);
  g.block<3, 3>(0, 0) = -link.axes;
  g.block<3, 3>(0, 3) = bend;
  g.block<3, 3>(0, 6) = link.axes;
  g.block<3, 3>(0, 9) = bend;
  g.block<3, 3>(3, 3) = -link.axes;
  g.block<3, 3>(3, 9) = link.axes;
  return g;
}

namespace {

void addLink(const Eigen::Matrix<double, 12, 12>& k, int frame0, int frame1, int frames, MatrixXd& sum) {
  sum.block<6, 6>(6 * frame0, 6 * frame0) += k.topLeftCorner<6, 6>();
  if (frame1 >= frames) return;
  sum.block<6, 6>(6 * frame1, 6 * frame1) += k.bottomRightCorner<6, 6>();
  sum.block<6, 6>(6 * frame0, 6 * frame1) += k.topRightCorner<6, 6>();
  sum.block<6, 6>(6 * frame1, 6 * frame0) += k.bottomLeftCorner<6, 6>();
}

// By the motions of all frames: a row of measures of a link, and what a row of all frames does to its measures.
void addRow(const Vector6d& ofMeasures, const IdentifiedLink& link, const Matrix6x12d& g, int frames,
            Eigen::Ref<VectorXd> row) {
  const Eigen::Matrix<double, 12, 1> part = g.transpose() * ofMeasures;
  row.segment<6>(6 * link.frame0) += part.head<6>();
  if (link.frame1 < frames) row.segment<6>(6 * link.frame1) += part.tail<6>();
}
Vector6d onMeasures(const Eigen::Ref<const VectorXd>& row, const IdentifiedLink& link, const Matrix6x12d& g,
                    int frames) {
  Eigen::Matrix<double, 12, 1> part = Eigen::Matrix<double, 12, 1>::Zero();
  part.head<6>() = row.segment<6>(6 * link.frame0);
  if (link.frame1 < frames) part.tail<6>() = row.segment<6>(6 * link.frame1);
  return g * part;
}

// The cells' strains by the motions of all frames, a column each.
MatrixXd cellStrains(const std::vector<IdentifiedLink>& links, const std::vector<Matrix6x12d>& measures, int frames) {
  MatrixXd out = MatrixXd::Zero(6 * frames, frames);
  for (std::size_t l = 0; l < links.size(); ++l) {
    addRow(links[l].strain0, links[l], measures[l], frames, out.col(links[l].frame0));
    if (links[l].frame1 < frames) addRow(links[l].strain1, links[l], measures[l], frames, out.col(links[l].frame1));
  }
  return out;
}

Matrix6d measured(const MatrixXd& m, const IdentifiedLink& link, const Matrix6x12d& g, int frames) {
  Eigen::Matrix<double, 12, 12> part = Eigen::Matrix<double, 12, 12>::Zero();
  const int i = link.frame0, j = link.frame1;
  part.topLeftCorner<6, 6>() = m.block<6, 6>(6 * i, 6 * i);
  if (j < frames) {
    part.bottomRightCorner<6, 6>() = m.block<6, 6>(6 * j, 6 * j);
    part.topRightCorner<6, 6>() = m.block<6, 6>(6 * i, 6 * j);
    part.bottomLeftCorner<6, 6>() = m.block<6, 6>(6 * j, 6 * i);
  }
  return g * part * g.transpose();
}

// Unknowns: of each link the lower triangle (or the diagonal) of L in k = T L L^T T, where T undoes the scale of the
// compliance that finite elements give its measures; and with the whole triangle two vectors s in strain = T s.
class LinkFit {
 public:
  LinkFit(const MatrixXd& compliance, const MatrixXd& grounding, const LoadsOnCells& ends, double lengthScale,
          LinkForm form, std::vector<IdentifiedLink>& links)
      : compliance_(compliance),
        grounding_(grounding),
        ends_(ends),
        expected_(compliance),
        links_(links),
        frames_(static_cast<int>(compliance.rows() / 6)) {
    for (int b = 0; b < 6; ++b)
      for (int a = b; a < (form == LinkForm::diagonal ? b + 1 : 6); ++a) places_.push_back({a, b});
    perLink_ = static_cast<Index>(places_.size()) + (form == LinkForm::full ? 12 : 0);
    for (const IdentifiedLink& link : links) {
      measures_.push_back(linkMeasures(link, lengthScale));
      const Matrix6d h = measured(compliance, link, measures_.back(), frames_);
      if (form == LinkForm::diagonal) {
        scales_.push_back(h.diagonal().cwiseSqrt().cwiseInverse().asDiagonal());
      } else {
        const SymmetricEigen e = symmetricEigen(h);
        const Matrix6d vectors = e.vectors;
        scales_.push_back(vectors * Vector6d(e.values.cwiseInverse().cwiseSqrt()).asDiagonal() * vectors.transpose());
      }
    }
    const Index n = compliance.rows();
    // Rotations count for less: they reach the surface over a cell's radius only.
    weight_ = Eigen::Matrix<double, 6, 1>(1, 1, 1, 0.09, 0.09, 0.09).replicate(n / 6, 1);
    for (std::size_t e = 0; e < ends.cells.size(); ++e)
      expected_.middleCols<6>(6 * ends.cells[e]) = ends.motions.middleCols<6>(6 * static_cast<Index>(e));
    perResponse_ = (weight_.asDiagonal() * expected_.cwiseAbs2()).colwise().sum().cwiseInverse().transpose();
    if (!ends.cells.empty()) findRowAxes();
  }

  // Strains begin as a sum of elongations: at 0 they would stay.
  VectorXd start() const {
    constexpr double kStrain = 0.2;
    VectorXd x = VectorXd::Zero(static_cast<Index>(links_.size()) * perLink_);
    for (std::size_t l = 0; l < links_.size(); ++l) {
      auto own = x.segment(static_cast<Index>(l) * perLink_, perLink_);
      for (std::size_t k = 0; k < places_.size(); ++k)
        if (places_[k][0] == places_[k][1])
          own[static_cast<Index>(k)] = std::sqrt(static_cast<double>(frames_) / static_cast<double>(links_.size()));
      if (!hasStrains()) continue;
      // T = H^-1/2, so that T^-1 = H T.
      const Vector6d unscaled = measured(compliance_, links_[l], measures_[l], frames_) * scales_[l].col(0);
      own.tail<12>() = kStrain * unscaled.normalized().replicate<2, 1>();
    }
    return x;
  }

  void setLinks(const VectorXd& x) const {
    for (std::size_t l = 0; l < links_.size(); ++l) {
      const Matrix6d root = scales_[l] * unpacked(x, l);
      links_[l].stiffness = root * root.transpose();
      links_[l].strain0 = links_[l].strain1 = Vector6d::Zero();
      if (!hasStrains()) continue;
      const Index first = static_cast<Index>(l) * perLink_ + 21;
      links_[l].strain0 = scales_[l] * x.segment<6>(first);
      if (links_[l].frame1 < frames_) links_[l].strain1 = scales_[l] * x.segment<6>(first + 6);
    }
  }

  // KL divergence per freedom times `kl`, plus `response` times half the mean square relative error of the responses.
  double value(const VectorXd& x, VectorXd& gradient, double kl, double response) const {
    const Index n = compliance_.rows();
    setLinks(x);
    const MatrixXd strains = cellStrains(links_, measures_, frames_);
    MatrixXd stiffness = grounding_.size() > 0 ? grounding_ : MatrixXd::Zero(n, n);
    for (std::size_t l = 0; l < links_.size(); ++l) {
      const Matrix6d root = scales_[l] * unpacked(x, l);
      const Eigen::Matrix<double, 12, 6> g = measures_[l].transpose() * root;
      addLink(g * g.transpose(), links_[l].frame0, links_[l].frame1, frames_, stiffness);
    }
    if (hasStrains()) stiffness.noalias() += strains * strains.transpose();
    const Eigen::LLT<MatrixXd> cholesky(stiffness);
    if (cholesky.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
    const double logDeterminant = 2 * cholesky.matrixLLT().diagonal().array().log().sum();
    MatrixXd inverse = MatrixXd::Identity(n, n);
    overColumns([&](Index first, Index count) { cholesky.solveInPlace(inverse.middleCols(first, count)); });
    const auto size = static_cast<double>(n);
    double f = kl / size * (compliance_.cwiseProduct(stiffness).sum() - logDeterminant - size);
    MatrixXd slope = kl / size * (compliance_ - inverse);  // of f by the stiffness
    if (response > 0) {
      MatrixXd off = inverse;
      for (std::size_t k = 0; k < ends_.cells.size(); ++k)
        off.middleCols<6>(6 * ends_.cells[k]) = inverse * ends_.loads.middleCols<6>(6 * static_cast<Index>(k));
      off -= expected_;
      lessenOwnTwists(off);
      MatrixXd e = weight_.asDiagonal() * off * perResponse_.asDiagonal();
      f += response / (2 * size) * e.cwiseProduct(off).sum();
      lessenOwnTwists(e);
      e = slopeByInverse(e);
      e = (e + e.transpose()).eval() / (2 * size);
      MatrixXd product(n, n);
      overColumns([&](Index first, Index count) {
        product.middleCols(first, count).noalias() = inverse * e.middleCols(first, count);
      });
      overColumns([&](Index first, Index count) {
        slope.middleCols(first, count).noalias() -= response * product * inverse.middleCols(first, count);
      });
    }
    setGradient(x, slope, strains, gradient);
    return f;
  }

 private:
  template <typename Use>
  void overColumns(const Use& use) const {
    constexpr Index least = 120;  // fewer are done before another thread has begun
    if (compliance_.rows() < least) return use(Index{0}, compliance_.rows());
    inHalves(compliance_.rows(), use);
  }
  bool hasStrains() const { return perLink_ > static_cast<Index>(places_.size()); }
  Matrix6d unpacked(const VectorXd& x, std::size_t link) const {
    Matrix6d out = Matrix6d::Zero();
    for (std::size_t k = 0; k < places_.size(); ++k)
      out(places_[k][0], places_[k][1]) = x[static_cast<Index>(link) * perLink_ + static_cast<Index>(k)];
    return out;
  }
  // Of cells between others: the direction of the row.
  void findRowAxes() {
    rowAxes_.assign(frames_, Eigen::Vector3d::Zero());
    for (const IdentifiedLink& link : links_) {
      for (const int i : {link.frame0, link.frame1}) {
        if (i >= frames_ || std::find(ends_.cells.begin(), ends_.cells.end(), i) != ends_.cells.end()) continue;
        const Eigen::Vector3d along = link.axes.row(0).transpose();
        rowAxes_[i] += along.dot(rowAxes_[i]) < 0 ? Eigen::Vector3d(-along) : along;
      }
    }
    for (Eigen::Vector3d& axis : rowAxes_) axis.normalize();
  }
  // How far a cell turns about the row under a couple spread over it is less than any row of links that twists as the
  // body does under couples elsewhere: it would make them all the stiffer. At an end nothing else says how stiff its
  // link is.
  void lessenOwnTwists(MatrixXd& responses) const {
    constexpr double kOwn = 0.32;  // counts a tenth in the squares
    for (std::size_t i = 0; i < rowAxes_.size(); ++i) {
      auto turns = responses.block<3, 3>(6 * static_cast<Index>(i) + 3, 6 * static_cast<Index>(i) + 3);
      const Eigen::Vector3d& axis = rowAxes_[i];
      turns -= (1 - kOwn) * axis.dot(turns * axis) * axis * axis.transpose();
    }
  }
  // From the slope by the responses.
  MatrixXd slopeByInverse(const MatrixXd& byResponses) const {
    MatrixXd out = byResponses;
    for (const int cell : ends_.cells) out.middleCols<6>(6 * cell).setZero();
    for (std::size_t k = 0; k < ends_.cells.size(); ++k)
      out.noalias() += byResponses.middleCols<6>(6 * ends_.cells[k]) *
                       ends_.loads.middleCols<6>(6 * static_cast<Index>(k)).transpose();
    return out;
  }
  // From the value's slope by the stiffness.
  void setGradient(const VectorXd& x, const MatrixXd& slope, const MatrixXd& strains, VectorXd& gradient) const {
    const MatrixXd byStrains = 2 * slope * strains;
    for (std::size_t l = 0; l < links_.size(); ++l) {
      const IdentifiedLink& link = links_[l];
      auto own = gradient.segment(static_cast<Index>(l) * perLink_, perLink_);
      const Matrix6d g = 2 * scales_[l] * measured(slope, link, measures_[l], frames_) * scales_[l] * unpacked(x, l);
      for (std::size_t k = 0; k < places_.size(); ++k) own[static_cast<Index>(k)] = g(places_[k][0], places_[k][1]);
      if (!hasStrains()) continue;
      own.segment<6>(21) = scales_[l] * onMeasures(byStrains.col(link.frame0), link, measures_[l], frames_);
      own.tail<6>().setZero();
      if (link.frame1 < frames_)
        own.tail<6>() = scales_[l] * onMeasures(byStrains.col(link.frame1), link, measures_[l], frames_);
    }
  }

  const MatrixXd &compliance_, &grounding_;
  const LoadsOnCells& ends_;
  MatrixXd expected_;                     // responses, a column each: the compliance but for the ends'
  std::vector<Eigen::Vector3d> rowAxes_;  // unit, per cell, of those between others; empty of all but rows
  std::vector<IdentifiedLink>& links_;
  int frames_;
  std::vector<std::array<int, 2>> places_;
  Index perLink_;
  std::vector<Matrix6x12d> measures_;
  std::vector<Matrix6d> scales_;
  VectorXd weight_, perResponse_;
};

}  // namespace

MatrixXd networkStiffness(const std::vector<IdentifiedLink>& links, double lengthScale, int frames) {
  std::vector<Matrix6x12d> measures;
  MatrixXd sum = MatrixXd::Zero(6 * frames, 6 * frames);
  for (const IdentifiedLink& link : links) {
    const Matrix6x12d& g = measures.emplace_back(linkMeasures(link, lengthScale));
    addLink(g.transpose() * link.stiffness * g, link.frame0, link.frame1, frames, sum);
  }
  const MatrixXd strains = cellStrains(links, measures, frames);
  return sum + strains * strains.transpose();
}

void fitLinks(const MatrixXd& compliance, const MatrixXd& grounding, const LoadsOnCells& ends, double lengthScale,
              LinkForm form, std::vector<IdentifiedLink>& links, const std::function<void(double)>& progress) {
  constexpr int warmUp = 60;
  // An iteration costs the cube of the frames: few of them have time for more.
  const int iterations = std::clamp(static_cast<int>(6 * 6000 / compliance.rows()), 300, 1000);
  // Links that neighbours alone have cannot follow what finite elements couple farther. The divergence weighs all
  // motions alike, the shortest too, and takes what it gains there from the modes: with 0.1 the second bending of a
  // cylinder of seven cells was 4 % too fast and the gallbladder's fourth and fifth mode 6 %.
  constexpr double klWeight = 0.001, responseWeight = 100;
  int calls = 0;
  const auto value = [&](const LinkFit& fit, double kl, double response) {
    return [&, kl, response](const VectorXd& at, VectorXd& gradient) {
      progress(std::min(1., calls++ / (2.2 * (warmUp + iterations))));
      return fit.value(at, gradient, kl, response);
    };
  };
  const auto minimise = [&](const LinkFit& fit, VectorXd& at) {
    descend(value(fit, 1, 0), {warmUp}, at);
    return descend(value(fit, klWeight, responseWeight), {iterations}, at);
  };
  const LinkFit plain(compliance, grounding, ends, lengthScale, std::min(form, LinkForm::uncoupled), links);
  VectorXd x = plain.start();
  const double reached = minimise(plain, x);
  // Where cells lie in a row there is next to nothing to couple, and what strains gain of single loads they lose of
  // others: a gallbladder of seven, with ten links, bends half a percent farther off with them.
  if (form == LinkForm::full && !isRowOfCells(links, static_cast<std::size_t>(compliance.rows()) / 6)) {
    const LinkFit strained(compliance, grounding, ends, lengthScale, form, links);
    VectorXd both = strained.start();
    if (minimise(strained, both) < reached) {
      strained.setLinks(both);
      return;
    }
  }
  plain.setLinks(x);
}

}  // namespace medulla
