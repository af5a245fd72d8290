#include "physics/dynamics/contact_geometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/dynamics/broad_phase.h"
#include "physics/dynamics/contact_stages.h"
#include "tests/contact_bodies.h"
#include "tests/dynamics_states.h"
#include "tests/touch_shapes.h"

namespace medulla {

using namespace states;

namespace {

struct Cone {
  Vector3d centre0, centre1;
  double radius0, radius1;
};

double gapAt(const Cone& p, const Cone& q, double s, double t) {
  return ((q.centre0 + t * (q.centre1 - q.centre0)) - (p.centre0 + s * (p.centre1 - p.centre0))).norm() -
         (p.radius0 + s * (p.radius1 - p.radius0)) - (q.radius0 + t * (q.radius1 - q.radius0));
}

// The least gap by nested golden sections: the function is convex.
template <class F>
double leastOf(const F& f) {
  double a = 0, b = 1;
  for (int k = 0; k < 60; ++k) {
    const double x = a + 0.382 * (b - a), y = a + 0.618 * (b - a);
    (f(x) < f(y) ? b : a) = f(x) < f(y) ? y : x;
  }
  return std::min({f(0.5 * (a + b)), f(0.0), f(1.0)});
}

BallLanes ballLanes(const Vector3d& c, double r) {
  return {{splat(c.x()), splat(c.y()), splat(c.z())}, splat(r)};
}
ConeContact closest(const Cone& p, const Cone& q) {
  return closestOnCones(ballLanes(p.centre0, p.radius0), ballLanes(p.centre1, p.radius1),
                        ballLanes(q.centre0, q.radius0), ballLanes(q.centre1, q.radius1));
}

}  // namespace

TEST(Cones, ClosestPointsAreThoseOfASearch) {
  Random random(3);
  double largest = 0;
  for (int k = 0; k < 2000; ++k) {
    Cone p{0.03 * random.vector(), 0.03 * random.vector(), 0.01 + 0.004 * random.uniform(),
           0.01 + 0.004 * random.uniform()};
    Cone q{0.03 * random.vector(), 0.03 * random.vector(), 0.01 + 0.004 * random.uniform(),
           0.01 + 0.004 * random.uniform()};
    if (k % 4 == 1) q.centre1 = q.centre0, q.radius1 = q.radius0;                  // a ball
    if (k % 4 == 2) q.centre1 = q.centre0 + (p.centre1 - p.centre0) * (1 + 1e-9);  // parallel
    const ConeContact c = closest(p, q);
    ASSERT_TRUE(c.s[0] >= 0 && c.s[0] <= 1 && c.t[0] >= 0 && c.t[0] <= 1);
    EXPECT_NEAR(c.gap[0], gapAt(p, q, c.s[0], c.t[0]), 1e-8);
    const double least = leastOf([&](double s) { return leastOf([&](double t) { return gapAt(p, q, s, t); }); });
    if (least < -0.015) continue;  // axes that all but cross have no normal
    const double lengths = (p.centre1 - p.centre0).squaredNorm() + (q.centre1 - q.centre0).squaredNorm();
    EXPECT_GE(c.gap[0], least - 1e-9);
    EXPECT_LE(c.gap[0], least + kMiddlePull * lengths / (8 * 0.005)) << k;
    largest = std::max(largest, c.gap[0] - least);
  }
  EXPECT_LT(largest, 1e-4);
}

TEST(Cones, SideBySideTheyMeetInTheMiddle) {
  const Cone p{{0, 0, 0}, {0.03, 0, 0}, 0.01, 0.01}, q{{0.03, 0.02, 0}, {0, 0.02, 0}, 0.01, 0.01};
  EXPECT_NEAR(closest(p, q).s[0], 0.5, 1e-9);
  EXPECT_NEAR(closest(p, q).t[0], 0.5, 1e-9);
  EXPECT_NEAR(closest(p, q).gap[0], 0, 1e-12);
}

TEST(Cones, CrossProductsOfWholeRegisters) {
  const Lanes a{1, 2, 3, 0}, b{-2, 0.5, 4, 0}, c = crossProduct(a, b);
  EXPECT_EQ(c[0], 2 * 4 - 3 * 0.5);
  EXPECT_EQ(c[1], 3 * -2 - 1 * 4.0);
  EXPECT_EQ(c[2], 1 * 0.5 - 2 * -2);
  EXPECT_EQ(c[3], 0);
}

TEST(BroadPhase, FindsEveryPairOnceInOrder) {
  Random random(11);
  for (const int count : {0, 1, 2, 50, 700}) {
    std::vector<AxisBox> boxes;
    for (int k = 0; k < count; ++k) {
      const Vector3d c = 0.2 * random.vector();
      const double size = (k % 17 == 0 ? 0.08 : 0.012) * (1.1 + random.uniform());  // large ones among small ones
      boxes.push_back({{c.x() - size, c.y() - size, c.z() - size}, {c.x() + size, c.y() + 2 * size, c.z() + size}});
    }
    BroadPhase phase;
    findOverlaps(boxes, phase);
    std::size_t at = 0;
    for (int i = 0; i < count; ++i) {
      for (int j = i + 1; j < count; ++j) {
        bool overlap = true;
        for (int a = 0; a < 3; ++a)
          overlap = overlap && boxes[i].low.v[a] <= boxes[j].high.v[a] && boxes[j].low.v[a] <= boxes[i].high.v[a];
        if (!overlap) continue;
        ASSERT_LT(at, phase.pairs.size());
        ASSERT_EQ(phase.pairs[at].first, static_cast<std::uint32_t>(i));
        ASSERT_EQ(phase.pairs[at].second, static_cast<std::uint32_t>(j));
        ++at;
      }
    }
    EXPECT_EQ(at, phase.pairs.size());
  }
}

// Sticks that fly to and fro through each other, some of them far faster than the rest: lists that outlive many
// substeps find the contacts that lists made anew for each find.
TEST(NeighbourLists, FindWhatListsMadeAnewFind) {
  const auto stick = synthetic::ballModel({{{0, 0, 0}, 0.012}, {{0.03, 0, 0}, 0.008}}, {{0, 1}});
  for (const ContactMode mode : {ContactMode::balls, ContactMode::swept}) {
    WorldSettings settings;
    settings.contact = mode;
    settings.frameDuration = 0.001;
    settings.substeps = 1;
    Random random(3);
    std::vector<BodyDescription> bodies;
    std::vector<Vector3d> velocities;
    for (int b = 0; b < 150; ++b) {
      bodies.push_back(synthetic::ballBody("b", stick, 0.1 * random.vector()));
      velocities.push_back((b % 10 ? 2e-4 : 1e-3) * random.vector());
    }
    World kept(settings, bodies, {StaticShape{}}), anew(settings, bodies, {StaticShape{}});
    std::size_t found = 0, listed = 0;
    for (int step = 0; step < 400; ++step) {
      for (int b = 0; b < 150; ++b) {
        const Vector3d move = (step / 50 % 2 ? -1 : 1) * velocities[b];
        for (World* w : {&kept, &anew})
          for (int k = 0; k < 2; ++k) {
            Quad& position = w->data().spheres.position[w->data().ranges[b].firstSphere + k];
            position = quadOf(vectorOf(position) + move);
          }
      }
      const Quad before = kept.data().contact.ballAtList[0];
      anew.data().contact.listsAreOld = true;
      findContacts(kept.data());
      findContacts(anew.data());
      listed += kept.data().contact.ballAtList[0].v[0] != before.v[0];
      const auto keys = [](const World& w) {
        std::vector<std::uint64_t> all;
        for (const Contact& c : w.data().contact.contacts) all.push_back(c.key);
        return all;
      };
      ASSERT_EQ(keys(kept), keys(anew)) << step;
      found += kept.data().contact.contacts.size();
    }
    EXPECT_GT(found, 40000u);
    EXPECT_LT(listed, 350u);
  }
}

TEST(BroadPhase, AStateThatIsNoNumberHasNoPairs) {
  BroadPhase phase;
  for (const double bad : {std::nan(""), 1e300, std::numeric_limits<double>::infinity()}) {
    findOverlaps({{{0, 0, 0}, {1, 1, 1}}, {{0, 0, 0}, {1, bad, 1}}}, phase);
    EXPECT_TRUE(phase.pairs.empty());
  }
}

namespace {

// Where a ball thrown at a shape comes to rest, per shape; gravity along `down`.
Vector3d restingPlace(const StaticShape& shape, const Vector3d& from, const Vector3d& down, int steps = 3000) {
  WorldSettings s;
  s.contact = ContactMode::balls;
  s.gravity = 9.81 * down;
  s.frameDuration = 0.001;
  s.substeps = 1;
  World world(s, {synthetic::ball("a", 0.01, from, 1)}, {shape});
  for (int k = 0; k < steps; ++k) world.advance({});
  EXPECT_LT(world.penetration().statics, 10);
  return vectorOf(world.data().spheres.position[0]);
}

StaticShape shapeOf(StaticShape::Kind kind) {
  StaticShape s;
  s.kind = kind;
  s.friction = 1;
  s.worldFromShape.translation() = Vector3d(0.1, -0.2, 0.3);
  s.worldFromShape.linear() = Eigen::AngleAxisd(0.3, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  return s;
}

// Inside out: a groove along z whose walls lean by 45 degrees, normals into it.
TriangleMesh groove() {
  TriangleMesh m;
  m.vertices = {{-0.1, 0.1, -1}, {-0.1, 0.1, 1}, {0, 0, -1}, {0, 0, 1}, {0.1, 0.1, -1}, {0.1, 0.1, 1}};
  m.triangles = {{0, 1, 3}, {0, 3, 2}, {2, 3, 5}, {2, 5, 4}};
  return m;
}

}  // namespace

TEST(StaticShapes, EachHoldsABallOnItsSurface) {
  const double depth = 9.81 * 0.001 * 0.001 / (std::numbers::pi * std::numbers::pi), r = 0.01 - depth;
  const auto check = [&](const StaticShape& shape, const Vector3d& above, double height, const char* name) {
    const Vector3d up = shape.worldFromShape.linear() * above.normalized();
    const Vector3d place = shape.worldFromShape * above;
    const Vector3d rest = restingPlace(shape, place + 0.03 * up, -up);
    EXPECT_NEAR((shape.worldFromShape.inverse() * rest).dot(above.normalized()), height + r, 1e-9) << name;
  };
  check(shapeOf(StaticShape::Kind::plane), {0, 1e-9, 0}, 0, "plane");
  StaticShape box = shapeOf(StaticShape::Kind::box);
  box.size = {0.2, 0.1, 0.3};
  check(box, {0, 0.05, 0}, 0.05, "box, y");
  check(box, {-0.1, 0, 0}, 0.1, "box, -x");
  StaticShape sphere = shapeOf(StaticShape::Kind::sphere);
  sphere.radius = 0.05;
  check(sphere, {0, 0, 0.05}, 0.05, "sphere");
  StaticShape mesh = shapeOf(StaticShape::Kind::mesh);
  mesh.mesh.vertices = {{-1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1}};
  mesh.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  check(mesh, {0, 1e-9, 0}, 0, "mesh, on the diagonal that two triangles share");
}

// Two walls at once carry the weight: both forces are m g / sqrt 2.
TEST(StaticShapes, ABallInAGrooveRestsOnBothSides) {
  StaticShape mesh;
  mesh.kind = StaticShape::Kind::mesh;
  mesh.friction = 0;
  mesh.mesh = groove();
  const Vector3d rest = restingPlace(mesh, {0.01, 0.04, 0}, -Vector3d::UnitY());
  const double depth = 9.81 * 1e-6 / (std::numbers::pi * std::numbers::pi) / std::numbers::sqrt2;
  EXPECT_NEAR(rest.x(), 0, 1e-6);
  EXPECT_NEAR(rest.y(), (0.01 - depth) * std::numbers::sqrt2, 1e-7);
}

// A surface that ends holds up nothing beyond its rim: a ball that rolls over it falls off, and is not lifted.
TEST(StaticShapes, ABallRollsOffTheRimOfAnOpenMesh) {
  StaticShape mesh;
  mesh.kind = StaticShape::Kind::mesh;
  mesh.mesh.vertices = {{-1, 0, -1}, {-1, 0, 1}, {0, 0, 1}, {0, 0, -1}, {0, 0, 1}, {-1, 0, -1}};  // corners twice
  mesh.mesh.triangles = {{0, 1, 2}, {5, 4, 3}};
  WorldSettings s;
  s.contact = ContactMode::balls;
  s.frameDuration = 0.001;
  s.substeps = 1;
  World world(s, {synthetic::ball("a", 0.01, {-0.02, 0.0101, 0.3}, 0.5)}, {mesh});
  synthetic::throwBody(world, 0, {0.2, 0, 0});
  double highest = 0;
  for (int k = 0; k < 400; ++k) {
    world.advance({});
    highest = std::max(highest, double(world.data().spheres.position[0].v[1]));
  }
  EXPECT_LT(highest, 0.0102);
  EXPECT_LT(world.data().spheres.position[0].v[1], -0.1);
  EXPECT_LT(world.penetration().statics, 10);
}

// What is fast is looked at from afar, but not turned aside by what it misses: it passes a ball, a box and a sheet.
TEST(StaticShapes, AFastBallIsNotTurnedAsideByWhatItMisses) {
  StaticShape box = shapeOf(StaticShape::Kind::box), sphere = shapeOf(StaticShape::Kind::sphere), sheet;
  box.worldFromShape.setIdentity();
  sphere.worldFromShape.setIdentity();
  box.size = {0.04, 0.04, 0.04};
  sphere.radius = 0.02;
  sheet.kind = StaticShape::Kind::mesh;
  sheet.mesh.vertices = {{-1, 0, -1}, {-1, 0, 1}, {0.02, 0, 1}, {0.02, 0, -1}};
  sheet.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  BodyDescription held = synthetic::ball("held", 0.02, Vector3d::Zero());
  held.fixed = {{0}};
  WorldSettings s;
  s.contact = ContactMode::balls;
  s.gravity.setZero();
  s.frameDuration = 0.02;
  s.substeps = 1;
  for (const double speed : {3.0, 10.0}) {
    const BodyDescription thrown = synthetic::ball("thrown", 0.02, {0.06, 1.03, 0});
    std::vector<World> worlds;
    for (const StaticShape& shape : {box, sphere, sheet})
      worlds.emplace_back(s, std::vector<BodyDescription>{thrown}, std::vector<StaticShape>{shape});
    worlds.emplace_back(s, std::vector<BodyDescription>{thrown, held});
    for (World& world : worlds) {
      synthetic::throwBody(world, 0, {0, -speed, 0});
      for (int k = 0; k < 40; ++k) world.advance({});
      EXPECT_NEAR(world.data().spheres.position[0].v[0], 0.06, 1e-9) << speed;
      EXPECT_NEAR(world.data().spheres.position[0].v[1], 1.03 - speed * world.time(), 1e-9) << speed;
    }
  }
}

// Nor what is below a sheet, which is beyond it, by being taken for what has sunk into it.
TEST(StaticShapes, WhatFliesBelowASheetStaysThere) {
  StaticShape sheet;
  sheet.kind = StaticShape::Kind::mesh;
  sheet.mesh.vertices = {{-2, 0, -1}, {-2, 0, 1}, {2, 0, 1}, {2, 0, -1}};
  sheet.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  WorldSettings s;
  s.contact = ContactMode::balls;
  s.gravity.setZero();
  s.frameDuration = 0.02;
  s.substeps = 1;
  World world(s, {synthetic::ball("thrown", 0.02, {-1, -0.06, 0})}, {sheet});
  synthetic::throwBody(world, 0, {10, 0, 0});
  for (int k = 0; k < 10; ++k) world.advance({});
  EXPECT_LT((vectorOf(world.data().spheres.position[0]) - Vector3d(-1 + 10 * world.time(), -0.06, 0)).norm(), 1e-9);
}

// A wall that is wound inside out keeps what is in it, at 1 m/s and from any side.
TEST(StaticShapes, AnInsideOutWallKeepsABallIn) {
  StaticShape wall;
  wall.kind = StaticShape::Kind::mesh;
  const TouchShape shape = ellipsoid(18, 14, 7);
  wall.mesh.vertices = shape->restNodes;
  for (const auto& t : shape->triangles) wall.mesh.triangles.push_back({t[0], t[2], t[1]});
  Vector3d low = wall.mesh.vertices[0], high = low;
  for (const Vector3d& v : wall.mesh.vertices) low = low.cwiseMin(v), high = high.cwiseMax(v);
  const double radius = 0.15 * (high - low).minCoeff();
  WorldSettings s;
  s.contact = ContactMode::balls;
  s.gravity.setZero();
  s.frameDuration = 0.001;
  s.substeps = 1;
  for (const Vector3d& way : {Vector3d(1, 0, 0), Vector3d(0, -1, 0.2), Vector3d(-0.5, 0.4, 0.7)}) {
    World world(s, {synthetic::ball("a", radius, 0.5 * (low + high))}, {wall});
    for (int k = 0; k < 600; ++k) {
      if (k % 100 == 0) world.data().spheres.velocity[0] = quadOf(way.normalized());
      world.advance({});
    }
    EXPECT_GT(world.penetration().statics, 0);
    EXPECT_LT(world.penetration().statics, 10);
    const Vector3d p = vectorOf(world.data().spheres.position[0]);
    EXPECT_TRUE((p.array() > low.array()).all() && (p.array() < high.array()).all());
  }
}

}  // namespace medulla
