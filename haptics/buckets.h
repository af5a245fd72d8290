#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "haptics/embree_settings.h"
#include "haptics/swept_triangle.h"
#include "physics/dynamics/frame.h"
#include "physics/model/mesh_topology.h"
#include "physics/model/soft_body_model.h"

namespace medulla {

// A surface that a tool can touch: a soft body's triangles grouped by filling sphere.
struct TouchableBody {
  std::shared_ptr<const SoftBodyModel> model;
  std::vector<NodeGive> give{};  // per node; empty: nothing
};

// Frames: the servo is one ahead of the frame that it blends, and a mean over a frame is as old as its middle.
constexpr double kToolForceAge = 1.5;

// The surfaces of all bodies in one numbering of nodes and triangles, between two dynamics frames.
struct BlendedSurface {
  std::vector<std::array<int, 3>> triangles;  // node numbers
  std::vector<int> bodyOfNode;
  std::vector<int> firstNode;  // of each body
  std::vector<NodeGive> give;  // per node: TouchableBody::give
  IndexLists trianglesOfNodes;
  std::vector<char> isCrease;             // per node: nodesOnCreases()
  std::vector<Eigen::Vector3d> from, to;  // m, world, per node
  // m, what each node moved from `from` to `to`, in the frame before and in the one before that
  std::array<std::vector<Eigen::Vector3d>, 3> steps;
  double duration = 0;  // s, between the two frames
  // N, by each tool on what it touched, means over the frame between `from` and `to`, and over the one before; empty:
  // not known. Blended between them, so many frames old.
  std::array<std::vector<Eigen::Vector3d>, 2> toolForce;
  double toolForceAge = kToolForceAge;

  Eigen::Vector3d node(int n, double alpha) const { return blendPoint(from[n], to[n], alpha); }
  // What a node moves within one frame at its present velocity, m; continuous from frame to frame.
  Eigen::Vector3d nodeStep(int n, double alpha) const { return blendPoint(steps[1][n], steps[0][n], alpha); }
  // By how far it is by now ahead of its place at alpha, at its present acceleration; continuous likewise.
  Eigen::Vector3d nodeLead(int n, double alpha) const {
    return blendPoint(2 * steps[1][n] - steps[2][n], 2 * steps[0][n] - steps[1][n], alpha);
  }
  Triangle triangle(int t, double alpha) const {
    const auto& [a, b, c] = triangles[t];
    return {node(a, alpha), node(b, alpha), node(c, alpha)};
  }
};

struct SurfaceHit : SweepHit {
  int triangle = -1, bucket = -1;
};

// Finds the triangles near a proxy (paper 4). Every filling sphere owns a bucket of triangles; a flat test of the
// buckets' bounding spheres (the paper's second, larger radius, renewed at each commit) selects buckets, inside which
// Embree finds candidates. Embree only narrows down, on bounds padded for its float arithmetic; what counts is decided
// in double, so that results do not depend on instruction set, visit order or bucket count.
//
// One is a snapshot: the dynamics' thread commits, the servo's asks, and a TripleBuffer keeps the two apart. Asking
// neither allocates nor locks.
class Buckets {
 public:
  // `bodies`: the first of those in the frames, or all; `largestRadius`: of any sphere that will be swept, m. Throws
  // std::runtime_error when Embree cannot start.
  Buckets(const std::vector<TouchableBody>& bodies, double largestRadius, const DynamicsFrame& rest,
          const EmbreeSettings& embree = {});
  ~Buckets();
  Buckets(Buckets&&) noexcept;
  Buckets& operator=(Buckets&&) noexcept;

  const BlendedSurface& surface() const;

  // The two frames to blend from now on, the steps of the commit before and the tools' forces (BlendedSurface).
  // Bounding spheres are renewed around both frames; Embree's bounds only by refitNear().
  void commit(const DynamicsFrame& from, const DynamicsFrame& to,
              const std::array<std::vector<Eigen::Vector3d>, 3>& stepsBefore,
              const std::array<std::vector<Eigen::Vector3d>, 2>& toolForce = {}, double toolForceAge = kToolForceAge);
  // Renews Embree's bounds in the buckets within largestRadius + `distance` (m) of `centre`. Buckets that are left out
  // are searched triangle by triangle, with the same result.
  void refitNear(const Eigen::Vector3d& centre, double distance);

  // First touch of a sphere that moves from `centre` to `centre + motion` while the surface stands at alpha; of equal
  // times the lowest triangle. `firstBucket`, the one touched last, is tried first; it affects only speed, never the
  // result. Finite input within kToolReach is asserted: Embree would abort the process on NaN.
  bool sweep(const Eigen::Vector3d& centre, const Eigen::Vector3d& motion, double radius, double alpha, int firstBucket,
             SurfaceHit& hit) const;

  // Triangles whose box around both frames, grown by largestRadius, comes within `distance` of `centre`, sorted: a
  // superset of those that come so near at any alpha. Valid until the next call.
  const std::vector<int>& near(const Eigen::Vector3d& centre, double distance) const;
  // A superset of the triangles that lie over p along z at any alpha. Valid until the next call of either.
  const std::vector<int>& above(const Eigen::Vector3d& p) const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

// Of the library that runs, not of the headers: "3.13.5".
std::string embreeVersion();

}  // namespace medulla
