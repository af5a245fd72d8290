#include "physics/dynamics/contact.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "physics/model/rotation_between.h"
#include "tests/contact_bodies.h"
#include "tests/dynamics_states.h"

namespace medulla {

using namespace states;
using synthetic::ball;
using synthetic::ballBody;
using synthetic::ballModel;
using synthetic::throwBody;

namespace {

constexpr double kBallRadius = 0.01, kGravity = 9.81;
constexpr double kOmegaTimesStep = std::numbers::pi;  // contact_solve.cpp

WorldSettings settings(ContactMode mode, double step, const Vector3d& gravity = Vector3d::Zero()) {
  WorldSettings s;
  s.contact = mode;
  s.gravity = gravity;
  s.frameDuration = step;
  s.substeps = 1;
  return s;
}

void advance(World& world, int steps) {
  for (int i = 0; i < steps; ++i) world.advance({});
}

Vector3d positionOf(const World& w, int sphere) {
  return vectorOf(w.data().spheres.position[sphere]);
}
Vector3d velocityOf(const World& w, int sphere) {
  return vectorOf(w.data().spheres.velocity[sphere]);
}

StaticShape plane(const Vector3d& normal = Vector3d::UnitY(), double friction = 0) {
  StaticShape s;
  s.worldFromShape.linear() = rotationBetween(Vector3d::UnitY(), normal).toRotationMatrix();
  s.friction = friction;
  return s;
}

// A little more than half a sphere about the origin, open at the top, its normals inward.
TriangleMesh bowlMesh(double radius) {
  constexpr int kRings = 16, kSegments = 40;
  TriangleMesh m;
  m.vertices.emplace_back(0, -radius, 0);
  for (int r = 1; r <= kRings; ++r) {
    for (int s = 0; s < kSegments; ++s) {
      const double polar = 1.9 * r / kRings, around = 2 * std::numbers::pi * s / kSegments;
      m.vertices.push_back(
          radius * Vector3d(std::sin(polar) * std::cos(around), -std::cos(polar), std::sin(polar) * std::sin(around)));
    }
  }
  const auto id = [](int ring, int s) { return 1 + (ring - 1) * kSegments + s % kSegments; };
  for (int s = 0; s < kSegments; ++s) {
    m.triangles.push_back({0, id(1, s + 1), id(1, s)});
    for (int r = 1; r < kRings; ++r) {
      m.triangles.push_back({id(r, s), id(r, s + 1), id(r + 1, s)});
      m.triangles.push_back({id(r, s + 1), id(r + 1, s + 1), id(r + 1, s)});
    }
  }
  return m;
}

}  // namespace

// k = m omega^2 carries m g: the depth is g / omega^2, whatever the mass.
TEST(Contact, ABallAtRestSinksInByItsWeightOverTheStiffness) {
  for (const double step : {0.001, 0.0005}) {
    World world(settings(ContactMode::balls, step, {0, -kGravity, 0}),
                {ball("a", kBallRadius, {0, 1.2 * kBallRadius, 0})}, {plane()});
    advance(world, static_cast<int>(0.5 / step));
    const double omega = kOmegaTimesStep / step, depth = kGravity / (omega * omega);
    EXPECT_NEAR(kBallRadius - positionOf(world, 0).y(), depth, 1e-6 * depth);
    EXPECT_LT(velocityOf(world, 0).norm(), 1e-12);
    EXPECT_EQ(world.penetration().bodies, 0);
  }
}

// On a full surface the spheres carry a small part of the mass: what counts is what they weigh together.
TEST(Contact, LightSpheresUnderAHeavySurfaceSinkInNoDeeper) {
  for (const double surfaceShare : {0.05, 0.9}) {
    BodyDescription tube =
        synthetic::body(synthetic::chainModel(synthetic::straightTube(3, 0.06, 0.012, 8, 10), surfaceShare), 5e3);
    tube.worldFromModel.translation() = Vector3d(0, 0.0121, 0);
    tube.tissue.damping = 0.5;
    WorldSettings s = settings(ContactMode::balls, 0.001, {0, -kGravity, 0});
    s.substeps = 4;
    World world(s, {tube}, {plane(Vector3d::UnitY(), 0.2)});
    advance(world, 2000);
    EXPECT_LT(world.penetration().statics, 0.5) << surfaceShare;
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(positionOf(world, i).y(), 0.012, 2e-5);
  }
}

TEST(Contact, ABallRollsOrSlidesDownAnIncline) {
  const double angle = 0.5, step = 0.0005, duration = 0.4;
  const Vector3d normal(std::sin(angle), std::cos(angle), 0), down(std::cos(angle), -std::sin(angle), 0);
  const double rollingFriction = 2.0 / 7 * std::tan(angle);  // the least that rolls without sliding
  for (const double friction : {0.5 * rollingFriction, 1.5 * rollingFriction}) {
    World world(settings(ContactMode::balls, step, {0, -kGravity, 0}),
                {ball("a", kBallRadius, kBallRadius * normal, 4 * friction)}, {plane(normal, 0.25 * friction)});
    advance(world, static_cast<int>(duration / step));
    const bool rolls = friction > rollingFriction;
    const double acceleration =
        rolls ? 5.0 / 7 * kGravity * std::sin(angle) : kGravity * (std::sin(angle) - friction * std::cos(angle));
    const double spin = rolls ? acceleration * duration / kBallRadius
                              : 2.5 * friction * kGravity * std::cos(angle) * duration / kBallRadius;
    EXPECT_NEAR(velocityOf(world, 0).dot(down), acceleration * duration, 2e-3 * acceleration * duration);
    EXPECT_NEAR(-vectorOf(world.data().spheres.angularVelocity[0]).z(), spin, 4e-3 * spin);
  }
}

// Heavy bodies' momenta are large numbers, and no sign of a step that diverges.
TEST(Contact, ABallOfTenMetresRollsOn) {
  const double radius = 5, angle = 0.1, duration = 1;
  const Vector3d normal(std::sin(angle), std::cos(angle), 0), down(std::cos(angle), -std::sin(angle), 0);
  World world(settings(ContactMode::balls, 0.002, {0, -kGravity, 0}), {ball("a", radius, radius * normal, 0.5)},
              {plane(normal, 0.5)});
  advance(world, 500);
  const double speed = 5.0 / 7 * kGravity * std::sin(angle) * duration;
  EXPECT_NEAR(velocityOf(world, 0).dot(down), speed, 2e-3 * speed);
  EXPECT_GT(world.data().spheres.angularMomentum[0].v[2], -1e9);
  EXPECT_LT(world.data().spheres.angularMomentum[0].v[2], -1e5);
}

// A body on three balls cannot roll.
TEST(Contact, ATripodSticksBelowTheFrictionAngleAndSlidesAbove) {
  const double friction = 0.4, step = 0.0005, duration = 0.5;
  const auto tripod =
      ballModel({{{0.02, 0, 0}, kBallRadius}, {{-0.01, 0, 0.0175}, kBallRadius}, {{-0.01, 0, -0.0175}, kBallRadius}},
                {{0, 1}, {1, 2}, {2, 0}});
  for (const double angle : {0.8 * std::atan(friction), 1.3 * std::atan(friction)}) {
    const Vector3d normal(std::sin(angle), std::cos(angle), 0), down(std::cos(angle), -std::sin(angle), 0);
    BodyDescription body = ballBody("a", tripod, kBallRadius * normal, friction);
    body.worldFromModel.linear() = plane(normal).worldFromShape.linear();
    body.tissue.damping = 1;
    World world(settings(ContactMode::balls, step, {0, -kGravity, 0}), {body}, {plane(normal, friction)});
    ASSERT_LT(step, world.stableSubstep());
    const auto meanVelocity = [&world]() -> Vector3d {
      return (velocityOf(world, 0) + velocityOf(world, 1) + velocityOf(world, 2)) / 3;
    };
    // The balls first roll as far as the links between them let them; then they slide.
    advance(world, static_cast<int>(0.5 * duration / step));
    const Vector3d before = meanVelocity();
    advance(world, static_cast<int>(0.5 * duration / step));
    const double acceleration = kGravity * (std::sin(angle) - friction * std::cos(angle));
    const Vector3d velocity = meanVelocity();
    if (acceleration < 0) {
      EXPECT_LT(velocity.norm(), 1e-5);
    } else {
      const double expected = 0.5 * acceleration * duration;
      EXPECT_NEAR((velocity - before).dot(down), expected, 0.01 * expected);
    }
  }
}

// Plates of balls, each ball on that of the plate below, well inside of the friction angle, beside a ball of 33 kg:
// what is left unsettled in light contacts, if measured by heavy ones, lets the stack creep down.
TEST(Contact, AStackOnASlopeDoesNotCreep) {
  constexpr int kPlates = 4, kRow = 4;
  std::vector<synthetic::BallAndRadius> balls;
  std::vector<std::pair<int, int>> links;
  for (int i = 0; i < kRow; ++i)
    for (int j = 0; j < kRow; ++j) {
      balls.push_back({{0.02 * (i - 1.5), 0, 0.02 * (j - 1.5)}, kBallRadius});
      if (i > 0) links.emplace_back(kRow * (i - 1) + j, kRow * i + j);
      if (j > 0) links.emplace_back(kRow * i + j - 1, kRow * i + j);
    }
  const auto plate = ballModel(balls, links);
  std::vector<BodyDescription> bodies;
  for (int k = 0; k < kPlates; ++k) {
    bodies.push_back(ballBody(std::to_string(k), plate, {0, (2 * k + 1) * kBallRadius, 0}, 0.4));
    bodies.back().tissue.young = 1e5;
    bodies.back().tissue.damping = 0.5;
  }
  bodies.push_back(ball("heavy", 0.2, {0, 0.2, 1}, 0.4));
  bodies.back().tissue.young = 1e6;
  const double angle = 0.25;
  World world(settings(ContactMode::balls, 2e-4, kGravity * Vector3d(std::sin(angle), -std::cos(angle), 0)), bodies,
              {plane(Vector3d::UnitY(), 0.4)});
  ASSERT_LT(2e-4, world.stableSubstep());
  const int top = kRow * kRow * (kPlates - 1) + kRow + 1;
  advance(world, 2500);
  const Vector3d before = positionOf(world, top);
  advance(world, 2500);
  EXPECT_LT((positionOf(world, top) - before).norm(), 1e-4);
}

// Two balls meet head on. Their relative velocity follows the step's own recursion: not past touching in the substep
// where they meet, then the implicit spring until it would pull.
TEST(Contact, TwoBallsCollideAsTheRecursionSays) {
  const double step = 0.001;
  World world(settings(ContactMode::balls, step),
              {ball("a", kBallRadius, {-0.0153, 0, 0}), ball("b", 0.5 * kBallRadius, {0.01, 0, 0})});
  const double m0 = sphereMass(world.data(), 0), m1 = sphereMass(world.data(), 1);
  throwBody(world, 0, {0.6, 0, 0});
  throwBody(world, 1, {-0.4, 0, 0});
  const double common = (0.6 * m0 - 0.4 * m1) / (m0 + m1);
  double v = -1, gap = 0.0253 - 1.5 * kBallRadius, deepest = 0;
  const double w2 = kOmegaTimesStep * kOmegaTimesStep / (step * step), c = 2 * kOmegaTimesStep / step;
  for (int i = 0; i < 40; ++i) {
    world.advance({});
    if (gap > 0) {
      v = std::max(v, -gap / step);
    } else {
      v = std::max(v, (v - step * w2 * gap) / (1 + step * c + step * step * w2));
    }
    gap += step * v;
    deepest = std::max(deepest, -gap);
    const double velocity0 = velocityOf(world, 0).x(), velocity1 = velocityOf(world, 1).x();
    EXPECT_NEAR(velocity1 - velocity0, v, 1e-9);
    EXPECT_NEAR(m0 * velocity0 + m1 * velocity1, common * (m0 + m1), 1e-15);
  }
  EXPECT_GT(v, 0);
  EXPECT_LT(v, 0.1);  // restitution
  EXPECT_LT(deepest, 0.001);
}

// Many bodies thrown together, spinning: neither momentum changes, friction included, in either mode.
TEST(Contact, MomentaStayWhileBodiesCollide) {
  const auto stick = ballModel({{{0, 0, 0}, 0.012}, {{0.03, 0, 0}, 0.008}, {{0.06, 0.01, 0}, 0.01}}, {{0, 1}, {1, 2}});
  auto offCentre = std::make_shared<SoftBodyModel>(*stick);
  for (FillingSphere& s : offCentre->spheres) s.restBallCentre += Vector3d(0.002, -0.003, 0.001);
  for (const ContactMode mode : {ContactMode::balls, ContactMode::swept}) {
    std::vector<BodyDescription> bodies;
    bodies.reserve(12);
    for (int i = 0; i < 12; ++i) {
      const int row = i / 3 % 2, layer = i / 6;
      bodies.push_back(ballBody("b", i % 2 ? stick : offCentre, 0.04 * Vector3d(i % 3, row, layer), 0.5));
    }
    WorldSettings s = settings(mode, 0.001);
    s.substeps = 2;
    World world(s, bodies);
    Random random(7);
    for (int b = 0; b < 12; ++b)
      throwBody(world, b,
                0.5 * random.vector() - 8 * (bodies[b].worldFromModel.translation() - Vector3d(0.04, 0.02, 0.02)));
    const Momentum before = momentum(world.data());
    std::size_t touching = 0;
    for (int i = 0; i < 300; ++i) {
      world.advance({});
      touching += world.data().contact.carried.size();
    }
    const Momentum after = momentum(world.data());
    EXPECT_GT(touching, 300u);
    EXPECT_LT((after.linear - before.linear).norm(), 1e-12 * before.linearScale);
    EXPECT_LT((after.angular - before.angular).norm(), 1e-12 * before.angularScale);
    EXPECT_LT(world.energies().kinetic, 1);
  }
}

TEST(Contact, ABodyThatStartsInsideAStaticShapeIsReported) {
  const auto overlapAt = [](double height) {
    const StaticShape floor;
    return World(settings(ContactMode::balls, 0.001), {ball("a", kBallRadius, {0, height, 0})}, {floor})
        .startOverlaps();
  };
  EXPECT_TRUE(overlapAt(1.1 * kBallRadius).empty());
  EXPECT_TRUE(overlapAt(0.999 * kBallRadius).empty());  // as what rests does
  for (const double height : {0.5 * kBallRadius, -3 * kBallRadius}) {
    const std::vector<BodyOverlap> found = overlapAt(height);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].body0, 0);
    EXPECT_EQ(found[0].body1, -1);
    EXPECT_NEAR(found[0].depth, kBallRadius - height, 1e-12);
  }
}

