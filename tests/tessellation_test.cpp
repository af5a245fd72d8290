#include "render/tessellation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "render/instrument_mesh.h"

namespace medulla {
namespace {

using glm::vec3;

constexpr float kRing = 0.05f, kTube = 0.02f;  // m

// A torus about the z axis: closed, round everywhere, and with hollows.
SceneMesh torus(std::uint32_t around, std::uint32_t across) {
  SceneMesh mesh;
  mesh.resizeVertices(std::size_t(around) * across);
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t j = 0; j < across; ++j) {
      const float a = 2 * std::numbers::pi_v<float> * float(i) / float(around),
                  b = 2 * std::numbers::pi_v<float> * float(j) / float(across);
      const vec3 out(std::cos(a), std::sin(a), 0), normal = std::cos(b) * out + vec3(0, 0, std::sin(b));
      const std::uint32_t k = i * across + j, up = i * across + (j + 1) % across, on = (i + 1) % around * across + j,
                          both = (i + 1) % around * across + (j + 1) % across;
      mesh.position[k] = kRing * out + kTube * normal;
      mesh.normal[k] = normal;
      mesh.tangent[k] = vec3(-out.y, out.x, 0);
      mesh.index.insert(mesh.index.end(), {k, on, both, k, both, up});
    }
  mesh.parts.push_back({{0, around * across, 0, std::uint32_t(mesh.index.size())}, &looks()[0]});
  return mesh;
}

float distanceFromTorus(vec3 p) {
  return std::abs(glm::length(glm::vec2(glm::length(glm::vec2(p)) - kRing, p.z)) - kTube);
}

Viewpoint fromAbove() {
  return makeViewpoint({.position = {0, 0, 0.3f}, .fovDegrees = 40}, 1, false);
}

// px: by how much the middles of edges lie beside the torus where it is seen from the side.
float worstOutline(const SceneMesh& mesh, int height) {
  const Viewpoint view = fromAbove();
  float worst = 0;
  for (std::size_t k = 0; k < mesh.index.size(); ++k) {
    const std::uint32_t a = mesh.index[k], b = mesh.index[k % 3 == 2 ? k - 2 : k + 1];
    const vec3 middle = 0.5f * (mesh.position[a] + mesh.position[b]), toEye = glm::normalize(view.position - middle);
    if (std::abs(glm::dot(mesh.normal[a] + mesh.normal[b], toEye)) > 0.2f) continue;
    const float pixelsPerMetre = float(height) / (2 * view.tangent * glm::length(view.position - middle));
    worst = std::max(worst, distanceFromTorus(middle) * pixelsPerMetre);
  }
  return worst;
}

TEST(Tessellation, OutlinesAreRoundInLargePictures) {
  const SceneMesh mesh = torus(48, 24);
  SceneMesh finer;
  tessellate(mesh, fromAbove(), 2160, Halved::outlines, finer);
  EXPECT_GT(worstOutline(mesh, 2160), 2);
  EXPECT_LT(worstOutline(finer, 2160), 0.4f);
  for (std::size_t i = 0; i < finer.position.size(); ++i) {
    EXPECT_LT(distanceFromTorus(finer.position[i]), 0.01f * kTube);
    EXPECT_NEAR(glm::length(finer.normal[i]), 1, 1e-4f);
    EXPECT_NEAR(glm::dot(finer.normal[i], finer.tangent[i]), 0, 1e-4f);
  }
}

void expectNoCracks(const SceneMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (std::size_t k = 0; k < mesh.index.size(); ++k) ++edges[{mesh.index[k], mesh.index[k % 3 == 2 ? k - 2 : k + 1]}];
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(edges.contains({edge.second, edge.first}));
  }
}

TEST(Tessellation, LeavesNoCracks) {
  SceneMesh finer;
  tessellate(torus(48, 24), fromAbove(), 2160, Halved::outlines, finer);
  expectNoCracks(finer);
}

float areaOf(const SceneMesh& mesh) {
  float area = 0;
  for (std::size_t k = 0; k < mesh.index.size(); k += 3) {
    const vec3 a = mesh.position[mesh.index[k]];
    area += 0.5f * glm::length(glm::cross(mesh.position[mesh.index[k + 1]] - a, mesh.position[mesh.index[k + 2]] - a));
  }
  return area;
}

