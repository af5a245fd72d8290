#include "physics/model/node_volumes.h"

#include <algorithm>

#include "physics/model/attachment.h"
#include "physics/model/mesh_topology.h"
#include "physics/model/symmetric_eigen.h"

namespace medulla {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

struct CellNodes {  // of one cell
  std::vector<int> nodes;
  double stiffness = 0;           // m, sum over the nodes
  double volumePerStiffness = 0;  // m2, what the cell can give at most
};

// Of the nodes' attachments, over Young's modulus.
std::vector<double> stiffnesses(const std::vector<Attachment>& attachments, const std::vector<Vector3d>& normals,
                                const std::vector<FillingSphere>& spheres) {
  std::vector<double> out;
  out.reserve(attachments.size());
  for (std::size_t n = 0; n < attachments.size(); ++n) {
    const double depth = attachmentDepth(attachments[n], normals[n], spheres);
    out.push_back(depth > 0 ? attachments[n].area / depth : 0);
  }
  return out;
}

// Of nodes with the volumes c * stiffness: their sums about the cell's centroid.
struct Moments {
  double volume = 0;
  Vector3d first = Vector3d::Zero();
  Matrix3d second = Matrix3d::Zero();
};

Moments momentsOf(const CellNodes& cell, const Vector3d& centroid, const std::vector<Vector3d>& nodes,
                  const std::vector<double>& stiffness) {
  Moments m;
  for (const int n : cell.nodes) {
    const double k = stiffness[n];
    const Vector3d r = nodes[n] - centroid;
    m.volume += k;
    m.first += k * r;
    m.second += k * r * r.transpose();
  }
  return m;
}

// Largest part of its second moment in any direction that a cell loses, about the remainder's own centroid.
double momentLoss(const MassProperties& cell, const Moments& taken, double c) {
  const double left = cell.volume - c * taken.volume;
  const Matrix3d remainder =
      cell.secondMoment - c * taken.second - c * c * taken.first * taken.first.transpose() / left;
  return 1 - eigenvaluesOf(remainder, cell.secondMoment)[0];
}

double mostVolumePerStiffness(const MassProperties& cell, const Moments& taken, double mostMomentLoss) {
  constexpr double kVolumeLoss = 0.5, kStep = 0.95;
  if (!(taken.volume > 0)) return 0;
  double c = kVolumeLoss * cell.volume / taken.volume;
  while (momentLoss(cell, taken, c) > mostMomentLoss) c *= kStep;
  return c;
}

std::vector<CellNodes> nodesOfCells(const std::vector<Vector3d>& nodes, const std::vector<MassProperties>& cells,
                                    const std::vector<double>& stiffness, double mostMomentLoss,
                                    const std::vector<Attachment>& attachments) {
  std::vector<CellNodes> out(cells.size());
  for (std::size_t n = 0; n < nodes.size(); ++n) out[attachments[n].massSphere].nodes.push_back(static_cast<int>(n));
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Moments m = momentsOf(out[i], cells[i].centroid, nodes, stiffness);
    out[i].stiffness = m.volume;
    out[i].volumePerStiffness = mostVolumePerStiffness(cells[i], m, mostMomentLoss);
  }
  return out;
}

// The volume per stiffness, the same for all cells that can afford it, that makes the nodes carry `wanted` (m3).
double commonVolumePerStiffness(const std::vector<CellNodes>& cells, double wanted) {
  const auto carried = [&](double c) {
    double sum = 0;
    for (const CellNodes& cell : cells) sum += std::min(c, cell.volumePerStiffness) * cell.stiffness;
    return sum;
  };
  if (wanted <= 0) return 0;
  double low = 0, high = 0;
  for (const CellNodes& cell : cells) high = std::max(high, cell.volumePerStiffness);
  if (carried(high) <= wanted) return high;
  constexpr int kBisections = 60;
  for (int k = 0; k < kBisections; ++k) {
    const double middle = 0.5 * (low + high);
    (carried(middle) < wanted ? low : high) = middle;
  }
  return high;
}

// Sets the nodes' volumes, and restFrame, volume and secondMoment of every sphere.
void shareOut(const std::vector<Vector3d>& nodes, const std::vector<MassProperties>& cells,
              const std::vector<double>& stiffness, double fraction, double mostMomentLoss,
              std::vector<Attachment>& attachments, std::vector<FillingSphere>& spheres) {
  const std::vector<CellNodes> groups = nodesOfCells(nodes, cells, stiffness, mostMomentLoss, attachments);
  double volume = 0;
  for (const MassProperties& cell : cells) volume += cell.volume;
  const double common = commonVolumePerStiffness(groups, fraction * volume);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const MassProperties& cell = cells[i];
    const double c = std::min(common, groups[i].volumePerStiffness);
    Vector3d first = Vector3d::Zero();
    double taken = 0;
    for (const int n : groups[i].nodes) {
      attachments[n].volume = c * stiffness[n];
      taken += attachments[n].volume;
      first += attachments[n].volume * (nodes[n] - cell.centroid);
    }
    const Vector3d shift = -first / (cell.volume - taken);
    spheres[i].restFrame = cell.centroid + shift;
    spheres[i].volume = cell.volume;
    spheres[i].secondMoment = cell.secondMoment + cell.volume * shift * shift.transpose();
  }
}