// A tube that lies 1 mm deep in a floor, or in a ceiling that is a mesh: glued there, by an end, or not at all.
TEST(Contact, WhatIsFixedToAStaticShapeDoesNotStandOnIt) {
  const std::shared_ptr<SoftBodyModel> tube = synthetic::shortTube();
  const double radius = 0.012;
  StaticShape floor, ceiling;
  floor.worldFromShape.translation().y() = 0.001 - radius;
  ceiling.kind = StaticShape::Kind::mesh;
  ceiling.mesh = {{{-1, radius - 0.001, -1}, {1, radius - 0.001, -1}, {0, radius - 0.001, 1}}, {{0, 1, 2}}};
  const auto worldWith = [&](const StaticShape& shape, const std::function<bool(const Vector3d&)>& isHeld) {
    BodyDescription b = ballBody("tube", tube, Vector3d::Zero());
    for (std::size_t n = 0; n < tube->restNodes.size(); ++n)
      if (isHeld(tube->restNodes[n])) b.fixedNodes.push_back(int(n));
    World world(settings(ContactMode::balls, 0.001), {b}, {shape});
    world.advance({});
    return world;
  };
  for (const int side : {-1, 1}) {
    const StaticShape& shape = side < 0 ? floor : ceiling;
    const auto isGlued = [&](const Vector3d& x) { return side * x.y() > -0.001; };
    const World glued = worldWith(shape, isGlued);
    EXPECT_TRUE(glued.startOverlaps().empty());
    EXPECT_EQ(glued.penetration().statics, 0);
    // What is glued elsewhere, or not at all, stands on it.
    for (const double middle : {0.0, 0.04, 1.0}) {
      const World elsewhere =
          worldWith(shape, [&](const Vector3d& x) { return isGlued(x) && std::abs(x.x() - middle) < 0.011; });
      ASSERT_EQ(elsewhere.startOverlaps().size(), 1u) << middle;
      EXPECT_NEAR(elsewhere.startOverlaps()[0].depth, 0.001, 1e-9);
      EXPECT_GT(elsewhere.penetration().statics, 5);
    }
  }
  // Half a millimetre in the wall of a mesh to whose ceiling it is glued.
  const double wall = 0.08 + radius - 0.0005;
  ceiling.mesh.vertices.insert(ceiling.mesh.vertices.end(), {{wall, -1, -1}, {wall, 1, -1}, {wall, 0, 1}});
  ceiling.mesh.triangles.push_back({3, 5, 4});
  const World inWall = worldWith(ceiling, [&](const Vector3d& x) { return x.y() > -0.001; });
  ASSERT_EQ(inWall.startOverlaps().size(), 1u);
  EXPECT_NEAR(inWall.startOverlaps()[0].depth, 0.0005, 1e-9);
}

