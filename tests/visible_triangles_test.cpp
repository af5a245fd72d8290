#include "render/visible_triangles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "render/shadow_map.h"

namespace medulla {
namespace {

// Appends a square that faces +z, of cells^2 pairs of triangles.
void addSquare(SceneMesh& mesh, glm::vec3 centre, float halfSide, std::uint32_t cells) {
  MeshPart part;
  part.look = &looks()[0];
  part.firstVertex = std::uint32_t(mesh.position.size());
  part.firstIndex = std::uint32_t(mesh.index.size());
  for (std::uint32_t j = 0; j <= cells; ++j)
    for (std::uint32_t i = 0; i <= cells; ++i)
      mesh.position.push_back(
          centre + halfSide * glm::vec3(2 * float(i) / float(cells) - 1, 2 * float(j) / float(cells) - 1, 0));
  for (std::uint32_t j = 0; j < cells; ++j)
    for (std::uint32_t i = 0; i < cells; ++i) {
      const std::uint32_t a = part.firstVertex + j * (cells + 1) + i, b = a + cells + 1;
      mesh.index.insert(mesh.index.end(), {a, a + 1, b + 1, a, b + 1, b});
    }
  part.vertexCount = std::uint32_t(mesh.position.size()) - part.firstVertex;
  part.indexCount = std::uint32_t(mesh.index.size()) - part.firstIndex;
  mesh.parts.push_back(part);
}

// Triangles seen per part of a picture of so many pixels, from 0.3 m along +z.
std::vector<std::uint32_t> trianglesSeen(const SceneMesh& mesh, bool opaque, int width = 480, int height = 480) {
  VisibleTriangles seen(width, height);
  const float aspect = float(width) / float(height);
  findVisibleTriangles(mesh, makeViewpoint({.position = {0, 0, 0.3f}, .fovDegrees = 40}, aspect, false), opaque, seen);
  std::vector<std::uint32_t> count(mesh.parts.size(), 0);
  for (const VisiblePart& part : seen.parts) {
    count[part.part] = part.indexCount / 3;
    for (std::uint32_t k = part.firstIndex; k < part.firstIndex + part.indexCount; ++k) {
      EXPECT_GE(seen.index[k], part.firstVertex);
      EXPECT_LT(seen.index[k], part.firstVertex + part.vertexCount);
    }
  }
  return count;
}

TEST(VisibleTriangles, WhatLiesBehindIsDroppedOnlyBehindWhatIsOpaque) {
  SceneMesh mesh;
  // Off the middle, where the centres of texels would lie on its diagonals and could be missed by both triangles.
  addSquare(mesh, {0.0013f, 0.0007f, 0.05f}, 0.04f, 10);
  addSquare(mesh, {0, 0, 0}, 0.04f, 10);
  EXPECT_EQ(trianglesSeen(mesh, false), (std::vector<std::uint32_t>{200, 200}));
  EXPECT_EQ(trianglesSeen(mesh, true), (std::vector<std::uint32_t>{200, 0}));
}

TEST(VisibleTriangles, WhatPeeksOutStays) {
  SceneMesh mesh;
  addSquare(mesh, {0, 0, 0.05f}, 0.02f, 10);
  addSquare(mesh, {0, 0, 0}, 0.04f, 40);
  // The shadow of the front square on the plane behind, seen from the lens, has half side 0.02 * 0.3 / 0.25 = 0.024: of
  // cells of 0.002 just those inside can go, less a margin of 2.5 texels (1.4 px = 0.64 mm each): 20 to 24 across.
  const std::uint32_t kept = trianglesSeen(mesh, true)[1];
  EXPECT_GE(kept, 2u * (40 * 40 - 24 * 24));
  EXPECT_LE(kept, 2u * (40 * 40 - 20 * 20));
}

// However wide the picture is: between two slabs, through a gap of three pixels.
TEST(VisibleTriangles, ASlitOfAFewPixelsIsSeenThrough) {
  SceneMesh mesh;
  constexpr float kPixel = 2 * 0.25f * 0.36397f / 256;  // m, at the slabs' depth; tan 20 degrees
  for (const float side : {-1.f, 1.f}) addSquare(mesh, {side * (0.02f + 1.5f * kPixel), 0, 0.05f}, 0.02f, 10);
  addSquare(mesh, {0, 0, 0}, 0.02f, 10);
  for (const int width : {256, 1024, 4096}) EXPECT_GT(trianglesSeen(mesh, true, width, 256)[2], 0u) << width;
}

TEST(VisibleTriangles, ASurfaceDoesNotHideItselfNorWhatLiesOnIt) {
  SceneMesh mesh;
  addSquare(mesh, {0, 0, 0}, 0.05f, 150);  // finer than the map of depths
  addSquare(mesh, {0, 0, -0.0005f}, 0.05f, 150);
  const std::vector<std::uint32_t> seen = trianglesSeen(mesh, true);
  EXPECT_EQ(seen[0], 2u * 150 * 150);
  EXPECT_EQ(seen[1], 2u * 150 * 150);  // half a millimetre behind: left to OpenGL
}

// A shaft runs past the lamp: what is nearer than the near plane hides what lies behind it, too; what is behind the
// lamp nothing.
TEST(ShadowMap, WhatIsNearerThanTheNearPlaneCastsItsShadow) {
  LightView light;
  light.nearDistance = 0.1f;
  light.clipFromWorld = glm::perspective(1.0f, 1.f, light.nearDistance, light.farDistance);
  for (const float distance : {0.2f, 0.03f, -0.03f}) {
    SceneMesh mesh;
    addSquare(mesh, {0.0001f * distance, 0.0002f * distance, -distance}, 0.2f * std::abs(distance), 3);
    ShadowMap shadow;
    renderShadowMap(mesh, light, shadow);
    const float behind = 0.9f;  // 0.5 m away
    EXPECT_EQ(shadow.map.at(kShadowSide / 2 + 3, kShadowSide / 2 + 5) < behind, distance > 0) << distance;
    EXPECT_EQ(shadow.map.at(3, 5), 1) << distance;
  }
}

// A board under the lamp that reaches from before it to behind it: two triangles, both cut.
TEST(ShadowMap, TrianglesThatReachBehindTheLampCastTheShadowOfTheRest) {
  LightView light;
  light.nearDistance = 0.1f;
  light.clipFromWorld = glm::perspective(1.0f, 1.f, light.nearDistance, light.farDistance);
  SceneMesh mesh;
  addSquare(mesh, {0, 0, 0}, 0.1f, 1);
  mesh.position = {{-0.05f, -0.05f, 1}, {0.05f, -0.05f, 1}, {0.05f, -0.05f, -0.8f}, {-0.05f, -0.05f, -0.8f}};
  mesh.index = {0, 1, 2, 0, 2, 3};
  ShadowMap shadow;
  renderShadowMap(mesh, light, shadow);
  EXPECT_LT(shadow.map.at(kShadowSide / 2, 5), 0.5f);                    // near
  EXPECT_LT(shadow.map.at(kShadowSide / 2, kShadowSide * 2 / 5), 0.9f);  // far
  EXPECT_EQ(shadow.map.at(kShadowSide / 2, kShadowSide * 3 / 5), 1);     // above it
  EXPECT_EQ(shadow.map.at(kShadowSide / 10, kShadowSide * 9 / 20), 1);   // beside it
}

}  // namespace
}  // namespace medulla
