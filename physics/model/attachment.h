#pragma once

#include <vector>

#include "physics/model/soft_body_model.h"
#include "physics/model/surface_queries.h"

namespace medulla {

// Hangs every surface node on the nearest point of the skeleton, a sphere's frame or a link's interior (paper 2.3),
// among those that it sees: a segment through the surface would tie limbs together across the gap between them. A node
// that sees none hangs on the nearest. Areas are a third of the triangles around the node; volumes are left at 0.
std::vector<Attachment> attachNodes(const TriangleMesh& mesh, const SurfaceTree& tree,
                                    const std::vector<FillingSphere>& spheres, const std::vector<ElasticLink>& links);

// Keeps what every node hangs on and renews where: the foot on its link after the frames have moved, or the link's end
// where the foot has left it.
void reprojectAttachments(const TriangleMesh& mesh, const std::vector<FillingSphere>& spheres,
                          const std::vector<ElasticLink>& links, std::vector<Attachment>& attachments);

// The point of the skeleton that an attachment hangs on at rest, m.
Eigen::Vector3d restAnchor(const Attachment& attachment, const std::vector<FillingSphere>& spheres,
                           const std::vector<ElasticLink>& links);

// Spheres that carry an attachment and their shares, which sum to 1: the sphere alone, or the two ends of the link
// with 1 - along and along.
struct HostShares {
  std::array<int, 2> sphere;
  std::array<double, 2> share;
};
HostShares hostShares(const Attachment& attachment, const std::vector<ElasticLink>& links);

// m, how deep the tissue between a node and the skeleton is taken to be: its stiffness per area goes by the inverse.
// Measured along the surface's unit normal, from the link's end where a chain ends: what lies between a sphere and the
// end of its chain is the link's to stretch. Never less than the node's share of the surface is wide.
double attachmentDepth(const Attachment& attachment, const Eigen::Vector3d& normal,
                       const std::vector<FillingSphere>& spheres);

// Of an identified body, on frames alone: each node on that it has most of; where it hangs on none of them (or `skin`
// is empty, not being known yet), on that of the cell that it lies in.
std::vector<Attachment> attachmentsToFrames(const SoftBodyModel& model,
                                            const std::vector<std::vector<SkinFrame>>& skin);

// m3, which part of a body's volume lies between each host of `attachments` and its nodes: by area times depth, that of
// the model's own attachments.
struct HostVolumes {
  std::vector<double> links, spheres;
};
HostVolumes hostVolumes(const SoftBodyModel& model, const std::vector<Attachment>& attachments,
                        const std::vector<double>& depth);

// Nodes whose segment to the skeleton crosses the surface.
int countCrossings(const TriangleMesh& mesh, const SurfaceTree& tree, const std::vector<Attachment>& attachments,
                   const std::vector<FillingSphere>& spheres, const std::vector<ElasticLink>& links);

// Buckets of the triangles (paper 4): each lies with the sphere that most of its nodes hang on, a node on a link with
// the nearer end; ties go to the lower sphere. A bucket may be empty.
std::vector<std::vector<int>> fillBuckets(const std::vector<std::array<int, 3>>& triangles,
                                          const std::vector<Attachment>& attachments, int spheres,
                                          const std::vector<ElasticLink>& links);

}  // namespace medulla
