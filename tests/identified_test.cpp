#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "physics/dynamics/identified_measures.h"
#include "physics/dynamics/identified_mechanics.h"
#include "physics/dynamics/identified_stages.h"
#include "tests/complaint.h"
#include "tests/dynamics_states.h"
#include "tests/identified_model.h"

// Links, skin and patches of an identified network, whatever its numbers.
namespace medulla {

using namespace states;

namespace {

constexpr double kYoung = 5e3;

// Five spheres, 20 mm apart; the first one's end is held.
BodyDescription chain(SurfaceMode surface, bool held, double damping = 0, double uneven = 0.3) {
  const auto tube = synthetic::shortTube();
  synthetic::NetworkSettings settings;
  settings.uneven = uneven;
  settings.frames = 4;
  if (held)
    for (int i = 0; i < 11; ++i) settings.held.push_back(i);
  BodyDescription out =
      synthetic::identifiedBody(synthetic::withNetwork(*tube, settings, {0.001, -0.002, 0.001}), kYoung);
  out.surface = surface;
  out.tissue.damping = damping;
  return out;
}

// Of one sphere against the next, rad, either way round.
double turnAgainstNext(const WorldData& d, int i) {
  const Quaterniond q = orientation(d, i).conjugate() * orientation(d, i + 1);
  return 2 * std::atan2(q.vec().norm(), q.w());
}

}  // namespace

TEST(IdentifiedLink, ForcesAreMinusTheEnergyGradient) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    World world(weightless(), {chain(SurfaceMode::skin, true)});
    shake(world.data(), seed, seed <= 3 ? 0.2 : 1.0, 0.004, 0);
    expectForcesAreMinusGradient(world.data(), 1e-6);
  }
}

TEST(IdentifiedLink, ForcesAreMinusTheGradientTurnedByAnyAngle) {
  // Beyond 232 degrees the rotation vector falls back, and forces are its slope still.
  for (const double degrees : {60.0, 120.0, 170.0, 179.99, 200.0, 231.0, 260.0, 320.0}) {
    World world(weightless(), {chain(SurfaceMode::skin, false)});
    WorldData& d = world.data();
    shake(d, 4, 0.05, 0.002, 0);
    const Vector3d turn = degrees / 180 * std::numbers::pi * Vector3d(0.5, -0.7, 0.3).normalized();
    for (int i = 2; i < 5; ++i) {
      turnBy(d, i, 0.5 * turn);  // in two halves: which way round is the quaternions' to tell
      turnBy(d, i, 0.5 * turn);
    }
    ASSERT_NEAR(turnAgainstNext(d, 1), degrees / 180 * std::numbers::pi, 0.15);
    expectForcesAreMinusGradient(d, 2e-6);
  }
}

// Along and across a link, then turned about its line and across it: as often as stiff as the factors say, and what
// couples two of these by the geometric mean.
TEST(IdentifiedLink, EachWayItDeformsIsSteeredByItsOwnFactor) {
  BodyDescription body = chain(SurfaceMode::skin, true);
  const std::vector<IdentifiedLink>& links = body.model->identified->links;
  const std::vector<Matrix6d> plain = identifiedStiffness(body);
  body.steered = {{{2, 3, 5}}};
  const std::vector<Matrix6d> steered = identifiedStiffness(body);
  ASSERT_GE(plain.size(), 5u);
  const std::array<double, 6> factor{2, 3, 3, 5, 3, 3};
  for (std::size_t k = 0; k < plain.size(); ++k) {
    Matrix6d axes = Matrix6d::Zero();
    axes.topLeftCorner<3, 3>() = axes.bottomRightCorner<3, 3>() = links[k].axes;
    const Matrix6d before = axes * plain[k] * axes.transpose(), now = axes * steered[k] * axes.transpose();
    EXPECT_NEAR(links[k].axes.row(0).normalized().dot((links[k].restPoint1 - links[k].restPoint0).normalized()), 1,
                0.01);
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) {
        const double scale = std::sqrt(before(i, i) * before(j, j));
        EXPECT_NEAR(now(i, j), std::sqrt(factor[i] * factor[j]) * before(i, j), 1e-9 * scale) << i << ' ' << j;
      }
    }
  }
}

