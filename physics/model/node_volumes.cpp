#include "physics/model/node_volumes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "physics/model/attachment.h"

namespace medulla {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// `about` with the nodes' shares taken out, about the same points.
static std::vector<MassProperties> withoutNodes(std::vector<MassProperties> about, const std::vector<Vector3d>& nodes,
                                                const std::vector<ElasticLink>& links,
                                                const std::vector<Attachment>& attachments) {
  for (std::size_t n = 0; n < attachments.size(); ++n) {
    const HostShares hosts = hostShares(attachments[n], links);
    for (int k = 0; k < 2; ++k) {
      MassProperties& sphere = about[hosts.sphere[k]];
      const Vector3d r = nodes[n] - sphere.centroid;
      sphere.volume -= hosts.share[k] * attachments[n].volume;
      sphere.secondMoment -= hosts.share[k] * attachments[n].volume * r * r.transpose();
    }
  }
  return about;
}

// First moments of the nodes' shares about the cells' centroids, m4.
static std::vector<Vector3d> firstMoments(const std::vector<MassProperties>& cells, const std::vector<Vector3d>& nodes,
                                          const std::vector<ElasticLink>& links,
                                          const std::vector<Attachment>& attachments) {
  std::vector<Vector3d> moments(cells.size(), Vector3d::Zero());
  for (std::size_t n = 0; n < attachments.size(); ++n) {
    const HostShares hosts = hostShares(attachments[n], links);
    for (int k = 0; k < 2; ++k) {
      const int i = hosts.sphere[k];
      moments[i] += hosts.share[k] * attachments[n].volume * (nodes[n] - cells[i].centroid);
    }
  }
  return moments;
}

// Every cell gives `fraction` of its volume to its nodes, by the area that it shares in.
static void shareByArea(const std::vector<MassProperties>& cells, double fraction,
                        const std::vector<ElasticLink>& links, std::vector<Attachment>& attachments) {
  std::vector<double> area(cells.size(), 0);
  for (const Attachment& a : attachments) {
    const HostShares hosts = hostShares(a, links);
    for (int k = 0; k < 2; ++k) area[hosts.sphere[k]] += hosts.share[k] * a.area;
  }
  for (Attachment& a : attachments) {
    const HostShares hosts = hostShares(a, links);
    a.volume = 0;
    for (int k = 0; k < 2; ++k) {
      const int host = hosts.sphere[k];
      if (hosts.share[k] > 0) a.volume += fraction * hosts.share[k] * a.area / area[host] * cells[host].volume;
    }
  }
}

// Largest part of its volume, or of its second moment in any direction, that a cell loses to its nodes.
static double largestLoss(const MassProperties& cell, const MassProperties& left, const Vector3d& moment) {
  const double volumeLoss = 1 - left.volume / cell.volume;
  if (volumeLoss >= 1) return volumeLoss;
  // From the cell's centroid to the remainder's, which lies at -moment / left.volume.
  const Matrix3d remainder = left.secondMoment - moment * moment.transpose() / left.volume;
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix3d> solver(remainder, cell.secondMoment, Eigen::EigenvaluesOnly);
  return std::max(volumeLoss, 1 - solver.eigenvalues()[0]);
}

// Lowers the volumes of nodes whose hosts would lose too much.
static void limitLosses(const std::vector<Vector3d>& nodes, const std::vector<MassProperties>& cells,
                        const std::vector<ElasticLink>& links, std::vector<Attachment>& attachments) {
  constexpr double lossMax = 0.7;
  constexpr int rounds = 30;
  std::vector<double> factor(cells.size());
  for (int round = 0; round < rounds; ++round) {
    const std::vector<MassProperties> left = withoutNodes(cells, nodes, links, attachments);
    const std::vector<Vector3d> moments = firstMoments(cells, nodes, links, attachments);
    bool within = true;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const double loss = largestLoss(cells[i], left[i], moments[i]);
      factor[i] = loss > lossMax ? std::max(0.5, 0.99 * lossMax / loss) : 1;
      within = within && loss <= lossMax;
    }
    if (within) return;
    for (Attachment& a : attachments) {
      const HostShares hosts = hostShares(a, links);
      a.volume *= std::min(factor[hosts.sphere[0]], factor[hosts.sphere[1]]);
    }
  }
}

void shareOutMass(const std::vector<Vector3d>& nodes, const std::vector<MassProperties>& cells, double fraction,
                  const std::vector<ElasticLink>& links, std::vector<Attachment>& attachments,
                  std::vector<FillingSphere>& spheres) {
  shareByArea(cells, fraction, links, attachments);
  limitLosses(nodes, cells, links, attachments);
  const std::vector<MassProperties> left = withoutNodes(cells, nodes, links, attachments);
  const std::vector<Vector3d> moments = firstMoments(cells, nodes, links, attachments);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Vector3d shift = -moments[i] / left[i].volume;
    spheres[i].restFrame = cells[i].centroid + shift;
    spheres[i].volume = cells[i].volume;
    spheres[i].secondMoment = cells[i].secondMoment + cells[i].volume * shift * shift.transpose();
  }
}

std::vector<MassProperties> remainingSpheres(const std::vector<Vector3d>& nodes,
                                             const std::vector<FillingSphere>& spheres,
                                             const std::vector<ElasticLink>& links,
                                             const std::vector<Attachment>& attachments) {
  std::vector<MassProperties> whole;
  whole.reserve(spheres.size());
  for (const FillingSphere& s : spheres) whole.push_back({s.volume, s.restFrame, s.secondMoment});
  return withoutNodes(std::move(whole), nodes, links, attachments);
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
