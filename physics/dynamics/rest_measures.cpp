#include "physics/dynamics/rest_measures.h"

#include <Eigen/Geometry>
#include <cmath>
#include <utility>
#include <vector>

#include "physics/dynamics/identified_mechanics.h"
#include "physics/model/cross_matrix.h"
#include "physics/model/symmetric_eigen.h"

namespace medulla {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

class Entries {
 public:
  void add(Eigen::Index row, Eigen::Index column, double value) {
    if (value != 0) entries_.emplace_back(static_cast<int>(row), static_cast<int>(column), value);
  }
  template <class Block>
  void addBlock(Eigen::Index row, Eigen::Index column, const Block& block) {
    for (Eigen::Index i = 0; i < block.rows(); ++i)
      for (Eigen::Index j = 0; j < block.cols(); ++j) add(row + i, column + j, block(i, j));
  }
  RestRates matrix(std::size_t rows, std::size_t columns) const {
    RestRates out(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns));
    out.setFromTriplets(entries_.begin(), entries_.end());  // sums what stands in one place
    return out;
  }

 private:
  std::vector<Eigen::Triplet<double>> entries_;
};

// Frames from `spheres` on are held.
void addIdentified(const SoftBodyModel& m, const BodyMechanics& b, std::size_t& rows, Entries& out) {
  const int spheres = static_cast<int>(m.spheres.size());
  const std::size_t links = rows, strains = links + 6 * b.identifiedLinks.size();
  rows = strains + (b.identifiedStrains.empty() ? 0 : m.spheres.size());
  for (std::size_t k = 0; k < b.identifiedLinks.size(); ++k) {
    const IdentifiedLink& l = m.identified->links[k];
    const RestMeasures measures = restMeasures(m, l);
    Matrix6d of0, of1;
    of0 << -measures.line, measures.turn0;
    of1 << measures.line, measures.turn1;
    const bool held = l.frame1 >= spheres;
    const SymmetricEigen eigen = symmetricEigen(b.identifiedLinks[k]);
    const Matrix6d root = eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal() * eigen.vectors.transpose();
    out.addBlock(links + 6 * k, 6 * l.frame0, root * of0);
    if (!held) out.addBlock(links + 6 * k, 6 * l.frame1, root * of1);
    if (b.identifiedStrains.empty()) continue;
    const auto addStrain = [&](int cell, const Vector6d& strain) {
      out.addBlock(strains + cell, 6 * l.frame0, strain.transpose() * of0);
      if (!held) out.addBlock(strains + cell, 6 * l.frame1, strain.transpose() * of1);
    };
    addStrain(l.frame0, b.identifiedStrains[k].at0);
    if (!held) addStrain(l.frame1, b.identifiedStrains[k].at1);
  }
}

// line . (v1 - v0) + turn0 . w0 + turn1 . w1 of velocities at the link's ends, which arms carry.
void addFormulas(const SoftBodyModel& m, const BodyMechanics& b, std::size_t& rows, Entries& out) {
  const Vector3d none = Vector3d::Zero();
  for (std::size_t k = 0; k < b.spans.size(); ++k) {
    const ElasticLink& l = m.links[k];
    const Vector3d d = b.spans[k].end1 - b.spans[k].end0;
    const Vector3d arm0 = b.spans[k].end0 - m.spheres[l.sphere0].restFrame,
                   arm1 = b.spans[k].end1 - m.spheres[l.sphere1].restFrame;
    const double length = d.norm();
    const LinkStiffness& s = b.links[k];
    const Vector3d t = d / length, u = s.restU, v = t.cross(u);
    const auto add = [&](const Vector3d& line, const Vector3d& turn0, const Vector3d& turn1, double stiffness) {
      const double root = std::sqrt(stiffness);
      out.addBlock(rows, 6 * l.sphere0, -root * line.transpose());
      out.addBlock(rows, 6 * l.sphere0 + 3, root * (turn0 - arm0.cross(line)).transpose());
      out.addBlock(rows, 6 * l.sphere1, root * line.transpose());
      out.addBlock(rows, 6 * l.sphere1 + 3, root * (turn1 + arm1.cross(line)).transpose());
      ++rows;
    };
    add(t, none, none, s.elongation);
    // k0 a0^2 + 2 c a0 a1 + k1 a1^2 as squares: k0 (a0 + c/k0 a1)^2 + (k1 - c^2/k0) a1^2
    const auto addFlexion = [&](const Vector3d& across, const Vector3d& turn, const FlexionStiffness& f) {
      const double ratio = f.couple / f.end0;
      add((1 + ratio) / length * across, turn, ratio * turn, f.end0);
      add(across / length, none, turn, f.end1 - ratio * f.couple);
    };
    addFlexion(u, -v, s.flexionV);
    addFlexion(v, u, s.flexionU);
    add(none, -t, t, s.torsion);
  }
}

