#pragma once

#include <Eigen/SparseCore>
#include <array>
#include <functional>

#include "physics/model/identify/check_loads.h"
#include "physics/model/soft_body_model.h"

namespace medulla {

// A surface beside what its frames carry: nodes on springs to there, and between one another, of stiffness area (normal
// n n^T + tangential (1 - n n^T)) per node and membrane (sum of the two triangles' areas) / length^2 per edge; and the
// pressure by which each cell keeps its volume, of stiffness Q Q^T. All per pascal of Young's modulus.
struct SurfaceLayer {
  std::array<Eigen::SparseMatrix<double>, 3> parts;  // 3 nodes square, per unit of normal, tangential and membrane
  Eigen::SparseMatrix<double> held;                  // the identity on held nodes, whose rows are empty otherwise
  Eigen::MatrixXd pressure;                          // Q, 3 nodes x cells
};
// Cells are the nodes' by `skin`, which may be empty, as attachmentsToFrames says.
SurfaceLayer makeSurfaceLayer(const SoftBodyModel& model, const std::vector<std::vector<SkinFrame>>& skin,
                              const NodeSurface& surface, double poisson);

// Answer of the free nodes to forces (3 nodes x loads); held ones keep still.
Eigen::MatrixXd layerResponse(const SurfaceLayer& surface, const IdentifiedLayer& layer, const RowMatrix& forces);

// What a layer is fitted to: what the frames leave to it of each load's displacements, relative to the root of their
// squares' sum; and how much the pokes, the last loads, work on it. Rows of held nodes do not count.
struct LayerLoads {
  Eigen::MatrixXd forces;    // N, 3 nodes x loads
  Eigen::MatrixXd left;      // m per Pa of Young's modulus, likewise
  Eigen::VectorXd pokeWork;  // J per Pa; less than a hundredth of the mean does not count
};

// Springs are 1 to 1000 / lengthScale, to 4 / lengthScale across, the membrane 1e-3 to 0.1 lengthScale: softer would
// leave the frames' work to the layer, stiffer bound the time step for nothing. `goOn` is called at every trial, of
// which there may be a hundred of seconds each; it may throw.
IdentifiedLayer fitLayer(
    const SurfaceLayer& surface, LayerLoads loads, double lengthScale, const std::function<void()>& goOn = [] {});

}  // namespace medulla
