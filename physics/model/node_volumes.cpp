#include "physics/model/node_volumes.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

#include "physics/model/attachment.h"

namespace medulla {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

using Conditions = Eigen::Matrix<double, 9, 1>;

// What one unit of a node's volume adds to the errors of the centre (3) and of the second moment (6), scaled to
// lengths of `size`.
Conditions errorPerVolume(const Vector3d& node, const HostShares& hosts, const std::vector<FillingSphere>& spheres,
                          const Vector3d& centroid, double size) {
  Vector3d first = Vector3d::Zero();
  Matrix3d second = Matrix3d::Zero();
  for (int k = 0; k < 2; ++k) {
    const Vector3d& frame = spheres[hosts.sphere[k]].restFrame;
    const Vector3d f = (frame - centroid) / size, r = (node - frame) / size;
    first += hosts.share[k] * r;
    second += hosts.share[k] * (f * r.transpose() + r * f.transpose());
  }
  Conditions c;
  c.segment<3>(0) = first;
  c.segment<3>(3) = second.diagonal();
  c.segment<3>(6) = Vector3d(second(0, 1), second(1, 2), second(2, 0));
  return c;
}

// Largest part of its volume, or of its second moment in any direction, that a sphere loses.
double largestLoss(const FillingSphere& before, const MassProperties& after) {
  const Matrix3d lost = before.secondMoment - after.secondMoment;
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix3d> solver(lost, before.secondMoment, Eigen::EigenvaluesOnly);
  return std::max(solver.eigenvalues()[2], 1 - after.volume / before.volume);
}

// Lowers the volumes on hosts beyond their limit and raises the others to the wanted sum, in turn.
void limitLosses(const std::vector<Vector3d>& nodes, double wanted, const std::vector<FillingSphere>& spheres,
                 const std::vector<ElasticLink>& links, std::vector<Attachment>& attachments) {
  constexpr double lossMax = 0.7;
  constexpr int rounds = 20;
  for (int round = 0; round < rounds; ++round) {
    const std::vector<MassProperties> reduced = reducedSpheres(nodes, spheres, links, attachments);
    std::vector<double> factor(spheres.size());
    for (std::size_t i = 0; i < spheres.size(); ++i) {
      factor[i] = std::min(1., lossMax / std::max(largestLoss(spheres[i], reduced[i]), 1e-9));
    }
    double sum = 0, free = 0;
    std::vector<char> limited(attachments.size(), 0);
    for (std::size_t n = 0; n < attachments.size(); ++n) {
      const HostShares hosts = hostShares(attachments[n], links);
      const double f = std::min(factor[hosts.sphere[0]], factor[hosts.sphere[1]]);
      limited[n] = f < 1;
      attachments[n].volume *= f;
      sum += attachments[n].volume;
      if (!limited[n]) free += attachments[n].volume;
    }
    const double missing = wanted - sum;
    if (missing <= 1e-12 * wanted || free <= 0 || round + 1 == rounds) return;
    const double raise = std::min(1 + missing / free, 1.5);
    for (std::size_t n = 0; n < attachments.size(); ++n) {
      if (!limited[n]) attachments[n].volume *= raise;
    }
  }
}

// Least sum of (change / volume)^2 volume under the nine conditions, with changes bounded to half of each volume:
// nodes at their bound are held there and the rest solved again.
void balance(const std::vector<Vector3d>& nodes, const MassProperties& body, const std::vector<FillingSphere>& spheres,
             const std::vector<ElasticLink>& links, std::vector<Attachment>& attachments) {
  constexpr double changeMax = 0.5;
  const double size = std::cbrt(body.volume);
  const std::size_t count = attachments.size();
  std::vector<Conditions> error(count);
  for (std::size_t n = 0; n < count; ++n) {
    error[n] = errorPerVolume(nodes[n], hostShares(attachments[n], links), spheres, body.centroid, size);
  }
  std::vector<double> change(count, 0);
  std::vector<char> held(count, 0);
  for (int round = 0; round < 10; ++round) {
    Conditions residual = Conditions::Zero();
    Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
    for (std::size_t n = 0; n < count; ++n) {
      const double volume = attachments[n].volume;
      residual += (held[n] ? 1 + change[n] : 1.) * volume * error[n];
      if (!held[n]) normal += volume * error[n] * error[n].transpose();
    }
    // Symmetric bodies leave conditions empty or dependent: the small diagonal keeps those at no change.
    normal.diagonal().array() += 1e-12 * normal.trace() + 1e-300;
    const Conditions multiplier = normal.ldlt().solve(residual);
    bool bounded = false;
    for (std::size_t n = 0; n < count; ++n) {
      if (held[n]) continue;
      change[n] = -error[n].dot(multiplier);
      if (std::abs(change[n]) > changeMax) {
        change[n] = change[n] > 0 ? changeMax : -changeMax;
        held[n] = 1;
        bounded = true;
      }
    }
    if (!bounded) break;
  }
  for (std::size_t n = 0; n < count; ++n) attachments[n].volume *= 1 + change[n];
}

}  // namespace

