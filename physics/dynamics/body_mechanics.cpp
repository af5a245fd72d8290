#include "physics/dynamics/body_mechanics.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "physics/model/attachment.h"

namespace medulla {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Attachment: an elastic foundation, k = c E area / depth, with depth the distance to the skeleton and c = 1. Fits
// against finite elements on organs about 12 mm deep gave E / 12 mm per area. The column is never taken shorter than it
// is wide: a load on a small disc reaches about as deep as the disc is wide, whatever lies below.
constexpr double kFoundationFactor = 1;

// Edge springs: Van Gelder (1998), k = E t sum(triangle areas) / length^2, with the layer's effective thickness t a
// fixed share of the mean attachment depth. The same fits gave 0.17 mm E at a depth of 12 mm; Van Gelder's sum is 0.87
// on equilateral triangles, so t = 0.2 mm: depth / 60.
constexpr double kLayerThicknessOverDepth = 1.0 / 60;

// The nodes' masses are taken off the spheres they hang on, but never so that less than this share of a sphere's own
// mass and inertia is left: coarse cells may carry more surface than they hold.
constexpr double kSmallestRemainder = 0.1;

void require(bool condition, const std::string& message) {
  if (!condition) throw std::runtime_error(message);
}

void checkDescription(const BodyDescription& body) {
  require(body.model != nullptr, "it has no model");
  const SoftBodyModel& m = *body.model;
  require(!m.spheres.empty(), "its model has no spheres: expected one or more");
  require(m.attachments.size() == m.restNodes.size(),
          fmt::format("its model has {} attachments for {} nodes", m.attachments.size(), m.restNodes.size()));
  const Tissue& t = body.tissue;
  const auto check = [](double value, bool inRange, const char* name, const char* range) {
    require(std::isfinite(value) && inRange, fmt::format("its {} is {}: expected {}", name, value, range));
  };
  check(t.young, t.young > 0, "Young's modulus", "more than 0 Pa");
  check(t.poisson, t.poisson >= 0 && t.poisson < 0.5, "Poisson's ratio", "0 or more and less than 0.5");
  check(t.density, t.density > 0, "density", "more than 0 kg/m3");
  check(t.damping, t.damping >= 0, "damping ratio", "0 or more");
  check(body.factors.elongation, body.factors.elongation > 0, "elongation factor", "more than 0");
  check(body.factors.flexion, body.factors.flexion > 0, "flexion factor", "more than 0");
  check(body.factors.torsion, body.factors.torsion > 0, "torsion factor", "more than 0");
  const int spheres = static_cast<int>(m.spheres.size()), links = static_cast<int>(m.links.size());
  for (const FixedSphere& f : body.fixed)
    require(f.sphere >= 0 && f.sphere < spheres,
            fmt::format("it fixes sphere {}: expected 0 to {}", f.sphere, spheres - 1));
  const int nodes = static_cast<int>(m.restNodes.size());
  for (const int node : body.fixedNodes)
    require(node >= 0 && node < nodes, fmt::format("it fixes node {}: expected 0 to {}", node, nodes - 1));
  for (const DrivenSphere& driven : body.driven) {
    require(driven.sphere >= 0 && driven.sphere < spheres,
            fmt::format("it drives sphere {}: expected 0 to {}", driven.sphere, spheres - 1));
    require(std::none_of(body.fixed.begin(), body.fixed.end(),
                         [&](const FixedSphere& f) { return f.sphere == driven.sphere; }),
            fmt::format("it both fixes and drives sphere {}", driven.sphere));
    check(driven.amplitude, driven.amplitude >= 0, "drive's amplitude", "0 m or more");
    check(driven.frequency, driven.frequency > 0, "drive's frequency", "more than 0 Hz");
    check(driven.phase, true, "drive's phase", "a finite angle");
    require(driven.axis.allFinite() && driven.axis.norm() > 0, "its drive's axis has no direction");
    require(driven.velocity.allFinite(), "its drive's velocity is not finite");
  }
  for (const ElasticLink& l : m.links)
    require(
        std::min(l.sphere0, l.sphere1) >= 0 && std::max(l.sphere0, l.sphere1) < spheres && l.sphere0 != l.sphere1,
        fmt::format("its model links spheres {} and {}: expected two of 0 to {}", l.sphere0, l.sphere1, spheres - 1));
  for (const Attachment& a : m.attachments) {
    require(
        a.host >= 0 && a.host < (a.onLink ? links : spheres),
        fmt::format("its model attaches a node to {} {}, which does not exist", a.onLink ? "link" : "sphere", a.host));
    require(a.massSphere >= 0 && a.massSphere < spheres,
            fmt::format("its model takes a node's mass from sphere {}, which does not exist", a.massSphere));
  }
}

Vector3d centreLine(const SoftBodyModel& m, const ElasticLink& l) {
  return m.spheres[l.sphere1].restLinkEnd - m.spheres[l.sphere0].restLinkEnd;
}

std::vector<LinkStiffness> linkStiffness(const BodyDescription& body) {
  const double e = body.tissue.young, shear = e / (2 * (1 + body.tissue.poisson));
  std::vector<LinkStiffness> out;
  for (const ElasticLink& l : body.model->links) {
    const double length = centreLine(*body.model, l).norm();
    require(length > 0,
            fmt::format("its model's spheres {} and {} are linked and lie in one point", l.sphere0, l.sphere1));
    LinkStiffness k;
    k.elongation = body.factors.elongation * e * l.area / length;
    // Springs: 2EI/L per end, which act in series and together bend like a beam of the link's length. Beam: EI/L
    // [[4, 2], [2, 4]] (Euler and Bernoulli), the same in pure bending, and right where the moment varies as well.
    const bool beam = body.links == LinkModel::beam;
    const double u = body.factors.flexion * e * l.bendingMomentU / length,
                 v = body.factors.flexion * e * l.bendingMomentV / length;
    k.flexionU = (beam ? 4 : 2) * u;
    k.flexionV = (beam ? 4 : 2) * v;
    k.coupleU = (beam ? 2 : 0) * u;
    k.coupleV = (beam ? 2 : 0) * v;
    k.torsion = body.factors.torsion * shear * l.torsionConstant / length;
    out.push_back(k);
  }
  return out;
}

// Slides the foot of an attachment along its link until the offset is perpendicular: the frame that carries it is.
std::vector<Attachment> perpendicularAttachments(const SoftBodyModel& m) {
  std::vector<Attachment> out = m.attachments;
  for (Attachment& a : out) {
    if (!a.onLink) continue;
    const Vector3d line = centreLine(m, m.links[a.host]);
    const double shift = a.restOffset.dot(line) / line.squaredNorm();
    a.along += shift;
    a.restOffset -= shift * line;
  }
  return out;
}

void setSurfaceStiffness(const BodyDescription& body, BodyMechanics& out) {
  const SoftBodyModel& m = *body.model;
  double depthSum = 0;
  for (const Attachment& a : out.attachments) {
    const double depth = attachmentDepth(a);
    out.attachmentStiffness.push_back(depth > 0 ? kFoundationFactor * body.tissue.young * a.area / depth : 0);
    depthSum += depth;
  }
  const double thickness =
      kLayerThicknessOverDepth * depthSum / static_cast<double>(std::max<std::size_t>(1, m.restNodes.size()));
  out.edgeStiffness.assign(m.edges.size(), 0);
  for (const auto& t : m.triangles) {
    const Vector3d a = m.restNodes[t[0]], b = m.restNodes[t[1]], c = m.restNodes[t[2]];
    const double area = 0.5 * (b - a).cross(c - a).norm();
    for (int k = 0; k < 3; ++k) {
      const std::array<int, 2> edge{std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])};
      const auto found = std::lower_bound(m.edges.begin(), m.edges.end(), edge);
      require(
          found != m.edges.end() && *found == edge,
          fmt::format("its model lacks the edge {}-{} of a triangle, or its edges are not sorted", edge[0], edge[1]));
      const double squaredLength = (m.restNodes[edge[1]] - m.restNodes[edge[0]]).squaredNorm();
      if (squaredLength > 0)
        out.edgeStiffness[found - m.edges.begin()] += body.tissue.young * thickness * area / squaredLength;
    }
  }
}

