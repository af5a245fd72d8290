#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace medulla {

// A triangle surface in metres. Triangles are wound counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;
};

}  // namespace medulla
