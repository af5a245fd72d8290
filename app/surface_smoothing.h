#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/model/mesh_topology.h"
#include "physics/model/soft_body_model.h"

// A node rides on its sphere or link and thins by that link's stretch alone, so that at the border of two hosts the
// surface has a step. A coarse mesh, with edges of a third of a sphere's radius, hides it: Loop subdivision smooths
// over an edge. A finer mesh shows it as a ring around the body, and is drawn as smoothly as a coarse one would be.
namespace medulla {

// A smoothed node is y = sum share_k T_k(A) x, with A the mean of a node's neighbours and T_k Chebyshev's polynomials;
// it is drawn at y + frame * offset, with (t0, n x t0, n) the frame that t0 = |y_along - y| and y_across - y span. The
// offset is what smoothing takes off the shape at rest.
struct SurfaceSmoothing {
  std::vector<double> share;  // sum 1; empty: nothing is smoothed
  IndexLists neighbours;      // of each node
  std::vector<int> along, across;
  std::vector<Eigen::Vector3d> offset;  // m
};

// Nothing for a mesh of up to kSmoothTriangles, or with edges of kSmoothEdge mean sphere radii, or without links.
constexpr int kSmoothTriangles = 2000;
constexpr double kSmoothEdge = 0.3;
SurfaceSmoothing makeSurfaceSmoothing(const SoftBodyModel& model);

// `nodes` as they are to be drawn, where anything is smoothed. Carried rigidly by a rigid motion, and as they are at
// rest.
std::vector<Eigen::Vector3d> smoothed(const SurfaceSmoothing& smoothing, const std::vector<Eigen::Vector3d>& nodes);

}  // namespace medulla