TEST(Tessellation, ASpotIsCutFinelyInItsPlaceAndNothingElse) {
  const FineSpot spot{1, {kRing + kTube, 0, 0}, 0.002f};
  SceneMesh mesh = torus(32, 16), finer;
  EXPECT_FALSE(refine(mesh, {}, finer));
  const MeshPart whole = mesh.parts[0];
  mesh.parts = {whole, whole};
  mesh.parts[0].indexCount = 0;  // the other part: the same vertices alone
  ASSERT_TRUE(refine(mesh, {spot}, finer));
  expectNoCracks(finer);
  EXPECT_NEAR(areaOf(finer) / areaOf(mesh), 1, 1e-4f);
  EXPECT_EQ(finer.parts[0].vertexCount, whole.vertexCount);
  std::size_t cut = 0;
  for (std::size_t k = 0; k < finer.index.size(); ++k) {
    const vec3 a = finer.position[finer.index[k]], b = finer.position[finer.index[k % 3 == 2 ? k - 2 : k + 1]];
    const float away = glm::distance(0.5f * (a + b), spot.centre);
    EXPECT_LE(glm::distance(a, b), std::max(spot.longestEdge, away / 2.99f));
    cut += away < 0.02f;
  }
  EXPECT_GT(cut, 100u);
  EXPECT_LT(finer.index.size(), mesh.index.size() + 3 * cut);
}

TEST(Tessellation, WhatASmallPictureShowsStaysAsItIs) {
  const SceneMesh mesh = torus(96, 48);
  SceneMesh same;
  tessellate(mesh, fromAbove(), 240, Halved::outlines, same);
  EXPECT_EQ(same.index, mesh.index);
  EXPECT_EQ(same.position, mesh.position);
}

// Light is interpolated over no more than some pixels of a plane that runs under the lens, and it stays plane.
TEST(Tessellation, PlaneCloseToTheLensIsCutFinely) {
  SceneMesh mesh;
  mesh.resizeVertices(4);
  mesh.position = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  std::fill(mesh.normal.begin(), mesh.normal.end(), vec3(0, 0, 1));
  std::fill(mesh.tangent.begin(), mesh.tangent.end(), vec3(1, 0, 0));
  mesh.index = {0, 1, 2, 0, 2, 3};
  mesh.parts.push_back({{0, 4, 0, 6}, &looks()[0]});
  const Viewpoint view = makeViewpoint({.position = {0, 0, 1.5f}, .fovDegrees = 40}, 1, false);
  SceneMesh finer;
  tessellate(mesh, view, 2160, Halved::outlines, finer);
  for (const vec3& p : finer.position) EXPECT_EQ(p.z, 0);
  float longest = 0;
  for (std::size_t k = 0; k < finer.index.size(); k += 3) {
    const vec3 a = pictureFromWorld(view, finer.position[finer.index[k]]),
               b = pictureFromWorld(view, finer.position[finer.index[k + 1]]);
    if (std::max(std::abs(a.x), std::abs(a.y)) < 0.5f)
      longest = std::max(longest, 2160 * glm::length(glm::vec2(b - a)));
  }
  EXPECT_GT(longest, 40);
  EXPECT_LE(longest, 80);
}

// rad, the widest angle between neighbours on a ring of the shaft.
float widestSide(int pictureHeight) {
  SceneMesh mesh;
  appendInstrument({}, fromAbove(), pictureHeight, mesh);
  float widest = 0;
  for (std::size_t k = 0; k < mesh.index.size(); ++k) {
    const vec3 p = mesh.position[mesh.index[k]], q = mesh.position[mesh.index[k % 3 == 2 ? k - 2 : k + 1]];
    if (p.z != q.z || p.z < 0.1f || glm::length(glm::vec2(p)) < 0.9f * kShaftRadius) continue;
    widest = std::max(widest, glm::length(p - q) / kShaftRadius);
  }
  return widest;
}

// The outline strays by the square of it, in pixels as many times more as the picture is higher.
TEST(Tessellation, ShaftsOutlineStraysByTheSameShareOfAPixel) {
  const float coarse = widestSide(720), fine = widestSide(4320);
  EXPECT_EQ(widestSide(360), coarse);
  EXPECT_NEAR(6 * fine * fine, coarse * coarse, 0.05f * coarse * coarse);
}

}  // namespace
}  // namespace medulla