TEST(Contact, OverlapAtTheStartIsReportedAndPushedOutSlowly) {
  World world(
      settings(ContactMode::balls, 0.001),
      {ball("a", kBallRadius, {0, 0, 0}), ball("b", kBallRadius, {0.013, 0, 0}), ball("c", kBallRadius, {0, 0.05, 0})});
  ASSERT_EQ(world.startOverlaps().size(), 1u);
  EXPECT_EQ(world.startOverlaps()[0].body0, 0);
  EXPECT_EQ(world.startOverlaps()[0].body1, 1);
  EXPECT_NEAR(world.startOverlaps()[0].depth, 0.007, 1e-15);
  double fastest = 0;
  for (int i = 0; i < 300; ++i) {
    world.advance({});
    fastest = std::max(fastest, (velocityOf(world, 0) - velocityOf(world, 1)).norm());
  }
  EXPECT_LT(fastest, 0.2 + 1e-9);
  EXPECT_GT((positionOf(world, 1) - positionOf(world, 0)).norm(), 2 * kBallRadius - 1e-6);
  EXPECT_NEAR(world.penetration().bodies, 70, 1e-9);
}

// Those linked or overlapping at rest leave each other alone.
TEST(Contact, WhatOverlapsAtRestNeverMeets) {
  for (const ContactMode mode : {ContactMode::balls, ContactMode::swept}) {
    World world(settings(mode, 0.0005),
                {synthetic::body(synthetic::chainModel(synthetic::straightTube(7, 0.06, 0.012, 8, 10)), 2e3)});
    advance(world, 50);
    EXPECT_EQ(world.penetration().bodies, 0);
    EXPECT_TRUE(world.data().contact.carried.empty());
    EXPECT_NEAR(positionOf(world, 6).x(), 0.06, 1e-12);
  }
}