// What shareOut made `spheres` of.
std::vector<MassProperties> cellsOf(const SoftBodyModel& model) {
  std::vector<Vector3d> first(model.spheres.size(), Vector3d::Zero());  // about restFrame, where the remainder has none
  for (std::size_t n = 0; n < model.attachments.size(); ++n) {
    const Attachment& a = model.attachments[n];
    first[a.massSphere] += a.volume * (model.restNodes[n] - model.spheres[a.massSphere].restFrame);
  }
  std::vector<MassProperties> out;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const FillingSphere& s = model.spheres[i];
    const Vector3d way = first[i] / s.volume;
    out.push_back({s.volume, s.restFrame + way, s.secondMoment - s.volume * way * way.transpose()});
  }
  return out;
}

// Of the nodes' springs to their frames along the normal and of their edges, over Young's modulus.
std::vector<double> stiffnessesOfLayer(const SoftBodyModel& model, const IdentifiedLayer& layer) {
  std::vector<double> out;
  out.reserve(model.attachments.size());
  for (const Attachment& a : model.attachments) out.push_back(layer.normal * a.area);
  visitEdges({model.restNodes, model.triangles}, [&](int i, int j, double area, double squaredLength) {
    const double edge = layer.membrane * area / squaredLength;
    out[i] += edge;
    out[j] += edge;
  });
  return out;
}

}  // namespace

void shareOutMass(const TriangleMesh& mesh, const PowerCells& cells, double fraction,
                  std::vector<Attachment>& attachments, std::vector<FillingSphere>& spheres) {
  constexpr double kMostMomentLoss = 0.7;
  for (std::size_t n = 0; n < mesh.vertices.size(); ++n)
    attachments[n].massSphere = cellAt(cells.sites, mesh.vertices[n]);
  shareOut(mesh.vertices, cells.cells, stiffnesses(attachments, vertexNormals(mesh), spheres), fraction,
           kMostMomentLoss, attachments, spheres);
}

void shareOutMassByLayer(const IdentifiedLayer& layer, double fraction, SoftBodyModel& model) {
  constexpr double kMostMomentLoss = 0.85;
  shareOut(model.restNodes, cellsOf(model), stiffnessesOfLayer(model, layer), fraction, kMostMomentLoss,
           model.attachments, model.spheres);
  reprojectAttachments({model.restNodes, model.triangles}, model.spheres, model.links, model.attachments);
}

SoftBodyModel withoutNodeVolumes(const SoftBodyModel& model) {
  SoftBodyModel out = model;
  const std::vector<MassProperties> cells = cellsOf(model);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    out.spheres[i].restFrame = cells[i].centroid;
    out.spheres[i].secondMoment = cells[i].secondMoment;
  }
  for (std::size_t n = 0; n < out.attachments.size(); ++n) {
    Attachment& a = out.attachments[n];
    a.volume = 0;
    if (!a.onLink) a.restOffset = out.restNodes[n] - out.spheres[a.host].restFrame;  // links end where they did
  }
  return out;
}

std::vector<MassProperties> remainingSpheres(const std::vector<Vector3d>& nodes,
                                             const std::vector<FillingSphere>& spheres,
                                             const std::vector<Attachment>& attachments) {
  std::vector<MassProperties> out;
  out.reserve(spheres.size());
  for (const FillingSphere& s : spheres) out.push_back({s.volume, s.restFrame, s.secondMoment});
  for (std::size_t n = 0; n < attachments.size(); ++n) {
    MassProperties& sphere = out[attachments[n].massSphere];
    const Vector3d r = nodes[n] - sphere.centroid;
    sphere.volume -= attachments[n].volume;
    sphere.secondMoment -= attachments[n].volume * r * r.transpose();
  }
  return out;
}

MassProperties totalOf(const std::vector<MassProperties>& spheres, const std::vector<Vector3d>& nodes,
                       const std::vector<Attachment>& attachments) {
  std::vector<MassProperties> parts = spheres;
  for (std::size_t n = 0; n < nodes.size(); ++n) parts.push_back({attachments[n].volume, nodes[n], Matrix3d::Zero()});
  return combined(parts);
}

}  // namespace medulla
