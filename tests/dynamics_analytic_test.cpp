#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/dynamics/rest_modes.h"
#include "tests/dynamics_states.h"
#include "tests/synthetic_model.h"

// Answers known in closed form, predicted for the discretised body where it differs from the continuum.
namespace medulla {

using namespace states;

constexpr double kLength = 0.1, kRadius = 0.01, kYoung = 5e3, kDensity = 1000;
const double kArea = std::numbers::pi * kRadius * kRadius, kMoment = kArea * kRadius * kRadius / 4;

// A bar along x of `links` equal links, clamped at sphere 0, masses in the spheres, half cells at the ends.
static BodyDescription bar(int links, double damping, LinkModel linkModel) {
  auto model = synthetic::chainModel(synthetic::straightTube(links + 1, kLength, kRadius, 4 * links, 8));
  for (FillingSphere* s : {&model->spheres.front(), &model->spheres.back()}) {
    s->volume /= 2;
    s->secondMoment /= 2;
  }
  BodyDescription b = synthetic::body(model, kYoung, {{0, FixedFreedom::all}});
  b.surface = SurfaceMode::skin;
  b.links = linkModel;
  b.tissue.density = kDensity;
  b.tissue.damping = damping;
  return b;
}

static WorldSettings under(const Vector3d& gravity, int substeps = 0) {
  WorldSettings s;
  s.gravity = gravity;
  s.substeps = substeps;
  return s;
}

static Vector3d tip(const World& world) {
  return vectorOf(world.data().spheres.position[world.data().spheres.count - 1]);
}

static void settle(World& world, double seconds) {
  while (world.time() < seconds) world.advance({});
}

TEST(Analytic, AHangingChainStretchesLinkByLink) {
  constexpr int links = 6;
  constexpr double g = 9.81;
  World world(under({g, 0, 0}), {bar(links, 1, LinkModel::springs)});
  settle(world, 4);
  const double k = kYoung * kArea / (kLength / links), cell = kDensity * kArea * kLength / links;
  double expected = 0;
  for (int i = 0; i < links; ++i) {
    const double below = (links - i - 0.5) * cell;  // cells hanging on link i
    expected += kLength / links + below * g / k;
    EXPECT_NEAR(world.data().spheres.position[i + 1].v[0], expected, 1e-6 * expected) << "sphere " << i + 1;
  }
  // Continuum: rho g L^2 / 2E; the sum of half-cell weights is exactly that.
  EXPECT_NEAR(tip(world).x() - kLength, kDensity * g * kLength * kLength / (2 * kYoung), 1e-6);
}

TEST(Analytic, AnEndLoadStretchesABarLinkByLink) {
  for (int links : {1, 3, 6}) {
    BodyDescription body = bar(links, 1, LinkModel::springs);
    // The last ring hangs on the last link, the pole on the last sphere. Each link is a spring EA / l; what hangs at
    // `along` of the last link loads its far end by that share.
    const int pole = static_cast<int>(body.model->restNodes.size()) - 1;
    std::vector<int> nodes{pole};
    for (int k = 1; k <= 8; ++k) nodes.push_back(pole - k);
    DeadLoad whole;
    whole.force = {0.05, 0, 0};
    body.deadLoads = spreadLoad(*body.model, nodes, whole);
    double onLast = 0;
    for (const DeadLoad& load : body.deadLoads) {
      const Attachment& a = body.model->attachments[load.node];
      ASSERT_TRUE(a.onLink ? a.host == links - 1 : a.host == links);
      onLast += (a.onLink ? a.along : 1) * load.force.x();
    }
    World world(under(Vector3d::Zero()), {body});
    settle(world, 6);
    const double perLink = kLength / links / (kYoung * kArea);
    EXPECT_NEAR(tip(world).x() - kLength, ((links - 1) * whole.force.x() + onLast) * perLink, 1e-8) << links;
    EXPECT_LT(onLast, 0.999 * whole.force.x());
    EXPECT_GT(tip(world).x() - kLength, 0.001);
  }
}

// Deflection of the tip under weights at the spheres: bending angles M L / 2EI at either end of every link.
static double discreteTip(int links, const std::vector<double>& weight) {
  const double l = kLength / links;
  double turned = 0, deflection = 0;
  const auto momentAt = [&](int i) {
    double m = 0;
    for (int j = i + 1; j <= links; ++j) m += weight[j] * (j - i) * l;
    return m;
  };
  for (int i = 0; i < links; ++i) {
    turned += momentAt(i) * l / (2 * kYoung * kMoment);
    deflection += l * turned;
    turned += momentAt(i + 1) * l / (2 * kYoung * kMoment);
  }
  return deflection;
}

TEST(Analytic, ACantileverBendsLikeEulerBernoulli) {
  for (int links : {2, 4, 8}) {
    constexpr double g = 0.02;  // small: linear
    BodyDescription body = bar(links, 1, LinkModel::springs);
    World world(under({0, -g, 0}), {body});
    settle(world, 80);
    std::vector<double> weight, tipOnly(links + 1, 0);
    for (const FillingSphere& s : body.model->spheres) weight.push_back(kDensity * s.volume * g);
    tipOnly.back() = 1;
    EXPECT_NEAR(-tip(world).y(), discreteTip(links, weight), 2e-3 * discreteTip(links, weight)) << links;
    // The chain's own error: 1/N^2 of q L^4 / 8EI under its own weight, half of that of F L^3 / 3EI under an end load.
    const double error = 1.0 / (links * links);
    const double beam = kDensity * kArea * g * std::pow(kLength, 4) / (8 * kYoung * kMoment);
    EXPECT_NEAR(-tip(world).y() / beam, 1 + error, 4e-3) << links;
    EXPECT_NEAR(discreteTip(links, tipOnly) * 3 * kYoung * kMoment / std::pow(kLength, 3), 1 + error / 2, 1e-9)
        << links;
  }
}

// EA/3 (x - 1/x^2) = F on every link: neo-Hookean, incompressible.
TEST(Analytic, AHangingBeamStretchesAsRubberDoes) {
  constexpr int links = 6;
  constexpr double g = 200;  // stretches of up to 1.9
  World world(under({g, 0, 0}), {bar(links, 1, LinkModel::beam)});
  settle(world, 4);
  const double cell = kDensity * kArea * kLength / links;
  double expected = 0;
  for (int i = 0; i < links; ++i) {
    const double pull = (links - i - 0.5) * cell * g / (kYoung * kArea);
    double x = 1;
    for (int k = 0; k < 50; ++k) x -= ((x - 1 / (x * x)) / 3 - pull) / ((1 + 2 / (x * x * x)) / 3);
    expected += kLength / links * x;
    EXPECT_NEAR(world.data().spheres.position[i + 1].v[0], expected, 1e-6 * expected) << "sphere " << i + 1;
  }
}

// With coupled ends the chain is exact at its nodes: weights there bend it as they would the continuous beam.
TEST(Analytic, ABeamOfCoupledLinksIsExactAtItsNodes) {
  for (int links : {2, 4, 8}) {
    constexpr double g = 0.02;  // small: linear
    const BodyDescription body = bar(links, 1, LinkModel::beam);
    World world(under({0, -g, 0}), {body});
    settle(world, 80);
    const double shear = kYoung / (2 * (1 + body.tissue.poisson));
    double expected = 0;
    for (int i = 0; i <= links; ++i) {
      const double x = i * kLength / links, weight = kDensity * body.model->spheres[i].volume * g;
      expected += weight * x * x * (3 * kLength - x) / (6 * kYoung * kMoment) + weight * x / (0.9 * shear * kArea);
    }
    EXPECT_NEAR(-tip(world).y(), expected, 1e-3 * expected) << links;
  }
}

TEST(Analytic, ACoupleTwistsLinearlyThroughWholeTurns) {
  constexpr int links = 3;
  BodyDescription body = bar(links, 0, LinkModel::springs);
  World world(under(Vector3d::Zero()), {body});
  WorldData& d = world.data();
  const double perAngle = kYoung / (2 * (1 + body.tissue.poisson)) * 2 * kMoment / kLength;  // GJ/L
  for (int step = 1; step <= 96; ++step) {
    const double angle = step * std::numbers::pi / 12;  // up to four turns over the bar
    for (int i = 1; i <= links; ++i)
      setOrientation(d, i, Quaterniond(Eigen::AngleAxisd(angle * i / links, Vector3d::UnitX())));
    runStage(d, evaluateForces);
    EXPECT_NEAR(d.spheres.torque[links].v[0], -perAngle * angle, 1e-9 * perAngle * angle);
    EXPECT_NEAR(d.spheres.torque[1].v[0], 0, 1e-9 * perAngle * angle);
    EXPECT_LT(vectorOf(d.spheres.force[links]).norm(), 1e-9 * perAngle * angle / kLength);
  }
}

// Frequency (Hz) of a coordinate of the tip about zero, from the first and last upward crossing.
static double measuredFrequency(World& world, int axis, double zero, double seconds) {
  double first = -1, last = -1, before = tip(world)[axis] - zero;
  int periods = -1;
  while (world.time() < seconds) {
    const double t0 = world.time();
    world.advance({});
    const double now = tip(world)[axis] - zero;
    if (before < 0 && now >= 0) {
      last = t0 + (world.time() - t0) * before / (before - now);
      if (first < 0) first = last;
      ++periods;
    }
    before = now;
  }
  return periods / (last - first);
}

TEST(Analytic, FirstAxialFrequencyIsTheChains) {
  constexpr int links = 8;
  WorldSettings settings = under(Vector3d::Zero(), 10);
  settings.frameDuration = 0.002;
  World world(settings, {bar(links, 0, LinkModel::springs)});
  for (int i = 1; i <= links; ++i)  // its first mode
    world.data().spheres.velocity[i].v[0] = 0.01 * std::sin(std::numbers::pi * i / (2 * links));
  const double k = kYoung * kArea / (kLength / links), m = kDensity * kArea * kLength / links;
  const double chain = std::sqrt(k / m) * std::sin(std::numbers::pi / (4 * links)) / std::numbers::pi;
  const double continuum = std::sqrt(kYoung / kDensity) / (4 * kLength);
  const double measured = measuredFrequency(world, 0, kLength, 2);
  EXPECT_NEAR(measured, chain, 2e-3 * chain);
  EXPECT_NEAR(measured, continuum, 1e-2 * continuum);
}

TEST(Analytic, FirstBendingFrequencyIsTheBeams) {
  const double beam = 1.875104 * 1.875104 / (2 * std::numbers::pi) * std::sqrt(kYoung * kMoment / (kDensity * kArea)) /
                      (kLength * kLength);
  double error[2] = {1, 1};
  int n = 0;
  for (int links : {6, 12}) {
    BodyDescription body = bar(links, 0, LinkModel::springs);
    error[n++] = lowestFrequency(body, bodyMechanics(body)) / (2 * std::numbers::pi) / beam - 1;
  }
  EXPECT_LT(std::abs(error[0]), 0.06);  // lumped masses and 2EI/L: -4 % at 6 links
  EXPECT_LT(std::abs(error[1]), 0.4 * std::abs(error[0])) << "second order in the link length";
}

TEST(Analytic, TheLowestModeSwingsAndDecaysAsAsked) {
  constexpr int links = 4;
  constexpr double ratio = 0.05;
  BodyDescription body = bar(links, ratio, LinkModel::springs);
  const double frequency = lowestFrequency(body, bodyMechanics(body)) / (2 * std::numbers::pi);
  World world(under({0, -0.02, 0}), {body});
  settle(world, 20);  // bends; then let go
  const double sag = -tip(world).y();
  WorldData& d = world.data();
  d.gravity = {};
  double largest = 0, before = -sag;
  int half = 0;
  const double start = world.time();
  std::vector<double> swings, crossings;
  while (half < 7) {
    world.advance({});
    const double now = tip(world).y();
    if ((before < 0) != (now < 0)) {
      if (half > 0) swings.push_back(largest);
      crossings.push_back(world.time());
      largest = 0;
      ++half;
    }
    largest = std::max(largest, std::abs(now));
    before = now;
  }
  EXPECT_NEAR(2 * frequency * (crossings.back() - crossings.front()), half - 1, 0.15);
  EXPECT_LT(crossings.front() - start, 1 / frequency);
  const double decrement =
      std::log(swings.front() / swings.back()) / static_cast<double>(swings.size() - 1);  // per half swing
  EXPECT_NEAR(decrement / std::numbers::pi, ratio, 0.1 * ratio);
}

// Rayleigh's damping of a bar's twisting, in which no sphere's centre moves: spins are damped, too.
TEST(Analytic, TwistingDecaysAsMassAndStiffnessSay) {
  constexpr int links = 6;
  const BodyDescription body = bar(links, 0.3, LinkModel::springs);
  BodyMechanics mechanics = bodyMechanics(body);
  dampBody(body, mechanics, Integrator::explicitEuler);
  World world(under(Vector3d::Zero()), {body});
  for (int i = 1; i <= links; ++i)
    turnBy(world.data(), i, 0.2 * std::sin(0.5 * std::numbers::pi * i / links) * Vector3d::UnitX());
  runStage(world.data(), evaluateLinks);
  const double start = world.energies().elastic, shear = kYoung / (2 * (1 + body.tissue.poisson));
  settle(world, 1);
  const double omega = 0.5 * std::numbers::pi / kLength * std::sqrt(shear / kDensity);
  const double expected = mechanics.massDamping + mechanics.linkRelaxation * omega * omega;  // 1/s, of the energy
  const double measured = std::log(start / (world.energies().elastic + world.energies().kinetic));
  std::printf("[  reached ] twisting loses energy at %.3g / s, of which %.3g by stiffness; expected %.3g\n", measured,
              mechanics.linkRelaxation * omega * omega, expected);
  EXPECT_NEAR(measured, expected, 0.1 * expected);
}

TEST(Analytic, AFixedPointSwingsLikeAPendulum) {
  // Translation alone fixed: a stiff bar swings about its first sphere, T = 2 pi sqrt(I / m g l) for small angles.
  constexpr int links = 2;
  BodyDescription body = bar(links, 0, LinkModel::springs);
  body.tissue.young = 1e5;
  body.fixed = {{0, FixedFreedom::translation}};
  World world(under({9.81, 0, 0}), {body});
  WorldData& d = world.data();
  const Quaterniond lean(Eigen::AngleAxisd(0.02, Vector3d::UnitZ()));
  double inertiaSum = 0, weightMoment = 0;
  for (int i = 0; i <= links; ++i) {
    const double x = d.spheres.position[i].v[0];
    inertiaSum += inertia(d, i)(2, 2) + sphereMass(d, i) * x * x;
    weightMoment += sphereMass(d, i) * x * 9.81;
    d.spheres.position[i] = quadOf(lean * Vector3d(x, 0, 0));
    setOrientation(d, i, lean);
  }
  runStage(d, evaluateLinks);
  const double expected = std::sqrt(weightMoment / inertiaSum) / (2 * std::numbers::pi);
  EXPECT_NEAR(measuredFrequency(world, 1, 0, 6), expected, 0.01 * expected);
}

// Damping is of what deforms: stiff tissue swings on its pin as on a frictionless one, from lying to hanging and on.
TEST(Analytic, DampingLeavesAPendulumItsSwing) {
  constexpr int links = 4;
  BodyDescription body = bar(links, 0.1, LinkModel::beam);
  body.tissue.young = 1e6;
  const auto swings = [&] {
    World world(under({0, -9.81, 0}), {body});
    const WorldData& d = world.data();
    const double pin = body.fixedNodes.empty() ? 0 : body.model->restNodes[body.fixedNodes[0]].x();
    double expected = 0;  // J, from lying to hanging
    for (int i = 0; i < d.spheres.count; ++i) expected += 9.81 * sphereMass(d, i) * (d.spheres.position[i].v[0] - pin);
    for (int i = 0; i < d.nodes.dynamicEnd; ++i)
      expected += 9.81 * d.nodes.mass[i] * (vectorAt(d.nodes.position, i).x() - pin);
    double most = 0;
    for (int frame = 0; frame < 100; ++frame) {
      world.advance({});
      most = std::max(most, world.energies().kinetic);
    }
    EXPECT_NEAR(most, expected, 0.04 * expected);
  };
  body.fixed = {{0, FixedFreedom::translation}};
  swings();
  body.fixed = {};
  body.surface = SurfaceMode::full;
  body.fixedNodes = {0};  // the pole
  swings();
}

// What is held fast and what is driven to stay damp alike.
TEST(Analytic, ADrivenEndThatStaysDampsLikeAHeldOne) {
  const auto tipsOf = [](bool driven) {
    BodyDescription body = bar(4, 0.2, LinkModel::beam);
    body.tissue.young = 2e5;
    if (driven) {
      body.fixed = {};
      body.driven = {{.sphere = 0, .freedom = FixedFreedom::all}};
    }
    World world(under({0, -9.81, 0}), {body});
    std::vector<double> out;
    for (int frame = 0; frame < 50; ++frame) {
      world.advance({});
      out.push_back(tip(world).y());
    }
    return out;
  };
  const std::vector<double> held = tipsOf(false), driven = tipsOf(true);
  EXPECT_LT(*std::min_element(held.begin(), held.end()), 1.1 * held.back());  // it swings
  for (std::size_t k = 0; k < held.size(); ++k) EXPECT_NEAR(driven[k], held[k], 1e-3 * std::abs(held.back())) << k;
}

TEST(Analytic, TheStepConvergesAtFirstOrder) {
  const auto tipAfter = [](int substeps) {
    BodyDescription body = bar(4, 0.1, LinkModel::springs);
    body.surface = SurfaceMode::full;
    World world(under({0, -0.5, 0}, substeps), {body});
    settle(world, 0.2);
    return tip(world);
  };
  const Vector3d reference = tipAfter(2048);
  const double coarse = (tipAfter(64) - reference).norm(), fine = (tipAfter(128) - reference).norm();
  EXPECT_GT(coarse, 1e-9);
  EXPECT_NEAR(coarse / fine, 2, 0.3);
}

}  // namespace medulla