// Of an anchor on a link: n its direction, offset the node's way from it. It moves with the line between the link's
// ends, v0 + along (v1 - v0), turns the offset and thins it as the link stretches. `leaning` says how the offset turns
// with what is across n: on beams with the ends' own turns, on springs with the line.
std::vector<HostRate> linkAnchorRates(const BodyDescription& body, const BodyMechanics& b, int node) {
  const SoftBodyModel& m = *body.model;
  const bool beam = body.links == LinkModel::beam;
  const Attachment& a = b.attachments[node];
  const ElasticLink& l = m.links[a.host];
  const LinkSpan& span = b.spans[a.host];
  const double length = (span.end1 - span.end0).norm();
  const Vector3d n = (span.end1 - span.end0) / length;
  const Matrix3d turn = -crossMatrix(a.restOffset), about = n * n.transpose(), one = Matrix3d::Identity();
  const double bump = beam ? 0.5 * a.along * (1 - a.along) * length : 0;  // m, of the middle line (anchor.h)
  const Matrix3d leaning = beam ? Matrix3d(one - about) : Matrix3d(Matrix3d::Zero());
  const double share = b.twistShare[node];
  Matrix3d way = a.along * one;
  if (beam) way -= body.tissue.poisson / length * a.restOffset * n.transpose();
  if (!beam) way += turn * crossMatrix(n) / length;
  // The ends' turns against each other curve the link and its sections (anchor.h).
  const Matrix3d curving =
      beam ? Matrix3d(body.tissue.poisson / (2 * length) *
                      (2 * a.restOffset * a.restOffset.transpose() - a.restOffset.squaredNorm() * one) * crossMatrix(n))
           : Matrix3d(Matrix3d::Zero());
  const Matrix3d turn0 = turn * ((1 - a.along) * leaning + (1 - share) * about) - bump * crossMatrix(n) + curving,
                 turn1 = turn * (a.along * leaning + share * about) + bump * crossMatrix(n) - curving;
  const Vector3d arm0 = span.end0 - m.spheres[l.sphere0].restFrame, arm1 = span.end1 - m.spheres[l.sphere1].restFrame;
  return {{l.sphere0, one - way, turn0 - (one - way) * crossMatrix(arm0)},
          {l.sphere1, way, turn1 - way * crossMatrix(arm1)}};
}

}  // namespace

RestRates linkRates(const SoftBodyModel& model, const BodyMechanics& mechanics) {
  Entries out;
  std::size_t rows = 0;
  addIdentified(model, mechanics, rows, out);
  addFormulas(model, mechanics, rows, out);
  return out.matrix(rows, 6 * model.spheres.size());
}

std::vector<HostRate> anchorRates(const BodyDescription& body, const BodyMechanics& mechanics, int node) {
  const SoftBodyModel& m = *body.model;
  const Attachment& a = mechanics.attachments[node];
  if (mechanics.skin.empty()) {
    if (a.onLink) return linkAnchorRates(body, mechanics, node);
    return {{a.host, Matrix3d::Identity(), -crossMatrix(a.restOffset)}};
  }
  std::vector<HostRate> out;
  const std::vector<SkinRow> rows = skinRows(m, mechanics.skin[node], node);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const int frame = mechanics.skin[node][k].frame;
    if (frame >= static_cast<int>(m.spheres.size())) continue;
    out.push_back({frame, rows[k].onWay, rows[k].onTurn - rows[k].onWay * crossMatrix(armOf(m, frame))});
  }
  return out;
}

RestRates anchorRates(const BodyDescription& body, const BodyMechanics& mechanics) {
  Entries out;
  const std::size_t nodes = mechanics.attachments.size();
  for (std::size_t n = 0; n < nodes; ++n) {
    for (const HostRate& rate : anchorRates(body, mechanics, static_cast<int>(n))) {
      out.addBlock(3 * n, 6 * rate.sphere, rate.linear);
      out.addBlock(3 * n, 6 * rate.sphere + 3, rate.angular);
    }
  }
  return out.matrix(3 * nodes, 6 * body.model->spheres.size());
}

RestRates sphereMasses(const BodyMechanics& mechanics) {
  Entries out;
  const std::size_t spheres = mechanics.sphereMass.size();
  for (std::size_t i = 0; i < spheres; ++i) {
    out.addBlock(6 * i, 6 * i, mechanics.sphereMass[i] * Matrix3d::Identity());
    out.addBlock(6 * i + 3, 6 * i + 3, mechanics.sphereInertia[i]);
  }
  return out.matrix(6 * spheres, 6 * spheres);
}

