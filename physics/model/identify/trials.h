#pragma once

#include "physics/model/identify/layer_fit.h"

namespace medulla {

// Random loads, and what finite elements and the network make of them; of a free body with forces, spread by area, that
// balance them, and displacements without their rigid part, in which two answers may differ at will.
class Trials {
 public:
  const TriangleMesh mesh;
  const NodeSurface surface;

  // `network` is read at every question, so that it may go on being fitted. `grounding` as of Responses.
  Trials(const SoftBodyModel& model, const VoxelSolid& solid, const IdentifiedNetwork& network,
         const Eigen::MatrixXd& grounding);

  // N, 3 nodes x loads.
  RowMatrix loads(LoadKind kind, int count, std::uint64_t seed) const;
  // The same, where what is free feels them, with the force, moment and work of tractions that are linear between
  // nodes.
  RowMatrix consistent(const RowMatrix& forces) const;

  // m per Pa of Young's modulus, 3 nodes x loads.
  Eigen::MatrixXd exact(const VoxelSolid& solid, const RowMatrix& forces) const;
  Eigen::MatrixXd ofFrames(const RowMatrix& forces) const;
  Eigen::MatrixXd ofNetwork(const RowMatrix& forces) const;
  Eigen::MatrixXd deformation(Eigen::MatrixXd displacements) const;  // without rigid motion of a free body

  SurfaceLayer layer() const;  // with the network's skin as it is now

 private:
  const SoftBodyModel& model_;
  const IdentifiedNetwork& network_;
  const Eigen::MatrixXd& grounding_;
  // Of a free body: 3 nodes x 6, and times the nodes' areas; and what finite elements feel of forces on the nodes,
  // which they spread, in rigid motions: their pins carry nothing under loads that are balanced so.
  Eigen::MatrixXd rigid_, weighted_, felt_, feltWeighted_;
};

}  // namespace medulla
