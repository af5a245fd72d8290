#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "physics/model/triangle_mesh.h"

namespace medulla {

// splitmix64 (Steele, Lea and Flood 2014): the same numbers on every machine, which the standard distributions do not
// promise.
struct RandomSequence {
  std::uint64_t state = 0;
  double uniform();          // [0, 1)
  Eigen::Vector3d normal();  // roughly standard normal in each component: sum of twelve uniforms, free of libm
};

struct SurfaceSample {
  Eigen::Vector3d point;   // m
  Eigen::Vector3d normal;  // unit, outward
};

// `count` points spread over the area, one in each of `count` equal parts of it.
std::vector<SurfaceSample> sampleSurface(const TriangleMesh& mesh, int count, std::uint64_t seed);

// Where gaps are measured: the vertices, which stick out furthest, and 12 000 points spread over the area.
std::vector<Eigen::Vector3d> gapPoints(const TriangleMesh& mesh);

}  // namespace medulla
