#include "physics/model/identify/trials.h"

#include "physics/model/identify/link_fit.h"
#include "physics/model/identify/reduction.h"
#include "physics/model/identify/skin_fit.h"

namespace medulla {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

static VectorXd perAxis(const NodeSurface& surface) {  // the nodes' areas, three times each
  return VectorXd::Map(surface.areas.data(), static_cast<Index>(surface.areas.size()))
      .transpose()
      .replicate<3, 1>()
      .reshaped();
}

Trials::Trials(const SoftBodyModel& model, const VoxelSolid& solid, const IdentifiedNetwork& network,
               const MatrixXd& grounding)
    : mesh{model.restNodes, model.triangles},
      surface(measureNodes(mesh, network.patches)),
      model_(model),
      network_(network),
      grounding_(grounding) {
  if (grounding.size() == 0) return;
  const Eigen::Vector3d& centre = network.frames[0].restPosition;
  felt_ = solid.loading.transpose() * rigidMotions(solid.grid.nodes, centre, 3, network.lengthScale);
  rigid_ = rigidMotions(mesh.vertices, centre, 3, network.lengthScale);
  weighted_ = perAxis(surface).asDiagonal() * rigid_;
  feltWeighted_ = perAxis(surface).asDiagonal() * felt_;
}

RowMatrix Trials::loads(LoadKind kind, int count, std::uint64_t seed) const {
  RowMatrix forces = randomLoads(mesh, surface, kind, network_.lengthScale, count, seed);
  if (rigid_.size() > 0)
    forces -= feltWeighted_ * solvePositive(felt_.transpose() * feltWeighted_, felt_.transpose() * forces);
  return forces;
}

RowMatrix Trials::consistent(const RowMatrix& forces) const {
  RowMatrix out = consistentForces(mesh, perAxis(surface).cwiseInverse().asDiagonal() * forces);
  for (std::size_t n = 0; n < surface.held.size(); ++n)
    if (surface.held[n]) out.middleRows<3>(3 * static_cast<Index>(n)).setZero();
  return out;
}

MatrixXd Trials::exact(const VoxelSolid& solid, const RowMatrix& forces) const {
  return deformation(solid.surface * displacementsUnder(solid, forces));
}

MatrixXd Trials::ofFrames(const RowMatrix& forces) const {
  const int frames = static_cast<int>(network_.frames.size());
  const RowSparse skin = skinMatrix(network_.skin, frames);
  MatrixXd stiffness = networkStiffness(network_.links, network_.lengthScale, frames);
  if (grounding_.size() > 0) stiffness += grounding_;
  MatrixXd onFrames = skin.transpose() * forces;
  for (const Index held : network_.heldFrames) {  // as in a run
    stiffness.middleRows<6>(6 * held).setZero();
    stiffness.middleCols<6>(6 * held).setZero();
    stiffness.block<6, 6>(6 * held, 6 * held).setIdentity();
    onFrames.middleRows<6>(6 * held).setZero();
  }
  return deformation(skin * solvePositive(stiffness, onFrames));
}

SurfaceLayer Trials::layer() const {
  return makeSurfaceLayer(model_, network_.skin, surface, network_.poisson);
}

MatrixXd Trials::ofNetwork(const RowMatrix& forces) const {
  return ofFrames(forces) + deformation(layerResponse(layer(), network_.layer, forces));
}

MatrixXd Trials::deformation(MatrixXd displacements) const {
  if (rigid_.size() > 0)
    displacements -= rigid_ * solvePositive(rigid_.transpose() * weighted_, weighted_.transpose() * displacements);
  return displacements;
}

}  // namespace medulla
