#pragma once

#include <Eigen/Core>
#include <optional>

#include "physics/model/triangle_mesh.h"

namespace medulla {

struct Slit {
  double width = 0;                                 // m, where it is narrowest
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // m, of a wall there
};

// The narrowest slit between parts of the surface that face each other across less than `widest` (m) and are far from
// each other along it, if such walls are half a percent of the surface or more: a grid of cells so large takes both for
// one piece. The bottom of a crease is none.
std::optional<Slit> narrowestSlit(const TriangleMesh& mesh, double widest);

}  // namespace medulla
