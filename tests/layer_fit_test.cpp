#include "physics/model/identify/layer_fit.h"

#include <gtest/gtest.h>

#include "physics/dynamics/identified_mechanics.h"
#include "physics/dynamics/rest_measures.h"
#include "tests/identified_model.h"

// The surface layer that `medulla build --identify` fits: the one of the run, found from its own answers.
namespace medulla {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kYoung = 5e3;   // Pa
constexpr double kScale = 0.02;  // m

struct Tube {
  std::vector<int> held{0, 1, 2, 3, 4, 5};
  std::shared_ptr<const SoftBodyModel> model =
      synthetic::withNetwork(*synthetic::body(synthetic::shortTube(), kYoung).model, {.held = held, .surface = 120});
  NodeSurface nodes = measureNodes({model->restNodes, model->triangles}, model->identified->patches);
  SurfaceLayer surface = makeSurfaceLayer(*model, heldSkin(*model), nodes, model->identified->poisson);
};

RowMatrix pokesOf(const Tube& tube) {
  return randomLoads({tube.model->restNodes, tube.model->triangles}, tube.nodes, LoadKind::poke, kScale, 12, 3);
}

VectorXd workOf(const RowMatrix& forces, const MatrixXd& moved) {
  return forces.cwiseProduct(moved).colwise().sum().transpose();
}

TEST(LayerFit, TheLayerIsThatOfTheRun) {
  const Tube tube;
  BodyDescription body = synthetic::identifiedBody(tube.model, kYoung);
  const BodyMechanics mechanics = bodyMechanics(body);
  const RestRates pressure = pressureRates(*tube.model, mechanics);
  const MatrixXd stiffness =
      MatrixXd(layerStiffness(*tube.model, mechanics)) + MatrixXd(pressure * pressure.transpose());
  const RowMatrix forces = pokesOf(tube);
  const MatrixXd moved = layerResponse(tube.surface, tube.model->identified->layer, forces) / kYoung;
  MatrixXd off = stiffness * moved - forces;
  for (const int node : tube.held) off.middleRows<3>(3 * static_cast<Index>(node)).setZero();
  EXPECT_LT(off.norm(), 1e-9 * forces.norm());
}

TEST(LayerFit, FindsTheLayerThatMovesAndWorksSo) {
  const Tube tube;
  const IdentifiedLayer expected{5 / kScale, 1.6 / kScale, 0.04 * kScale};
  const RowMatrix forces = pokesOf(tube);
  const MatrixXd moved = layerResponse(tube.surface, expected, forces);
  const VectorXd work = workOf(forces, moved);
  const IdentifiedLayer found = fitLayer(tube.surface, {forces, moved, work}, kScale);
  // Not exactly: a little is asked of the usual layer.
  EXPECT_NEAR(found.normal / expected.normal, 1, 0.05);
  EXPECT_NEAR(found.tangential / expected.tangential, 1, 0.1);
  EXPECT_NEAR(found.membrane / expected.membrane, 1, 0.2);
  const IdentifiedLayer softer = fitLayer(tube.surface, {forces, moved, 1.2 * work}, kScale);
  const VectorXd sunk = workOf(forces, layerResponse(tube.surface, softer, forces)).cwiseQuotient(work);
  EXPECT_GT(sunk.mean(), 1.1) << "pokes that ought to work more sink deeper";
}

}  // namespace
}  // namespace medulla