std::vector<MassProperties> reducedSpheres(const std::vector<Vector3d>& nodes,
                                           const std::vector<FillingSphere>& spheres,
                                           const std::vector<ElasticLink>& links,
                                           const std::vector<Attachment>& attachments) {
  std::vector<MassProperties> reduced;
  for (const FillingSphere& s : spheres) reduced.push_back({s.volume, s.restFrame, s.secondMoment});
  for (std::size_t n = 0; n < attachments.size(); ++n) {
    const HostShares hosts = hostShares(attachments[n], links);
    for (int k = 0; k < 2; ++k) {
      MassProperties& sphere = reduced[hosts.sphere[k]];
      const Vector3d r = nodes[n] - sphere.centroid;
      sphere.volume -= hosts.share[k] * attachments[n].volume;
      sphere.secondMoment -= hosts.share[k] * attachments[n].volume * r * r.transpose();
    }
  }
  return reduced;
}

MassProperties totalOf(const std::vector<MassProperties>& reduced, const std::vector<Vector3d>& nodes,
                       const std::vector<Attachment>& attachments) {
  MassProperties total;
  for (const MassProperties& s : reduced) {
    total.volume += s.volume;
    total.centroid += s.volume * s.centroid;
  }
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    total.volume += attachments[n].volume;
    total.centroid += attachments[n].volume * nodes[n];
  }
  total.centroid /= total.volume;
  for (const MassProperties& s : reduced) {
    const Vector3d r = s.centroid - total.centroid;
    total.secondMoment += s.secondMoment + s.volume * r * r.transpose();
  }
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const Vector3d r = nodes[n] - total.centroid;
    total.secondMoment += attachments[n].volume * r * r.transpose();
  }
  return total;
}

void setNodeVolumes(const std::vector<Vector3d>& nodes, const MassProperties& body, double fraction,
                    const std::vector<FillingSphere>& spheres, const std::vector<ElasticLink>& links,
                    std::vector<Attachment>& attachments) {
  std::vector<double> area(spheres.size(), 0);
  for (const Attachment& a : attachments) {
    const HostShares hosts = hostShares(a, links);
    for (int k = 0; k < 2; ++k) area[hosts.sphere[k]] += hosts.share[k] * a.area;
  }
  for (Attachment& a : attachments) {
    const HostShares hosts = hostShares(a, links);
    a.volume = 0;
    for (int k = 0; k < 2; ++k) {
      const int host = hosts.sphere[k];
      if (hosts.share[k] > 0) a.volume += fraction * hosts.share[k] * a.area / area[host] * spheres[host].volume;
    }
  }
  if (fraction == 0) return;
  limitLosses(nodes, fraction * body.volume, spheres, links, attachments);
  balance(nodes, body, spheres, links, attachments);
}

}  // namespace medulla
