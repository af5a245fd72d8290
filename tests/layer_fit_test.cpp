#include "physics/model/identify/layer_fit.h"

#include <gtest/gtest.h>

#include <cmath>

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
  double poisson = 0.45;
  std::shared_ptr<const SoftBodyModel> model =
      synthetic::withNetwork(*synthetic::body(synthetic::shortTube(), kYoung).model, {.held = held, .surface = 120},
                             Vector3d::Zero(), poisson);
  NodeSurface nodes = measureNodes({model->restNodes, model->triangles}, model->identified->patches);
  SurfaceLayer surface = makeSurfaceLayer(*model, heldSkin(*model), nodes, model->identified->poisson);
};

RowMatrix pokesOf(const Tube& tube) {
  return randomLoads({tube.model->restNodes, tube.model->triangles}, tube.nodes, LoadKind::poke, kScale, 12, 3);
}

VectorXd workOf(const RowMatrix& forces, const MatrixXd& moved) {
  return forces.cwiseProduct(moved).colwise().sum().transpose();
}

void expectLayerOfTheRun(const Tube& tube) {
  BodyDescription body = synthetic::identifiedBody(tube.model, kYoung);
  body.tissue.poisson = tube.poisson;
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

TEST(LayerFit, TheLayerIsThatOfTheRun) {
  expectLayerOfTheRun({});
  expectLayerOfTheRun({.held = {}});
  expectLayerOfTheRun({.poisson = 0.3});  // below where the pressure's stiffness is capped
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

// What fitLayer() says it makes least, written down anew. A slope that were not this sum's own would stop elsewhere.
double objective(const Tube& tube, const RowMatrix& forces, const MatrixXd& left, const VectorXd& work,
                 const Vector3d& logarithms) {
  const Vector3d k = logarithms.array().exp();
  const MatrixXd moved = layerResponse(tube.surface, {k[0] / kScale, k[1] / kScale, k[2] * kScale}, forces);
  const VectorXd excess = workOf(forces, moved).cwiseQuotient(work) - VectorXd::Ones(work.size());
  return (left - moved).colwise().squaredNorm().cwiseQuotient(left.colwise().squaredNorm()).sum() +
         10 * excess.squaredNorm();
}

TEST(LayerFit, StandsWhereItsSumIsLeast) {
  const Tube tube;
  const RowMatrix forces = pokesOf(tube);
  // No layer moves so and works so: a compromise, away from the usual one.
  const MatrixXd left = layerResponse(tube.surface, {6 / kScale, 2 / kScale, 0.05 * kScale}, forces);
  const VectorXd work =
      1.3 * workOf(forces, layerResponse(tube.surface, {4 / kScale, 3 / kScale, 0.02 * kScale}, forces));
  const IdentifiedLayer found = fitLayer(tube.surface, {forces, left, work}, kScale);
  const Vector3d usual(std::log(3.), std::log(1.2), std::log(0.03));
  const double hold = 0.03 * objective(tube, forces, left, work, usual);
  const auto sum = [&](const Vector3d& x) {
    return objective(tube, forces, left, work, x) + hold * (x - usual).squaredNorm();
  };
  const Vector3d at(std::log(found.normal * kScale), std::log(found.tangential * kScale),
                    std::log(found.membrane / kScale));
  for (int k = 0; k < 3; ++k) {
    const Vector3d aside = 0.03 * Vector3d::Unit(k);
    EXPECT_GT(sum(at + aside), sum(at)) << k;
    EXPECT_GT(sum(at - aside), sum(at)) << k;
  }
}

}  // namespace
}  // namespace medulla
