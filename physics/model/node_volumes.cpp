#include "physics/model/node_volumes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/model/attachment.h"
#include "physics/model/mesh_topology.h"
#include "physics/model/symmetric_eigen.h"

namespace medulla {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

struct CellNodes {  // of one cell
  std::vector<int> nodes;
  double stiffness = 0;  // m, sum over the nodes of area / depth: their attachments' stiffness over Young's modulus
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

int cellOf(const PowerCells& cells, const Vector3d& x) {
  int best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < cells.cells.size(); ++i) {
    const double power = (x - cells.sites.centres[i]).squaredNorm() - cells.sites.weights[i];
    if (!(cells.cells[i].volume > 0) || power >= least) continue;
    least = power;
    best = static_cast<int>(i);
  }
  return best;
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

double mostVolumePerStiffness(const MassProperties& cell, const Moments& taken) {
  constexpr double kVolumeLoss = 0.5, kMomentLoss = 0.7, kStep = 0.95;
  if (!(taken.volume > 0)) return 0;
  double c = kVolumeLoss * cell.volume / taken.volume;
  while (momentLoss(cell, taken, c) > kMomentLoss) c *= kStep;
  return c;
}

std::vector<CellNodes> nodesOfCells(const std::vector<Vector3d>& nodes, const PowerCells& cells,
                                    const std::vector<double>& stiffness, std::vector<Attachment>& attachments) {
  std::vector<CellNodes> out(cells.cells.size());
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    attachments[n].massSphere = cellOf(cells, nodes[n]);
    out[attachments[n].massSphere].nodes.push_back(static_cast<int>(n));
  }
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Moments m = momentsOf(out[i], cells.cells[i].centroid, nodes, stiffness);
    out[i].stiffness = m.volume;
    out[i].volumePerStiffness = mostVolumePerStiffness(cells.cells[i], m);
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

std::vector<MassProperties> withoutNodes(std::vector<MassProperties> about, const std::vector<Vector3d>& nodes,
                                         const std::vector<Attachment>& attachments) {
  for (std::size_t n = 0; n < attachments.size(); ++n) {
    MassProperties& sphere = about[attachments[n].massSphere];
    const Vector3d r = nodes[n] - sphere.centroid;
    sphere.volume -= attachments[n].volume;
    sphere.secondMoment -= attachments[n].volume * r * r.transpose();
  }
  return about;
}

}  // namespace

void shareOutMass(const TriangleMesh& mesh, const PowerCells& cells, double fraction,
                  std::vector<Attachment>& attachments, std::vector<FillingSphere>& spheres) {
  const std::vector<Vector3d>& nodes = mesh.vertices;
  const std::vector<double> stiffness = stiffnesses(attachments, vertexNormals(mesh), spheres);
  const std::vector<CellNodes> groups = nodesOfCells(nodes, cells, stiffness, attachments);
  double volume = 0;
  for (const MassProperties& cell : cells.cells) volume += cell.volume;
  const double common = commonVolumePerStiffness(groups, fraction * volume);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const MassProperties& cell = cells.cells[i];
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

std::vector<MassProperties> remainingSpheres(const std::vector<Vector3d>& nodes,
                                             const std::vector<FillingSphere>& spheres,
                                             const std::vector<Attachment>& attachments) {
  std::vector<MassProperties> whole;
  whole.reserve(spheres.size());
  for (const FillingSphere& s : spheres) whole.push_back({s.volume, s.restFrame, s.secondMoment});
  return withoutNodes(std::move(whole), nodes, attachments);
}

MassProperties totalOf(const std::vector<MassProperties>& spheres, const std::vector<Vector3d>& nodes,
                       const std::vector<Attachment>& attachments) {
  std::vector<MassProperties> parts = spheres;
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    parts.push_back({attachments[n].volume, nodes[n], Matrix3d::Zero()});
  }
  return combined(parts);
}

}  // namespace medulla
