#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "physics/model/triangle_mesh.h"

namespace medulla {

struct Neck {
  double width = 0;                                 // m, of a disc as large as its section
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // m
};

// The narrowest neck between two parts of the body, each of `leastPart` of its volume or more, if one is narrower than
// `widest` (m); wherever it lies, and however the spheres are linked across it. Between parts of which neither holds a
// ball as wide as that there is none to find. `goOn` is called now and then, and may throw.
std::optional<Neck> narrowestNeck(
    const TriangleMesh& mesh, double widest, double leastPart, const std::function<void()>& goOn = [] {});

}  // namespace medulla