// Two far ends of one body, thrown at each other.
TEST(Contact, ABodyMeetsItself) {
  const auto arch = ballModel({{{-0.03, 0, 0}, kBallRadius},
                               {{-0.03, 0.03, 0}, kBallRadius},
                               {{0.03, 0.03, 0}, kBallRadius},
                               {{0.03, 0, 0}, kBallRadius}},
                              {{0, 1}, {1, 2}, {2, 3}});
  for (const ContactMode mode : {ContactMode::none, ContactMode::balls, ContactMode::swept}) {
    BodyDescription body = ballBody("a", arch, Vector3d::Zero());
    body.tissue.young = 200;
    World world(settings(mode, 0.001), {body});
    world.data().spheres.velocity[0] = quadOf({0.5, 0, 0});
    world.data().spheres.velocity[3] = quadOf({-0.5, 0, 0});
    double least = 1;
    for (int i = 0; i < 100; ++i) {
      world.advance({});
      least = std::min(least, (positionOf(world, 0) - positionOf(world, 3)).norm());
    }
    if (mode == ContactMode::none) {
      EXPECT_LT(least, 1.5 * kBallRadius);
    } else {
      EXPECT_GT(least, 1.95 * kBallRadius);
    }
  }
}

TEST(Contact, NeighboursLimitWhoMeets) {
  const auto meet = [](std::optional<std::vector<int>> of0, std::optional<std::vector<int>> of1) {
    std::vector<BodyDescription> bodies{ball("a", kBallRadius, {0, 0, 0}), ball("b", kBallRadius, {0.03, 0, 0}),
                                        ball("c", kBallRadius, {0, 1, 0})};
    bodies[0].neighbours = std::move(of0);
    bodies[1].neighbours = std::move(of1);
    World world(settings(ContactMode::balls, 0.001), bodies);
    throwBody(world, 1, {-0.5, 0, 0});
    advance(world, 40);
    return velocityOf(world, 0).norm() > 0;
  };
  using List = std::vector<int>;
  EXPECT_TRUE(meet({}, {}));
  EXPECT_TRUE(meet(List{1}, {}));
  EXPECT_TRUE(meet({}, List{0}));
  EXPECT_FALSE(meet(List{2}, {}));
  EXPECT_TRUE(meet(List{2}, List{0}));
  EXPECT_FALSE(meet(List{2}, List{2}));
}

