#pragma once

#include <functional>

#include "physics/model/identify/check_loads.h"

namespace medulla {

// Surface nodes on springs to where their frames carry them, and between one another: area (normal n n^T + tangential
// (1 - n n^T)) per node, membrane (sum of the two triangles' areas) / length^2 per edge, on displacements from there.
// Answer of the free nodes to forces (3 nodes x loads); held ones keep still.
Eigen::MatrixXd layerResponse(const TriangleMesh& mesh, const NodeSurface& surface, const IdentifiedLayer& layer,
                              const RowMatrix& forces);

// The layer that best gives what the frames leave of the displacements under `forces`; `rest` is that (3 nodes x
// loads), `scales` what each load's part is divided by (0: it does not count). Springs are 1 to 1000 / lengthScale, the
// membrane 1e-3 to 0.1 lengthScale: softer would leave the frames' work to the layer, stiffer bound the time step for
// nothing. `goOn`, if given, is called at every trial, of which there may be a hundred of seconds each; it may throw.
IdentifiedLayer fitLayer(const TriangleMesh& mesh, const NodeSurface& surface, const RowMatrix& forces,
                         const Eigen::MatrixXd& rest, const Eigen::VectorXd& scales, double lengthScale,
                         const std::function<void()>& goOn = {});

}  // namespace medulla