RestRates nodeMasses(const BodyMechanics& mechanics) {
  Entries out;
  const std::size_t nodes = mechanics.nodeMass.size();
  for (std::size_t n = 0; n < nodes; ++n)
    if (mechanics.nodeMoves[n]) out.addBlock(3 * n, 3 * n, mechanics.nodeMass[n] * Matrix3d::Identity());
  return out.matrix(3 * nodes, 3 * nodes);
}

RestRates heldNodeRates(const BodyDescription& body, const BodyMechanics& mechanics) {
  Entries out;
  std::size_t rows = 0;
  std::vector<std::vector<HostRate>> anchors(mechanics.attachments.size());  // of held nodes
  for (const int n : body.fixedNodes) anchors[n] = anchorRates(body, mechanics, n);
  const auto isHeld = [&](int n) { return !anchors[n].empty(); };
  const auto addAnchor = [&](int n, double factor) {
    for (const HostRate& rate : anchors[n]) {
      out.addBlock(rows, 6 * rate.sphere, factor * rate.linear);
      out.addBlock(rows, 6 * rate.sphere + 3, factor * rate.angular);
    }
  };
  const auto add = [&](double stiffness, int n, int other = -1) {
    addAnchor(n, std::sqrt(stiffness));
    if (other >= 0) addAnchor(other, -std::sqrt(stiffness));
    rows += 3;
  };
  for (std::size_t n = 0; n < anchors.size(); ++n)
    if (isHeld(static_cast<int>(n))) add(mechanics.attachmentStiffness[n], static_cast<int>(n));
  struct Beside {
    std::vector<std::pair<int, double>> held;  // and the edge's stiffness
    double rest = 0;                           // N/m, of its own and of edges to others
  };
  std::vector<Beside> beside(anchors.size());
  for (std::size_t n = 0; n < anchors.size(); ++n) beside[n].rest = mechanics.attachmentStiffness[n];
  for (std::size_t e = 0; e < body.model->edges.size(); ++e) {
    const auto& [a, b] = body.model->edges[e];
    const double k = mechanics.edgeStiffness[e];
    if (isHeld(a) && isHeld(b)) {
      add(k, a, b);
      continue;
    }
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, a)})
      if (isHeld(to))
        beside[from].held.emplace_back(to, k);
      else
        beside[from].rest += k;
  }
  for (const Beside& node : beside) {
    double all = node.rest;
    for (const auto& [n, k] : node.held) all += k;
    if (!(all > 0)) continue;
    for (std::size_t i = 0; i < node.held.size(); ++i) {
      const auto& [n, k] = node.held[i];
      add(node.rest * k / all, n);
      for (std::size_t j = 0; j < i; ++j) add(node.held[j].second * k / all, n, node.held[j].first);
    }
  }
  return out.matrix(rows, 6 * body.model->spheres.size());
}

RestRates layerStiffness(const SoftBodyModel& model, const BodyMechanics& mechanics) {
  Entries out;
  const std::size_t size = 3 * mechanics.attachments.size();
  for (std::size_t i = 0; i < mechanics.attachments.size(); ++i) {
    Matrix3d spring = mechanics.attachmentStiffness[i] * Matrix3d::Identity();
    if (!mechanics.normalExcess.empty())
      spring += mechanics.normalExcess[i] * mechanics.normal[i] * mechanics.normal[i].transpose();
    out.addBlock(3 * i, 3 * i, spring);
  }
  for (std::size_t e = 0; e < model.edges.size(); ++e) {
    const auto& [a, b] = model.edges[e];
    const double k = mechanics.edgeStiffness[e];
    for (int c = 0; c < 3; ++c) {
      out.add(3 * a + c, 3 * a + c, k);
      out.add(3 * b + c, 3 * b + c, k);
      out.add(3 * a + c, 3 * b + c, -k);
      out.add(3 * b + c, 3 * a + c, -k);
    }
  }
  return out.matrix(size, size);
}

RestRates pressureRates(const SoftBodyModel& model, const BodyMechanics& mechanics) {
  Entries out;
  for (std::size_t i = 0; i < mechanics.attachments.size(); ++i) {
    const Attachment& a = mechanics.attachments[i];
    const double bulk = (a.onLink ? mechanics.linkBulk : mechanics.sphereBulk)[a.host];
    const std::size_t host = (a.onLink ? 0 : model.links.size()) + a.host;
    out.addBlock(3 * i, host, std::sqrt(bulk) * a.area * mechanics.normal[i]);
  }
  return out.matrix(3 * mechanics.attachments.size(), model.links.size() + model.spheres.size());
}

}  // namespace medulla
