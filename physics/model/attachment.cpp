#include "physics/model/attachment.h"

#include <algorithm>
#include <cmath>

#include "physics/model/identified_network.h"
#include "physics/model/mesh_topology.h"

namespace medulla {

using Eigen::Vector3d;

namespace {

struct HostChoice {
  double distance;
  Attachment attachment;
};

double footOnLink(const Vector3d& node, const ElasticLink& link, const std::vector<FillingSphere>& spheres) {
  const Vector3d start = spheres[link.sphere0].restLinkEnd, line = spheres[link.sphere1].restLinkEnd - start;
  return (node - start).dot(line) / line.squaredNorm();
}

// A node at a link's very end moves with the sphere there.
bool isInside(double along) {
  constexpr double kEnd = 1e-3;
  return along > kEnd && along < 1 - kEnd;
}

// Every sphere, and every link whose interior holds the foot of the perpendicular, nearest first.
std::vector<HostChoice> hostChoices(const Vector3d& node, const std::vector<FillingSphere>& spheres,
                                    const std::vector<ElasticLink>& links) {
  std::vector<HostChoice> choices;
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    Attachment a;
    a.host = static_cast<int>(i);
    a.restOffset = node - spheres[i].restFrame;
    choices.push_back({a.restOffset.norm(), a});
  }
  for (std::size_t i = 0; i < links.size(); ++i) {
    const double along = footOnLink(node, links[i], spheres);
    if (!isInside(along)) continue;
    Attachment a;
    a.onLink = true;
    a.host = static_cast<int>(i);
    a.along = along;
    a.restOffset = node - restAnchor(a, spheres, links);
    choices.push_back({a.restOffset.norm(), a});
  }
  std::stable_sort(choices.begin(), choices.end(),
                   [](const HostChoice& a, const HostChoice& b) { return a.distance < b.distance; });
  return choices;
}

}  // namespace

std::vector<Attachment> attachNodes(const TriangleMesh& mesh, const SurfaceTree& tree,
                                    const std::vector<FillingSphere>& spheres, const std::vector<ElasticLink>& links) {
  std::vector<Attachment> attachments;
  attachments.reserve(mesh.vertices.size());
  for (std::size_t n = 0; n < mesh.vertices.size(); ++n) {
    const Vector3d& node = mesh.vertices[n];
    const std::vector<HostChoice> choices = hostChoices(node, spheres, links);
    const auto visible = std::find_if(choices.begin(), choices.end(), [&](const HostChoice& a) {
      return !segmentCrosses(tree, node - a.attachment.restOffset, node, static_cast<int>(n));
    });
    attachments.push_back(visible != choices.end() ? visible->attachment : choices.front().attachment);
  }
  const std::vector<double> areas = vertexAreas(mesh);
  for (std::size_t n = 0; n < attachments.size(); ++n) attachments[n].area = areas[n];
  return attachments;
}

void reprojectAttachments(const TriangleMesh& mesh, const std::vector<FillingSphere>& spheres,
                          const std::vector<ElasticLink>& links, std::vector<Attachment>& attachments) {
  for (std::size_t n = 0; n < attachments.size(); ++n) {
    Attachment& a = attachments[n];
    if (a.onLink) {
      const ElasticLink& link = links[a.host];
      a.along = footOnLink(mesh.vertices[n], link, spheres);
      if (!isInside(a.along)) {
        a.onLink = false;
        a.host = a.along < 0.5 ? link.sphere0 : link.sphere1;
        a.along = 0;
      }
    }
    a.restOffset = mesh.vertices[n] - restAnchor(a, spheres, links);
  }
}

Vector3d restAnchor(const Attachment& a, const std::vector<FillingSphere>& spheres,
                    const std::vector<ElasticLink>& links) {
  if (!a.onLink) return spheres[a.host].restFrame;
  const ElasticLink& link = links[a.host];
  return (1 - a.along) * spheres[link.sphere0].restLinkEnd + a.along * spheres[link.sphere1].restLinkEnd;
}

double attachmentDepth(const Attachment& a, const Vector3d& normal, const std::vector<FillingSphere>& spheres) {
  Vector3d offset = a.restOffset;
  if (!a.onLink) offset += spheres[a.host].restFrame - spheres[a.host].restLinkEnd;
  return std::max(std::abs(offset.dot(normal)), std::sqrt(a.area));
}

HostShares hostShares(const Attachment& a, const std::vector<ElasticLink>& links) {
  if (!a.onLink) return {{a.host, a.host}, {1, 0}};
  return {{links[a.host].sphere0, links[a.host].sphere1}, {1 - a.along, a.along}};
}

std::vector<Attachment> attachmentsToFrames(const SoftBodyModel& model,
                                            const std::vector<std::vector<SkinFrame>>& skin) {
  std::vector<Attachment> out = model.attachments;
  for (std::size_t i = 0; i < out.size(); ++i) {
    Attachment& a = out[i];
    a.onLink = false;
    a.along = 0;
    a.host = a.massSphere;
    double most = 0;
    if (!skin.empty()) {
      for (const SkinFrame& f : skin[i]) {
        if (f.frame >= static_cast<int>(model.spheres.size()) || f.weight <= most) continue;
        most = f.weight;
        a.host = f.frame;
      }
    }
    a.restOffset = model.restNodes[i] - model.spheres[a.host].restFrame;
  }
  return out;
}

HostVolumes hostVolumes(const SoftBodyModel& model, const std::vector<Attachment>& attachments,
                        const std::vector<double>& depth) {
  HostVolumes out{std::vector<double>(model.links.size(), 0), std::vector<double>(model.spheres.size(), 0)};
  double sum = 0;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const Attachment& a = attachments[i];
    (a.onLink ? out.links : out.spheres)[a.host] += a.area * depth[i];
    sum += a.area * depth[i];
  }
  const double volume = enclosedVolume({model.restNodes, model.triangles});
  for (std::vector<double>* hosts : {&out.links, &out.spheres})
    for (double& share : *hosts) share = share > 0 ? volume * share / sum : 0;
  return out;
}

int countCrossings(const TriangleMesh& mesh, const SurfaceTree& tree, const std::vector<Attachment>& attachments,
                   const std::vector<FillingSphere>& spheres, const std::vector<ElasticLink>& links) {
  int crossings = 0;
  for (std::size_t n = 0; n < attachments.size(); ++n) {
    const Vector3d anchor = restAnchor(attachments[n], spheres, links);
    crossings += segmentCrosses(tree, anchor, mesh.vertices[n], static_cast<int>(n)) ? 1 : 0;
  }
  return crossings;
}

std::vector<std::vector<int>> fillBuckets(const std::vector<std::array<int, 3>>& triangles,
                                          const std::vector<Attachment>& attachments, int spheres,
                                          const std::vector<ElasticLink>& links) {
  const auto sphereOf = [&](int node) {
    const HostShares hosts = hostShares(attachments[node], links);
    if (hosts.share[0] == hosts.share[1]) return std::min(hosts.sphere[0], hosts.sphere[1]);
    return hosts.sphere[hosts.share[0] > hosts.share[1] ? 0 : 1];
  };
  std::vector<std::vector<int>> buckets(spheres);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    std::array<int, 3> s = {sphereOf(triangles[t][0]), sphereOf(triangles[t][1]), sphereOf(triangles[t][2])};
    std::sort(s.begin(), s.end());
    const int winner = s[1] == s[2] ? s[1] : s[0];  // a majority is the middle one; three different: the lowest
    buckets[winner].push_back(static_cast<int>(t));
  }
  return buckets;
}

}  // namespace medulla