Matrix3d inertiaOf(const Matrix3d& secondMoment) {
  return secondMoment.trace() * Matrix3d::Identity() - secondMoment;
}

// Nearest matrix with no eigenvalue below `floor`.
Matrix3d raised(const Matrix3d& a, double floor) {
  Eigen::SelfAdjointEigenSolver<Matrix3d> eigen;
  eigen.computeDirect(0.5 * (a + a.transpose()));
  if (eigen.eigenvalues().minCoeff() >= floor) return 0.5 * (a + a.transpose());
  eigen.compute(0.5 * (a + a.transpose()));
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(floor).asDiagonal() * eigen.eigenvectors().transpose();
}

// What the nodes' masses take from their cells' spheres: exactly the matter that sits at the nodes, so that spheres and
// nodes together have the body's mass, centre and inertia (physics/model/node_volumes.h).
void takeNodeMasses(const SoftBodyModel& m, const BodyMechanics& b, std::vector<double>& mass,
                    std::vector<Matrix3d>& moment) {
  for (std::size_t i = 0; i < b.attachments.size(); ++i) {
    const int sphere = b.attachments[i].massSphere;
    const Vector3d r = m.restNodes[i] - m.spheres[sphere].restFrame;
    mass[sphere] -= b.nodeMass[i];
    moment[sphere] -= b.nodeMass[i] * r * r.transpose();
  }
}

