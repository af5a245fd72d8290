#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "physics/model/identify/reduction.h"
#include "physics/model/soft_body_model.h"

// A cylinder of five cells along x, 100 mm long, that finite elements have solved.
namespace medulla {

TriangleMesh cylinder();
const SoftBodyModel& cylinderModel();

// With all their corners where `held` says.
std::vector<int> trianglesWhere(const TriangleMesh& mesh, const std::function<bool(const Eigen::Vector3d&)>& held);

struct Reduced {
  TriangleMesh mesh;
  std::vector<int> heldTriangles;
  VoxelSolid solid;
  CellFrames cells;
  Responses responses;
};

// Held at x = 0, or free.
Reduced reduceCylinder(bool held);

std::vector<Eigen::Vector3d> placesOf(const CellFrames& cells);

}  // namespace medulla
