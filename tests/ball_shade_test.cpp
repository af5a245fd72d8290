#include "render/ball_shade.h"

#include <gtest/gtest.h>

namespace medulla {
namespace {

using glm::vec3;
using Balls = std::vector<ShadeBall>;

constexpr vec3 kEye(0, 0, 10);

// Two surfaces of one vertex each, at the origin and at (1, 0, 0), that face +z.
SceneMesh patches(bool travel) {
  SceneMesh mesh;
  mesh.resizeVertices(2);
  mesh.position = {{0, 0, 0}, {1, 0, 0}};
  mesh.normal = {{0, 0, 1}, {0, 0, 1}};
  mesh.openness = {0.5f, 0.5f};
  for (std::uint32_t p = 0; p < 2; ++p) {
    MeshPart part;
    part.firstVertex = p;
    part.vertexCount = 1;
    part.travels = travel;
    mesh.parts.push_back(part);
  }
  return mesh;
}

// Openness of the first patch where the second surface's ball lies at `now`, which was at `rest`.
float openness(const ShadeBall& rest, const ShadeBall& now, bool travel) {
  SceneMesh mesh = patches(travel);
  const Balls none, atRest{rest}, moved{now};
  BallShade shade;
  shade.bake(mesh, {&none, &atRest});
  shade.apply({&none, &moved}, kEye, mesh);
  EXPECT_EQ(mesh.openness[1], 0.5f) << "its own ball";
  return mesh.openness[0];
}

const ShadeBall kFar{{9, 9, 9}, 0.1f};

TEST(BallShade, ABallHidesItsViewFactor) {
  // All of the ball above the patch: cos r^2 / d^2, less what it has at 2.6 radii, where it ends.
  const auto expected = [](float cosine, float distance) {
    const float end = 1 / (2.6f * 2.6f), share = 0.01f / (distance * distance);
    return 0.5f * (1 - cosine * (share - end) / (1 - end));
  };
  for (const float z : {0.11f, 0.15f, 0.2f, 0.25f})
    EXPECT_NEAR(openness(kFar, {{0, 0, z}, 0.1f}, true), expected(1, z), 1e-6f) << z;
  EXPECT_NEAR(openness(kFar, {{0.12f, 0, 0.16f}, 0.1f}, true), expected(0.8f, 0.2f), 1e-6f);
  EXPECT_EQ(openness(kFar, {{0, 0, 0.27f}, 0.1f}, true), 0.5f) << "out of reach";
  EXPECT_EQ(openness(kFar, {{0, 0, -0.12f}, 0.1f}, true), 0.5f) << "below the patch";
  EXPECT_NEAR(openness(kFar, {{0, 0, 0.05f}, 0.1f}, true), 0, 1e-6f) << "inside";
}

TEST(BallShade, WhatIsBakedIsNotCountedTwice) {
  const ShadeBall near{{0, 0, 0.15f}, 0.1f}, nearer{{0, 0, 0.12f}, 0.1f};
  EXPECT_EQ(openness(near, near, false), 0.5f);
  EXPECT_GT(openness(near, kFar, false), 0.6f) << "the neighbour has gone";
  EXPECT_LT(openness(near, nearer, false), 0.4f);
  EXPECT_EQ(openness(nearer, kFar, false), 1) << "never more than all";
  // What travels was baked alone.
  EXPECT_EQ(openness(near, kFar, true), 0.5f);
  EXPECT_LT(openness(near, near, true), 0.4f);
}

// What stays is baked without what travels, wherever that is at rest.
TEST(BallShade, WhatTravelsIsNoPartOfWhatIsBaked) {
  const Balls none, near{{{0, 0, 0.15f}, 0.1f}};
  SceneMesh mesh = patches(false), alone = mesh;
  mesh.parts[1].travels = alone.parts[1].travels = true;
  BallShade shade;
  shade.bake(mesh, {&none, &near});
  shade.apply({&none, &near}, kEye, mesh);
  shade.bake(alone, {&none, &none});
  shade.apply({&none, &near}, kEye, alone);
  EXPECT_EQ(mesh.openness[0], alone.openness[0]);
  EXPECT_LT(mesh.openness[0], 0.4f);
}

TEST(BallShade, BallsOfOneSurfaceThatOverlapHideHardlyMoreThanOne) {
  SceneMesh mesh = patches(true);
  const Balls none, one{{{0, 0, 0.15f}, 0.1f}}, three{one[0], one[0], one[0]};
  BallShade shade;
  shade.bake(mesh, {&none, &one});
  shade.apply({&none, &one}, kEye, mesh);
  const float alone = mesh.openness[0];
  mesh = patches(true);
  shade.apply({&none, &three}, kEye, mesh);
  EXPECT_NEAR(1 - 2 * mesh.openness[0], 1.316f * (1 - 2 * alone), 1e-3f);  // 3^(1/4)
}

}  // namespace
}  // namespace medulla