// Cells' means of a bar bent to an arc, turned by `angle` from cell to cell, its middle line longer as the section's
// flattening makes it: what the link between cells 1 and 2 measures along it, and what it would without its terms of
// second order, m.
static std::array<double, 2> elongationOfArc(double angle) {
  World world(weightless(), {chain(SurfaceMode::skin, false, 0, 0)});
  WorldData& d = world.data();
  const IdentifiedNetwork& n = *d.bodies[0].model->identified;
  std::vector<FrameState>& frames = d.identified.frames;
  const IdentifiedLinkGroup& link = d.identified.links[0];
  const double length = link.restLength[1], nu = n.poisson;
  for (const int i : {1, 2}) {
    const IdentifiedFrame& cell = n.frames[i];
    const double along = cell.secondMoment(0, 0) / cell.volume, kr2 = 4 * cell.secondMoment(1, 1) / cell.volume;
    const double curvature = angle / length, longer = 1 + 0.25 * (1 + nu) * kr2 * curvature * curvature;
    const double half = 0.5 * curvature * std::sqrt(12 * along);  // of the angle that the cell itself spans
    const double radius = longer / curvature * std::sin(half) / half, at = i * angle;
    frames[i].position = quadOf(Vector3d(radius * std::sin(at), -radius * std::cos(at), 0));
    frames[i].orientation = {{0, 0, std::sin(0.5 * at), std::cos(0.5 * at)}};
  }
  const LinkTurn m =
      measureLink(link, gatherFrames(frames.data(), link.frame0), gatherFrames(frames.data(), link.frame1));
  return {m.hyper[1], m.along[1]};
}

TEST(IdentifiedLink, BentWithoutAxialForceItFeelsNone) {
  const auto [once, onceLine] = elongationOfArc(0.05);
  const auto [twice, twiceLine] = elongationOfArc(0.1);
  EXPECT_NEAR(twiceLine / onceLine, 4, 0.05);
  EXPECT_LT(std::abs(once), 0.01 * std::abs(onceLine));
  EXPECT_NEAR(twice / once, 16, 1);
}

// Cells of 10 mm edge, `slender` of them in a chain, 10 mm apart, behind a clique of five. That is no row of cells.
IdentifiedNetwork chainBehindClique(int slender) {
  IdentifiedNetwork n;
  n.frames.resize(5 + slender);
  for (std::size_t i = 0; i < n.frames.size(); ++i) {
    IdentifiedFrame& cell = n.frames[i];
    cell.volume = 1e-6;
    cell.secondMoment = 1e-4 / 12 * cell.volume * Eigen::Matrix3d::Identity();
    const int row = int(i) / 2;
    cell.restPosition = 0.01 * (i < 5 ? Vector3d(0, int(i) % 2, row) : Vector3d(double(i) - 4, 0, 0));
  }
  const auto link = [&n](int a, int b) {
    IdentifiedLink l;
    l.frame0 = a, l.frame1 = b;
    l.restPoint0 = n.frames[a].restPosition, l.restPoint1 = n.frames[b].restPosition;
    n.links.push_back(l);
  };
  for (int a = 0; a < 5; ++a)
    for (int b = 0; b < a; ++b) link(b, a);
  for (int k = 0; k < slender; ++k) link(k == 0 ? 0 : 4 + k, 5 + k);
  return n;
}

TEST(IdentifiedLink, OfABarIsWhatTheNetworkHangsOn) {
  EXPECT_EQ(barsAmong(chainBehindClique(0)), std::vector<bool>(10, false));
  EXPECT_EQ(barsAmong(chainBehindClique(1)), std::vector<bool>(11, false)) << "no longer than thick";
  std::vector<bool> expected(10, false);
  expected.resize(13, true);
  EXPECT_EQ(barsAmong(chainBehindClique(3)), expected);
  // Held at both ends, it leads from what is held to what is held: no link of it is the only way.
  IdentifiedNetwork arch = chainBehindClique(3);
  for (const int end : {1, 7}) {
    arch.links.push_back(arch.links.back());
    arch.links.back().frame0 = end;
    arch.links.back().frame1 = 8;
  }
  EXPECT_EQ(barsAmong(arch), std::vector<bool>(15, false));
}