// As the paper's dolphin (3): the gap between two linked spheres lets a small body through unless links are swept.
TEST(Contact, AGapBetweenSpheresIsClosedBySweptLinks) {
  const auto pair = ballModel({{{-0.02, 0, 0}, 0.01}, {{0.02, 0, 0}, 0.01}}, {{0, 1}});
  for (const ContactMode mode : {ContactMode::balls, ContactMode::swept}) {
    BodyDescription target = ballBody("pair", pair, Vector3d::Zero());
    target.fixed = {{0}, {1}};
    World world(settings(mode, 0.001), {target, ball("small", 0.005, {0.001, 0.05, 0})});
    throwBody(world, 1, {0, -1, 0});
    advance(world, 100);
    const double y = positionOf(world, 2).y();
    if (mode == ContactMode::balls) {
      EXPECT_NEAR(y, -0.05, 1e-9);
    } else {
      EXPECT_GT(y, 0.014);
      EXPECT_LT(world.penetration().bodies, 5);
    }
  }
}

// At 1 m/s nothing passes, and nothing sinks in by more than a tenth of its radius.
TEST(Contact, NothingPassesAtAMetrePerSecond) {
  const auto stick = ballModel({{{-0.02, 0, 0}, 0.008}, {{0.02, 0, 0}, 0.006}}, {{0, 1}});
  for (const Vector3d& place : {Vector3d(0, 0, 0), Vector3d(0.01, 0, 0.003), Vector3d(-0.02, 0, 0.002)}) {
    BodyDescription target = ballBody("target", stick, Vector3d::Zero());
    target.fixed = {{0}, {1}};
    BodyDescription thrown = ballBody("thrown", stick, place + Vector3d(0, 0.05, 0));
    thrown.worldFromModel.linear() = Eigen::AngleAxisd(1.2, Vector3d::UnitY()).toRotationMatrix();
    World world(settings(ContactMode::swept, 0.001), {target, thrown});
    throwBody(world, 1, {0, -1, 0});
    advance(world, 60);
    EXPECT_LT(world.penetration().bodies, 10);
    EXPECT_GT(0.5 * (positionOf(world, 2) + positionOf(world, 3)).y(), 0);
  }
}

