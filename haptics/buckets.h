#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "haptics/swept_triangle.h"
#include "physics/dynamics/frame.h"
#include "physics/model/soft_body_model.h"

namespace medulla {

// The surfaces of all bodies in one numbering of nodes and triangles, between two dynamics frames.
struct BlendedSurface {
  std::vector<std::array<int, 3>> triangles;  // node numbers
  std::vector<int> bodyOfNode;
  std::vector<int> firstNode;             // of each body
  std::vector<Eigen::Vector3d> from, to;  // m, world, per node
  // m, what each node moved in the frame before `from`, and from `from` to `to`
  std::vector<Eigen::Vector3d> stepBefore, step;
  double duration = 0;  // s, between the two frames

  Eigen::Vector3d node(int n, double alpha) const { return blendPoint(from[n], to[n], alpha); }
  // What a node moves within one frame at its present velocity, m; continuous from frame to frame.
  Eigen::Vector3d nodeStep(int n, double alpha) const { return blendPoint(stepBefore[n], step[n], alpha); }
  Triangle triangle(int t, double alpha) const {
    const auto& [a, b, c] = triangles[t];
    return {node(a, alpha), node(b, alpha), node(c, alpha)};
  }
};

struct SurfaceHit : SweepHit {
  int triangle = -1;
};

// Finds the triangles near a proxy (paper 4). Every filling sphere owns a bucket of triangles; a flat test of the
// buckets' bounding spheres (the paper's second, larger radius, renewed at each commit) selects buckets, inside which
// Embree finds candidates. Embree only narrows down, on bounds padded for its float arithmetic; what counts is decided
// by swept_triangle in double, so that results do not depend on instruction set, visit order or bucket count.
class Buckets {
 public:
  // `largestRadius`: of any sphere that will be swept, m. Throws std::runtime_error when Embree cannot start.
  Buckets(const std::vector<std::shared_ptr<const SoftBodyModel>>& bodies, double largestRadius,
          const DynamicsFrame& rest);
  ~Buckets();
  Buckets(Buckets&&) noexcept;
  Buckets& operator=(Buckets&&) noexcept;

  const BlendedSurface& surface() const;

  // The two frames to blend from now on. Bounding spheres are renewed around both; a bucket's triangles are refitted by
  // refitNear(), or else by the first query that reaches them.
  void commit(const DynamicsFrame& from, const DynamicsFrame& to);
  // Those of the buckets within largestRadius + `distance` (m) of `centre`: so that queries need not.
  void refitNear(const Eigen::Vector3d& centre, double distance);

  // First touch of a sphere that moves from `centre` to `centre + motion` while the surface stands at alpha; of equal
  // times the lowest triangle. Finite input within toolReach is asserted: Embree would abort the process on NaN.
  bool sweep(const Eigen::Vector3d& centre, const Eigen::Vector3d& motion, double radius, double alpha,
             SurfaceHit& hit) const;

  // Triangles that may come within largestRadius + `distance` of `centre` at any alpha, sorted; a superset. Valid until
  // the next call.
  const std::vector<int>& near(const Eigen::Vector3d& centre, double distance);

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

// Of the library that runs, not of the headers: "3.13.5".
std::string embreeVersion();

}  // namespace medulla