// Wound by more than 232 degrees a link would end a whole turn away from rest: the spheres behind it change their sign,
// which moves nothing. Below that they keep it: half a turn is no seam.
TEST(IdentifiedLink, TurnedTooFarLetsGoOfAWholeTurn) {
  for (const double degrees : {200.0, 231.0, 232.45, 300.0, 350.0}) {  // the ridge: 232.48
    World world(weightless(), {chain(SurfaceMode::skin, false)});
    WorldData& d = world.data();
    const Vector3d turn = degrees / 180 * std::numbers::pi * Vector3d::UnitX();
    for (int i = 2; i < 5; ++i) {
      turnBy(d, i, 0.5 * turn);
      turnBy(d, i, 0.5 * turn);
    }
    runStage(d, evaluateLinks);
    const double before = world.energies().elastic;
    dropCostlyTurns(d);
    EXPECT_TRUE(world.hasTurnedOver(0));
    const bool far = degrees > 232;
    EXPECT_NEAR(turnAgainstNext(d, 1), (far ? 360 - degrees : degrees) / 180 * std::numbers::pi, 1e-6) << degrees;
    EXPECT_NEAR(turnAgainstNext(d, 2), 0, 1e-6);
    runStage(d, evaluateLinks);
    if (far) {
      EXPECT_LT(world.energies().elastic, before) << degrees;
    }
  }
}

TEST(IdentifiedLink, WhatTurnsOverIsNoted) {
  for (const double degrees : {80.0, 95.0}) {
    World world(weightless(), {chain(SurfaceMode::skin, false)});
    for (int i = 2; i < 5; ++i) turnBy(world.data(), i, degrees / 180 * std::numbers::pi * Vector3d::UnitX());
    runStage(world.data(), evaluateLinks);
    EXPECT_FALSE(world.hasTurnedOver(0));
    world.advance({});
    EXPECT_EQ(world.hasTurnedOver(0), degrees > 90);
  }
}

TEST(IdentifiedSurface, ForcesOnNodesAndSpheresAreMinusTheEnergyGradient) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    World world(weightless(), {chain(SurfaceMode::full, true)});
    shake(world.data(), seed, seed <= 2 ? 0.2 : 0.7, 0.003, 0);
    expectForcesAreMinusGradient(world.data(), 1e-6);
  }
}

// Each node's attachment is damped by the relaxation time times what it resists with, along its normal and across.
TEST(IdentifiedSurface, DampersAreTheAttachmentsStiffnessTimesTheirRelaxation) {
  World world(weightless(), {chain(SurfaceMode::full, false, 0.2)});
  WorldData& d = world.data();
  ASSERT_FALSE(d.nodes.onSpheres.empty());
  const double relaxation = d.nodes.onSpheres[0].relaxation, far = 1e-4;
  ASSERT_GT(relaxation, 0);
  for (const int node : {d.ranges[0].node[30], d.ranges[0].node[47]}) {
    const Vector3d at = vectorAt(d.nodes.position, node), normal = vectorAt(d.nodes.area, node).normalized();
    for (const Vector3d& along : {normal, Vector3d(normal.unitOrthogonal())}) {
      setVector(d.nodes.position, node, at + far * along);
      runStage(d, evaluateForces);
      const double stiffness = d.nodes.groups[node / 4].stiffness[node % 4] + 2 * normalEnergy(d, node) / (far * far);
      setVector(d.nodes.position, node, at);
      setVector(d.nodes.velocity, node, along);  // 1 m/s
      runStage(d, evaluateForces);
      EXPECT_NEAR(vectorAt(d.nodes.force, node).dot(along), -relaxation * stiffness, 1e-6 * relaxation * stiffness);
      setVector(d.nodes.velocity, node, Vector3d::Zero());
    }
  }
}

