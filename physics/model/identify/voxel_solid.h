#pragma once

#include <Eigen/Geometry>
#include <Eigen/SparseCore>
#include <functional>
#include <stdexcept>
#include <vector>

#include "physics/model/identify/held_region.h"
#include "physics/model/identify/multifrontal.h"
#include "physics/model/triangle_mesh.h"

namespace medulla {

constexpr double kHeldPenalty = 100;  // times E / cell size: a hundredth of the cell's own give, of no account

using RowSparse = Eigen::SparseMatrix<double, Eigen::RowMajor>;

// The body as finite elements, per pascal of Young's modulus: quadratic cells of a regular grid, held by stiff springs
// on whole triangles of the surface (penalty 100 / cell size). Material behind what is held has no cells: its fan is
// held instead. A body that nothing holds stands on six springs that hold rigid motions alone: they carry nothing under
// balanced loads.
struct VoxelSolid {
  VoxelBody voxels;            // of all the body, HexGrid::kVoxels of them along a cell's edge
  std::vector<bool> isBehind;  // of each piece of them: has no cell and does not move
  bool isFree = false;         // nothing is held
  HexGrid grid;
  DissectionPlan plan;
  FrontFactors factors;
  RowSparse rimSprings;  // 3 grid nodes square: the held springs' within a cell of where what is held ends
  double give = 0;       // what these give beyond their own, in parts of it (held_give.h)
  RowSparse surface;     // 3 mesh nodes x 3 grid nodes: displacement of the mesh's nodes
  RowSparse loading;     // 3 grid nodes x 3 mesh nodes: a node's force as a traction that falls to 0 on its neighbours
};

struct SolidSettings {
  double poisson = 0.45;  // 0 <= poisson < 0.5
  std::vector<int> heldTriangles;
  std::vector<HeldSpace> heldSpaces;
  double memoryMax = 3e9;  // bytes for the factors, or for the voxels of the box around the body
};

// Cells that would be too many, or whose factors or voxels would take more memory than they may.
struct OverBudget : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// The size of the cells that makeVoxelSolid makes when asked for `cellSize`: within a percent of it.
double metCellSize(const TriangleMesh& mesh, double cellSize);

// Throws OverBudget where the voxels of cells of that size would, all over the body's box.
void requireRoom(const TriangleMesh& mesh, double cellSize, double memoryMax);

// Throws OverBudget, and std::runtime_error where the body is so thin that its cells do not hang together.
VoxelSolid makeVoxelSolid(
    const TriangleMesh& mesh, double cellSize, const SolidSettings& settings,
    const std::function<void(double)>& progress = [](double) {});

// Displacements of the grid's nodes, in place of the forces on them (3 grid nodes x loads).
void solveSolid(const VoxelSolid& solid, RowMatrix& x);

// Displacements of the grid's nodes under forces on the mesh's nodes (3 mesh nodes x loads).
RowMatrix displacementsUnder(const VoxelSolid& solid, const RowMatrix& forces);

}  // namespace medulla