// A single ball gives nowhere: a substep is a frame, in which it falls farther than what it meets is thick.
TEST(Contact, AFastBallPassesNothingInLongSubsteps) {
  StaticShape box;
  box.kind = StaticShape::Kind::box;
  box.size = {1, 0.01, 1};
  for (const double speed : {1.0, 6.0, 20.0}) {
    World onBox(settings(ContactMode::balls, 0.02), {ball("thrown", 0.02, {0, 1.7, 0})}, {box});
    BodyDescription held = ball("held", 0.02, Vector3d::Zero());
    held.fixed = {{0}};
    World onBall(settings(ContactMode::balls, 0.02), {held, ball("thrown", 0.02, {0, 1.7, 0})});
    throwBody(onBox, 0, {0, -speed, 0});
    throwBody(onBall, 1, {0, -speed, 0});
    advance(onBox, 100);
    advance(onBall, 100);
    EXPECT_GT(std::min(positionOf(onBox, 0).y(), positionOf(onBall, 1).y()), 0) << speed;
    EXPECT_LT(std::max(onBox.penetration().statics, onBall.penetration().bodies), 10) << speed;
  }
}

// Rods and lumps fall into a bowl. Nothing drives them there: each contact takes energy, and so does every link.
TEST(Contact, AHeapInABowlComesToRest) {
  StaticShape bowl;
  bowl.kind = StaticShape::Kind::mesh;
  bowl.mesh = bowlMesh(0.12);
  const auto rod = synthetic::chainModel(synthetic::straightTube(4, 0.06, 0.012, 8, 10)),
             lump = synthetic::chainModel(synthetic::straightTube(2, 0.014, 0.014, 8, 10));
  for (const ContactMode mode : {ContactMode::balls, ContactMode::swept}) {
    std::vector<BodyDescription> bodies;
    Random random(5);
    for (int k = 0; k < 4; ++k) {
      BodyDescription& b = bodies.emplace_back(synthetic::body(k % 3 == 2 ? lump : rod, 5e3));
      b.tissue.damping = 0.3;
      b.surface = SurfaceMode::skin;
      b.worldFromModel.translation() = Vector3d(-0.03, -0.05 + 0.06 * k, 0.02 * random.uniform());
      b.worldFromModel.linear() = Eigen::AngleAxisd(0.5 * random.uniform(), Vector3d::UnitY()).toRotationMatrix();
    }
    WorldSettings s = settings(mode, 0.02, {0, -kGravity, 0});
    s.substeps = 20;
    World world(s, bodies, {bowl});
    ASSERT_TRUE(world.startOverlaps().empty());
    double peak = 0;
    for (int k = 0; k < 150; ++k) {
      world.advance({});
      peak = std::max(peak, world.energies().kinetic);
    }
    EXPECT_LT(world.energies().kinetic, 1e-6 * peak);
    EXPECT_LT(world.penetration().bodies, 10);
    EXPECT_LT(world.penetration().statics, 10);
  }
}

TEST(Contact, TheSameRunTwiceHasTheSameHashAndImpulsesAreInIt) {
  std::uint64_t hash[2];
  for (std::uint64_t& h : hash) {
    World world(settings(ContactMode::swept, 0.001, {0, -kGravity, 0}),
                {ball("a", kBallRadius, {0, 0.011, 0}, 0.3), ball("b", kBallRadius, {0.004, 0.032, 0.001}, 0.3)},
                {plane()});
    advance(world, 400);
    h = world.stateHash();
    ASSERT_FALSE(world.data().contact.carried.empty());
    world.data().contact.carried[0].impulse.v[1] += 1e-9;
    EXPECT_NE(world.stateHash(), h);
  }
  EXPECT_EQ(hash[0], hash[1]);
}

}  // namespace medulla
