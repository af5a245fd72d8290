#include "render/touch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <vector>

#include "render/depth_map.h"
#include "render/instrument_mesh.h"

namespace medulla {
namespace {

using glm::vec3;

// A sheet of `cells`^2 quads in the plane z = 0, facing +z, spacing in m, with normals.
SceneMesh sheet(std::uint32_t cells, float spacing) {
  SceneMesh mesh;
  const std::uint32_t n = cells + 1;
  mesh.resizeVertices(std::size_t(n) * n);
  for (std::uint32_t j = 0; j < n; ++j)
    for (std::uint32_t i = 0; i < n; ++i)
      mesh.position[j * n + i] = spacing * vec3(float(i) - 0.5f * float(cells), float(j) - 0.5f * float(cells), 0);
  for (std::uint32_t j = 0; j < cells; ++j)
    for (std::uint32_t i = 0; i < cells; ++i) {
      const std::uint32_t a = j * n + i;
      for (const std::uint32_t v : {a, a + 1, a + n + 1, a, a + n + 1, a + n}) mesh.index.push_back(v);
    }
  MeshPart part;
  part.look = &findLook("stomach");
  part.vertexCount = n * n;
  part.indexCount = std::uint32_t(mesh.index.size());
  part.moving = true;
  mesh.parts.push_back(part);
  computeNormals(mesh, part);
  return mesh;
}

std::size_t middleOf(const SceneMesh& mesh) {
  return mesh.position.size() / 2;
}

// Seen along its axis from behind, the shaft is a full disc.
TEST(Instrument, TheShaftIsClosedAtItsEnd) {
  SceneMesh mesh;
  appendInstrument({}, {}, 720, mesh);
  float area = 0;
  for (std::size_t i = 0; i < mesh.index.size(); i += 3) {
    const vec3 &a = mesh.position[mesh.index[i]], &b = mesh.position[mesh.index[i + 1]],
               &c = mesh.position[mesh.index[i + 2]];
    if (std::min({a.z, b.z, c.z}) > 0.9f * kShaftEnd) area += 0.5f * glm::cross(b - a, c - a).z;
  }
  EXPECT_NEAR(area / (std::numbers::pi_v<float> * kShaftRadius * kShaftRadius), 1, 0.03);
}

// One that looks along the shaft sees the jaws, and no tube from inside.
TEST(Instrument, TheShaftEndsBeforeAnEyeThatItWouldHide) {
  Instrument instrument;
  instrument.tip = {0.1f, 0.2f, 0.3f};
  instrument.scale = 2;
  const auto lengthSeenFrom = [&](const vec3& eye) {
    SceneMesh mesh;
    Viewpoint view;
    view.position = eye;
    appendInstrument(instrument, view, 720, mesh);
    float end = 0;
    for (const vec3& p : mesh.position) end = std::max(end, p.z - instrument.tip.z);
    return end;
  };
  const float inside = 1.9f * kShaftRadius, outside = 2.1f * kShaftRadius;
  EXPECT_LT(lengthSeenFrom(instrument.tip + vec3(inside, 0, 0.2f)), 0.08f);
  EXPECT_GT(lengthSeenFrom(instrument.tip + vec3(outside, 0, 0.2f)), 2 * 0.99f * kShaftEnd);
  EXPECT_GT(lengthSeenFrom(instrument.tip + vec3(inside, 0, 2.1f * kShaftEnd)), 2 * 0.99f * kShaftEnd) << "behind it";
  EXPECT_GT(lengthSeenFrom(instrument.tip - vec3(0, 0, 0.2f)), 2 * 0.99f * kShaftEnd) << "before the jaws";
}

TEST(Touch, StretchPalesAndSqueezeReddens) {
  const SceneMesh rest = sheet(10, 0.003f);
  for (const float factor : {0.8f, 1.f, 1.2f}) {
    SceneMesh mesh = rest;
    for (vec3& p : mesh.position) p *= factor;
    computeNormals(mesh, mesh.parts[0]);
    applyStrain(rest, mesh, mesh.parts[0]);
    const float blanch = mesh.blanch[middleOf(mesh)];
    if (factor == 1)
      EXPECT_NEAR(blanch, 0, 1e-5);
    else
      EXPECT_GT(blanch * (factor - 1), 0.02f);
    EXPECT_NEAR(mesh.openness[middleOf(mesh)], 1, 1e-5) << "a flat sheet has no fold";
  }
}

TEST(Touch, AFoldIsDarkAndARidgeIsNot) {
  const SceneMesh rest = sheet(10, 0.003f);
  for (const float side : {1.f, -1.f}) {
    SceneMesh mesh = rest;
    for (vec3& p : mesh.position) p.z = side * 0.6f * std::abs(p.x);
    computeNormals(mesh, mesh.parts[0]);
    applyStrain(rest, mesh, mesh.parts[0]);
    if (side > 0)
      EXPECT_LT(mesh.openness[middleOf(mesh)], 0.8f);
    else
      EXPECT_EQ(mesh.openness[middleOf(mesh)], 1);
  }
}

TEST(Touch, PressedTissueGivesWayAndHeldTissueComesBetweenTheJaws) {
  const SceneMesh rest = sheet(30, 0.002f);
  Instrument tool;
  tool.tip = {0, 0, 0.001f};  // its shaft along +z, away from the sheet
  tool.touching = true;
  tool.press = {0, 0, -0.002f};
  SceneMesh pressed = rest;
  applyTouch(tool, pressed);
  EXPECT_LT(pressed.position[middleOf(rest)].z, -0.0005f);
  EXPECT_GT(pressed.blanch[middleOf(rest)], 0.3f);
  // Half held it is halfway there.
  tool.tip = {0, 0, 0.004f};
  tool.press = {};
  tool.grasp = 1;
  tool.hold = 0.5f;
  SceneMesh between = rest;
  applyTouch(tool, between);
  tool.hold = 1;
  SceneMesh held = rest;
  applyTouch(tool, held);
  const float risen = held.position[middleOf(rest)].z, half = between.position[middleOf(rest)].z;
  EXPECT_GT(risen, tool.tip.z + 0.002f);
  EXPECT_GT(half, 0.2f * risen);
  EXPECT_LT(half, 0.8f * risen);
  EXPECT_NEAR(held.blanch[middleOf(rest)], 1, 1e-5);
  // Jaws that open let it down before the tool lets go; until then it stays pale.
  tool.hold = 0;
  SceneMesh opening = rest;
  applyTouch(tool, opening);
  EXPECT_EQ(opening.position[middleOf(rest)], rest.position[middleOf(rest)]);
  EXPECT_NEAR(opening.blanch[middleOf(rest)], 1, 1e-5);
  // As a fold: thin where the jaws close on it, along y, and long across them.
  const auto heightAt = [&](vec3 place) {
    const auto nearer = [&](vec3 a, vec3 b) { return glm::distance(a, place) < glm::distance(b, place); };
    return held.position[std::min_element(rest.position.begin(), rest.position.end(), nearer) - rest.position.begin()]
        .z;
  };
  EXPECT_GT(heightAt({0.002f, 0, 0}), heightAt({0, 0.002f, 0}) + 0.003f);
  // Far away nothing moves.
  EXPECT_EQ(held.position[0], rest.position[0]);
  EXPECT_EQ(pressed.position[0], rest.position[0]);
  // The normals are those of the surface drawn: against triangles, within what a first-order rule and facets differ.
  SceneMesh check = pressed;
  computeNormals(check, check.parts[0]);
  for (std::size_t i = 0; i < check.normal.size(); ++i) EXPECT_GT(glm::dot(check.normal[i], pressed.normal[i]), 0.98f);
}

// m: height above z = 0, over a square of 40 mm about the middle, seen along -z.
std::vector<float> heightsOf(const SceneMesh& mesh) {
  constexpr int kSide = 80;
  constexpr float kTexelsPerMetre = 2000, kDeepest = 0.1f;  // m
  DepthMap map(kSide, kSide);
  const auto texel = [](vec3 p) {
    return vec3(p.x * kTexelsPerMetre + 0.5f * kSide, p.y * kTexelsPerMetre + 0.5f * kSide, 0.5f - p.z / kDeepest);
  };
  for (std::size_t k = 0; k < mesh.index.size(); k += 3)
    map.rasterize(texel(mesh.position[mesh.index[k]]), texel(mesh.position[mesh.index[k + 1]]),
                  texel(mesh.position[mesh.index[k + 2]]));
  std::vector<float> heights;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) heights.push_back((0.5f - map.at(x, y)) * kDeepest);
  return heights;
}

TEST(Touch, WhatIsHeldHasItsShapeOnACoarseMesh) {
  const SceneMesh coarse = sheet(20, 0.006f);
  SceneMesh fine = sheet(240, 0.0005f), without = coarse, held;
  Instrument tool;
  tool.tip = {0, 0, 0.006f};
  EXPECT_FALSE(spotBetweenJaws(tool, coarse));
  tool.touching = true;
  tool.grasp = tool.hold = 1;
  const std::optional<FineSpot> spot = spotBetweenJaws(tool, coarse);
  ASSERT_TRUE(spot);
  ASSERT_TRUE(refine(coarse, {*spot}, held));
  for (SceneMesh* mesh : {&fine, &without, &held}) applyTouch(tool, *mesh);
  const std::vector<float> heights = heightsOf(fine);
  const auto meanError = [&](const SceneMesh& mesh) {
    const std::vector<float> drawn = heightsOf(mesh);
    float sum = 0;
    for (std::size_t k = 0; k < drawn.size(); ++k) sum += std::abs(drawn[k] - heights[k]) / float(drawn.size());
    return sum;
  };
  EXPECT_GT(meanError(without), 1e-4f);
  EXPECT_LT(meanError(held), 5e-5f);
}

}  // namespace
}  // namespace medulla
