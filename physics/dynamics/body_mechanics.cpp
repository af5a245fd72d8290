#include "physics/dynamics/body_mechanics.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "physics/dynamics/identified_mechanics.h"
#include "physics/model/attachment.h"
#include "physics/model/mass_properties.h"
#include "physics/model/mesh_topology.h"

namespace medulla {

void require(bool condition, const std::string& message) {
  if (!condition) throw std::runtime_error(message);
}

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// What is pressed is a foundation of two parameters (Vlasov 1966): tissue whose displacement falls off evenly from the
// surface to the skeleton resists being pressed and being sheared, the latter like a membrane of tension G depth / 3,
// which hands a dent on to its surroundings. Springs side by side alone let a tool sink the deeper, the finer the mesh.
// The three factors are those that bring pokes on beds nearest to finite elements without making slender bodies worse
// (tests/accuracy); the valley is flat.

// Attachment: k = c E area / depth, with depth the distance to the skeleton. The column is never taken shorter than it
// is wide: a load on a small disc reaches about as deep as the disc is wide, whatever lies below.
constexpr double kFoundationFactor = 0.7;

// Edge springs: Van Gelder (1998), k = E t sum(triangle areas) / length^2. On equilateral triangles they are a membrane
// of tension 3/2 E t: of G depth / 3 at t = depth / 9 (1 + nu), which is depth / 13 in soft tissue.
constexpr double kLayerThicknessOverDepth = 1.0 / 17;

// Volume pressure: the bulk modulus E / 3 (1 - 2 nu), of Young's modulus not more than this. More keeps the volume
// little better, and would alone bound the step.
constexpr double kLargestBulk = 1.2;

// Of the bulk modulus: beyond a tenth of the volume the pressure stays. Where a body lies inside out it would be any
// number.
constexpr double kLargestSwelling = 0.1;

// The nodes' masses are taken off the spheres they hang on, but never so that less than this share of a sphere's own
// mass and inertia is left: coarse cells may carry more surface than they hold.
constexpr double kSmallestRemainder = 0.1;

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
  for (const SteeredLinks& s : body.steered) {
    check(s.factors.elongation, s.factors.elongation > 0, "elongation factor", "more than 0");
    check(s.factors.flexion, s.factors.flexion > 0, "flexion factor", "more than 0");
    check(s.factors.torsion, s.factors.torsion > 0, "torsion factor", "more than 0");
  }
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
  if (isIdentified(body)) checkIdentified(body);
}

// Feet on links moved to the links' spans, and slid until the offset is perpendicular, as the frame is that carries it.
// What hangs on a link's held part hangs on its sphere, and so do fixed nodes ahead of the rim's mean: the span has
// them in it, and they would hold the link a second time.
std::vector<Attachment> attachmentsToSpans(const SoftBodyModel& m, const std::vector<LinkSpan>& spans,
                                           const std::vector<bool>& nodeMoves) {
  std::vector<Attachment> out = m.attachments;
  for (std::size_t i = 0; i < out.size(); ++i) {
    Attachment& a = out[i];
    if (!a.onLink) continue;
    const LinkSpan& span = spans[a.host];
    const Vector3d line = span.end1 - span.end0;
    const double along = (a.along - span.from) / (span.to - span.from);
    const bool isHeld = !nodeMoves[i] && (span.clamped0 || span.clamped1);
    if (along < 0 || along > 1 || isHeld) {
      a.onLink = false;
      a.host = (isHeld ? span.clamped0 : along < 0) ? m.links[a.host].sphere0 : m.links[a.host].sphere1;
      a.along = 0;
      a.restOffset = m.restNodes[i] - m.spheres[a.host].restFrame;
      continue;
    }
    const double shift = a.restOffset.dot(line) / line.squaredNorm();
    a.along = along + shift;
    a.restOffset -= shift * line;
  }
  return out;
}

// Each host keeps the volume that lies around it: a section that is squeezed bulges beside. One pressure for the body
// let it grow wherever there is surface. The hosts share the volume by area times depth, the attachments' with its
// floor: a pressure so is never more than a few times as stiff as the attachments that it presses.
void setBulk(const BodyDescription& body, const std::vector<double>& depth, BodyMechanics& out) {
  const double poisson = body.tissue.poisson;
  const double bulk = body.tissue.young * (isIdentified(body) ? identifiedBulk(poisson)
                                                              : std::min(1 / (3 * (1 - 2 * poisson)), kLargestBulk));
  out.largestPressure = kLargestSwelling * bulk;
  const HostVolumes volumes = hostVolumes(*body.model, out.attachments, depth);
  const auto perVolume = [&](double volume) { return volume > 0 ? bulk / volume : 0; };
  for (const double volume : volumes.links) out.linkBulk.push_back(perVolume(volume));
  for (const double volume : volumes.spheres) out.sphereBulk.push_back(perVolume(volume));
}