// Where the definition (identified_network.h) puts a node.
static Vector3d defined(const WorldData& d, int node) {
  const SoftBodyModel& m = *d.bodies[0].model;
  const IdentifiedNetwork& n = *m.identified;
  const auto log = [](const Quaterniond& q) -> Vector3d {
    const Eigen::AngleAxisd a(q);
    return a.angle() * a.axis();
  };
  const auto exp = [](const Vector3d& w) { return Quaterniond(Eigen::AngleAxisd(w.norm(), w.normalized())); };
  const std::vector<SkinFrame>& skin = n.skin[node];
  std::vector<Vector3d> x;
  std::vector<Quaterniond> q;
  Vector3d mean = Vector3d::Zero(), restMean = mean, turn = mean;
  for (const SkinFrame& f : skin) {
    const Vector3d arm = n.frames[f.frame].restPosition - m.spheres[f.frame].restFrame;
    q.push_back(orientation(d, f.frame));
    x.push_back(vectorOf(d.spheres.position[f.frame]) + q.back() * arm);
    mean += f.weight * x.back();
    restMean += f.weight * f.restPoint;
    turn += f.weight * log(q[0].conjugate() * q.back());
  }
  const Quaterniond blend = q[0] * exp(turn);
  const Eigen::Matrix3d rotation = blend.toRotationMatrix();
  Vector3d offset = m.restNodes[node] - restMean;
  for (std::size_t k = 0; k < skin.size(); ++k) {
    Eigen::Matrix<double, 6, 1> z;
    z.head<3>() = rotation.transpose() * (x[k] - mean) - (skin[k].restPoint - restMean);
    z.tail<3>() = n.lengthScale * log(blend.conjugate() * q[k]);
    offset += skin[k].map * z;
  }
  return mean + rotation * offset;
}

// To first order in how far neighbours are turned whatever the maps, to second without or with isotropic ones.
TEST(IdentifiedSurface, NodesAreWhereTheDefinitionPutsThem) {
  for (const double uneven : {0.0, 0.3}) {
    const auto farthest = [&](double share) {
      World world(weightless(), {chain(SurfaceMode::skin, false, 0, uneven)});
      WorldData& d = world.data();
      shake(d, 6, share, 0.01 * share, 0);
      placeCarriedNodes(d);
      double most = 0;
      for (std::size_t i = 0; i < d.ranges[0].node.size(); ++i)
        most =
            std::max(most, (vectorAt(d.nodes.position, d.ranges[0].node[i]) - defined(d, static_cast<int>(i))).norm());
      return most;
    };
    const double coarse = farthest(0.1), fine = farthest(0.05);
    EXPECT_LT(coarse, uneven > 0 ? 3e-4 : 1e-5);  // of nodes 12 mm from the axis
    EXPECT_NEAR(std::log2(coarse / fine), uneven > 0 ? 2 : 3, 0.3);
  }
}

TEST(IdentifiedSurface, FollowsARigidMotionRigidly) {
  for (const SurfaceMode surface : {SurfaceMode::skin, SurfaceMode::full}) {
    World world(weightless(), {chain(surface, false)});
    WorldData& d = world.data();
    const Quaterniond q(Eigen::AngleAxisd(2.8, Vector3d(0.3, 0.5, -0.8).normalized()));
    const Vector3d shift(0.1, -0.2, 0.05);
    const SoftBodyModel& m = *d.bodies[0].model;
    for (int i = 0; i < d.spheres.count; ++i) {
      d.spheres.position[i] = quadOf(q * vectorOf(d.spheres.position[i]) + shift);
      setOrientation(d, i, q);
    }
    for (const int i : d.ranges[0].node) setVector(d.nodes.position, i, q * vectorAt(d.nodes.position, i) + shift);
    runStage(d, evaluateForces);
    placeCarriedNodes(d);
    for (std::size_t i = 0; i < m.restNodes.size(); ++i)
      EXPECT_LT((vectorAt(d.nodes.position, d.ranges[0].node[i]) - q * m.restNodes[i] - shift).norm(), 1e-15);
    EXPECT_LT(elastic(d), 1e-25);
    for (int i = 0; i < d.spheres.count; ++i) EXPECT_LT(vectorOf(d.spheres.force[i]).norm(), 1e-12);
  }
}

TEST(IdentifiedBody, MomentaOfAFreeBodyStayWhileItIsDamped) {
  for (const SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
    World world(weightless(), {chain(surface, false, 0.1)});
    expectMomentaStay(world);
  }
}