void setMasses(const BodyDescription& body, BodyMechanics& out) {
  const SoftBodyModel& m = *body.model;
  const double density = body.tissue.density;
  std::vector<double> mass;
  std::vector<Matrix3d> moment;
  for (std::size_t i = 0; i < m.spheres.size(); ++i) {
    require(m.spheres[i].volume > 0,
            fmt::format("its model's sphere {} has volume {}: expected more than 0 m3", i, m.spheres[i].volume));
    mass.push_back(density * m.spheres[i].volume);
    moment.push_back(density * m.spheres[i].secondMoment);
  }
  const std::vector<double> wholeMass = mass;
  const std::vector<Matrix3d> wholeMoment = moment;
  const bool full = body.surface == SurfaceMode::full;
  for (std::size_t i = 0; i < out.attachments.size(); ++i) {
    const double volume = out.attachments[i].volume;
    require(!full || volume > 0, fmt::format("its model's node {} has volume {}: expected more than 0 m3", i, volume));
    out.nodeMass.push_back(full ? density * volume : 0);
  }
  takeNodeMasses(m, out, mass, moment);
  for (std::size_t i = 0; i < mass.size(); ++i) {
    out.sphereMass.push_back(std::max(mass[i], kSmallestRemainder * wholeMass[i]));
    const Matrix3d whole = inertiaOf(wholeMoment[i]);
    const double smallest = Eigen::SelfAdjointEigenSolver<Matrix3d>(whole, Eigen::EigenvaluesOnly).eigenvalues()[0];
    require(smallest > 0, fmt::format("its model's sphere {} has no inertia: expected a positive second moment", i));
    out.sphereInertia.push_back(raised(inertiaOf(moment[i]), kSmallestRemainder * smallest));
  }
}

}  // namespace

BodyMechanics bodyMechanics(const BodyDescription& body) {
  checkDescription(body);
  BodyMechanics out;
  out.moves.assign(body.model->spheres.size(), true);
  out.turns = out.moves;
  for (const FixedSphere& f : body.fixed) {
    out.moves[f.sphere] = false;
    if (f.freedom == FixedFreedom::all) out.turns[f.sphere] = false;
  }
  out.nodeMoves.assign(body.model->restNodes.size(), true);
  for (const int node : body.fixedNodes) out.nodeMoves[node] = false;
  for (const DrivenSphere& driven : body.driven) out.moves[driven.sphere] = false;
  out.links = linkStiffness(body);
  out.attachments = perpendicularAttachments(*body.model);
  setSurfaceStiffness(body, out);
  setMasses(body, out);
  return out;
}

}  // namespace medulla