void setSurfaceStiffness(const BodyDescription& body, BodyMechanics& out) {
  const SoftBodyModel& m = *body.model;
  std::vector<double> depth;
  const TriangleMesh mesh{m.restNodes, m.triangles};
  out.normal = vertexNormals(mesh);
  for (std::size_t i = 0; i < m.attachments.size(); ++i) {
    const Attachment& a = m.attachments[i];
    depth.push_back(attachmentDepth(a, out.normal[i], m.spheres));
    out.attachmentStiffness.push_back(depth[i] > 0 ? kFoundationFactor * body.tissue.young * a.area / depth[i] : 0);
    if (!isIdentified(body)) continue;
    const IdentifiedLayer& layer = m.identified->layer;
    out.attachmentStiffness[i] = body.tissue.young * a.area * layer.tangential;
    out.normalExcess.push_back(body.tissue.young * a.area * (layer.normal - layer.tangential));
  }
  setBulk(body, depth, out);
  const auto thickness = [&](int i, int j) {
    return isIdentified(body) ? m.identified->layer.membrane : kLayerThicknessOverDepth * 0.5 * (depth[i] + depth[j]);
  };
  out.edgeStiffness.assign(m.edges.size(), 0);
  visitEdges(mesh, [&](int i, int j, double area, double squaredLength) {
    const std::array<int, 2> edge{std::min(i, j), std::max(i, j)};
    const auto found = std::lower_bound(m.edges.begin(), m.edges.end(), edge);
    require(found != m.edges.end() && *found == edge,
            fmt::format("its model lacks the edge {}-{} of a triangle, or its edges are not sorted", edge[0], edge[1]));
    if (squaredLength > 0)
      out.edgeStiffness[found - m.edges.begin()] += body.tissue.young * thickness(i, j) * area / squaredLength;
  });
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
    const SphereCell cell = sphereCell(body, static_cast<int>(i));
    require(cell.volume > 0,
            fmt::format("its model's sphere {} has volume {}: expected more than 0 m3", i, cell.volume));
    mass.push_back(density * cell.volume);
    moment.push_back(density * cell.secondMoment);
  }
  const std::vector<double> wholeMass = mass;
  const std::vector<Matrix3d> wholeMoment = moment;
  const bool full = body.surface != SurfaceMode::skin;
  const auto isMassless = [](const Attachment& a) { return a.volume == 0; };
  const bool anyMass = !std::all_of(out.attachments.begin(), out.attachments.end(), isMassless);
  require(!full || out.attachments.empty() || anyMass,
          "its model's surface has no mass (--surface-mass 0): expected surface=\"skin\", or a model with some");
  for (std::size_t i = 0; i < out.attachments.size(); ++i) {
    const double volume = out.attachments[i].volume;
    require(!full || volume > 0, fmt::format("its model's node {} has volume {}: expected more than 0 m3", i, volume));
    out.nodeMass.push_back(full ? density * volume : 0);
  }
  takeNodeMasses(m, out, mass, moment);
  for (std::size_t i = 0; i < mass.size(); ++i) {
    out.sphereMass.push_back(std::max(mass[i], kSmallestRemainder * wholeMass[i]));
    const Matrix3d whole = inertia(wholeMoment[i]);
    const double smallest = Eigen::SelfAdjointEigenSolver<Matrix3d>(whole, Eigen::EigenvaluesOnly).eigenvalues()[0];
    require(smallest > 0, fmt::format("its model's sphere {} has no inertia: expected a positive second moment", i));
    out.sphereInertia.push_back(raised(inertia(moment[i]), kSmallestRemainder * smallest));
  }
}

}  // namespace

BodyMechanics bodyMechanics(const BodyDescription& body) {
  checkDescription(body);
  BodyMechanics out;
  out.moves.assign(body.model->spheres.size(), true);
  out.turns = out.moves;
  const auto hold = [&](const auto& held) {
    out.moves[held.sphere] = false;
    if (held.freedom == FixedFreedom::all) out.turns[held.sphere] = false;
  };
  std::for_each(body.fixed.begin(), body.fixed.end(), hold);
  std::for_each(body.driven.begin(), body.driven.end(), hold);
  out.nodeMoves.assign(body.model->restNodes.size(), true);
  for (const int node : body.fixedNodes) out.nodeMoves[node] = false;
  if (isIdentified(body)) {
    out.identifiedLinks = identifiedStiffness(body);
    out.identifiedStrains = identifiedStrains(body);
    out.skin = heldSkin(*body.model);
    out.attachments = attachmentsToFrames(*body.model, out.skin);
  } else {
    out.spans = linkSpans(body, out.moves, out.turns);
    out.links = linkStiffness(body, out.spans);
    out.attachments = attachmentsToSpans(*body.model, out.spans, out.nodeMoves);
  }
  for (const Attachment& a : out.attachments)
    out.twistShare.push_back(a.onLink ? twistShare(body.model->links[a.host], out.spans[a.host], a.along) : 0);
  setSurfaceStiffness(body, out);
  setMasses(body, out);
  return out;
}

double meanRadius(const SoftBodyModel& model) {
  double sum = 0;
  for (const FillingSphere& s : model.spheres) sum += s.radius;
  return sum / static_cast<double>(model.spheres.size());
}

}  // namespace medulla