TEST(IdentifiedBody, EnergyOfAnUndampedBodyDoesNotDrift) {
  World world(weightless(400), {chain(SurfaceMode::full, false)});
  expectEnergyStays(world);
}

TEST(IdentifiedBody, DampingTakesEnergyInEveryFrame) {
  for (const SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
    World world(weightless(400), {chain(surface, true, 0.1)});
    expectEnergyIsTakenInEveryFrame(world);
  }
}

TEST(IdentifiedBody, StableAtTheEstimateAndUnstableWellAbove) {
  for (const SurfaceMode surface : {SurfaceMode::full, SurfaceMode::skin}) {
    const double stable = World(weightless(), {chain(surface, true)}).stableSubstep();
    const auto grows = [&](double step) {
      WorldSettings settings = weightless(100);
      settings.frameDuration = 100 * step;
      World world(settings, {chain(surface, true)});
      shake(world.data(), 2, 1e-4, 1e-6, 0);
      const double start = world.energies().elastic;
      try {
        for (int i = 0; i < 30; ++i) world.advance({});
      } catch (const std::runtime_error&) {
        return true;
      }
      const Energies e = world.energies();
      return e.kinetic + e.elastic > 100 * start;
    };
    EXPECT_FALSE(grows(0.95 * stable));
    EXPECT_TRUE(grows(1.1 * stable));
  }
}

// Stiffer along the surface's normal than across: carried nodes hang where moving ones come to rest, and what is held
// asks for nothing.
TEST(IdentifiedBody, CarriedNodesHangWhereMovingOnesRest) {
  BodyDescription body = chain(SurfaceMode::contact, true, 1, 0);
  const auto network = std::make_shared<IdentifiedNetwork>(*body.model->identified);
  network->layer.normal = 4 * network->layer.tangential;
  network->layer.membrane = 1e-6;  // carried nodes feel no edges
  const auto model = std::make_shared<SoftBodyModel>(*body.model);
  model->identified = network;
  body.model = model;
  DynamicsFrame frames[2];
  for (const SurfaceMode mode : {SurfaceMode::contact, SurfaceMode::full}) {
    body.surface = mode;
    WorldSettings settings;
    settings.gravity = {0, 0, -1};
    World world(settings, {body});
    for (int k = 0; k < 400; ++k) world.advance({});
    EXPECT_EQ(world.dynamicNodes(0) == 0, mode == SurfaceMode::contact);
    world.readFrame(frames[mode == SurfaceMode::full]);
  }
  double sag = 0, apart = 0;
  for (std::size_t i = 0; i < model->restNodes.size(); ++i) {
    const Vector3d& full = frames[1].bodies[0].nodes[i];
    sag = std::max(sag, (full - model->restNodes[i]).norm());
    apart = std::max(apart, (full - frames[0].bodies[0].nodes[i]).norm());
  }
  EXPECT_GT(sag, 1e-4);
  EXPECT_LT(apart, 0.02 * sag);
}

TEST(IdentifiedBody, NetworksThatCannotBeSimulatedAreRefused) {
  const auto messageOf = [](const std::function<void(IdentifiedNetwork&)>& spoil) -> std::string {
    BodyDescription body = chain(SurfaceMode::full, true);
    const auto network = std::make_shared<IdentifiedNetwork>(*body.model->identified);
    spoil(*network);
    const auto model = std::make_shared<SoftBodyModel>(*body.model);
    model->identified = network;
    body.model = model;
    return complaintOf([&] { World(weightless(), {body}); });
  };
  EXPECT_EQ(messageOf([](IdentifiedNetwork&) {}), "");
  EXPECT_NE(messageOf([](IdentifiedNetwork& n) { n.links[0].stiffness *= 1e300; }).find("not finite"),
            std::string::npos);
  EXPECT_NE(messageOf([](IdentifiedNetwork& n) { n.skin[3][1].frame = n.skin[3][0].frame; }).find("twice"),
            std::string::npos);
  EXPECT_NE(messageOf([](IdentifiedNetwork& n) {
              n.links[0].restPoint1 = n.links[0].restPoint0 + Vector3d(1e-200, 0, 0);
            }).find("lie in one point"),
            std::string::npos);
}

}  // namespace medulla
