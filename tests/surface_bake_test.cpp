#include "render/surface_bake.h"

#include <gtest/gtest.h>

#include "app/files/model_file.h"

namespace medulla {

TEST(SurfaceBake, ADolphinHasAnEyeOnEachSideOfItsHead) {
  const SoftBodyModel model = readModel(MEDULLA_SOURCE_DIR "/assets/dolphin/dolphin.model.xml");
  SceneMesh mesh;
  MeshPart part;
  part.look = &findLook("dolphin");
  part.vertexCount = std::uint32_t(model.renderSurface.restPosition.size());
  mesh.resizeVertices(part.vertexCount);
  for (std::size_t i = 0; i < mesh.position.size(); ++i) {
    const auto& p = model.renderSurface.restPosition[i];
    mesh.position[i] = {p[0], p[1], p[2]};
  }
  bakeAlbedo(mesh, part);
  std::array<int, 2> dark{};  // vertices at the right and the left
  for (std::size_t i = 0; i < mesh.position.size(); ++i) {
    if (mesh.albedo[i].r > 0.04f) continue;
    ++dark[mesh.position[i].z > 0];
    EXPECT_NEAR(mesh.position[i].x, 0.905f, 0.05f);  // where the shape has its eyeballs
  }
  for (const int vertices : dark) {
    EXPECT_GE(vertices, 2);
    EXPECT_LE(vertices, 20);
  }
}

// Whichever way it faces, its texture is neither stretched nor squeezed along any direction.
TEST(SurfaceBake, APlanesTextureHasTheSameScaleAlongAll) {
  for (const glm::vec3 facing : {glm::vec3(0, 1, 0), {1, 0, 0}, {0, 0, -1}, {0, 0, 1}, {0.6f, -0.8f, 0}})
    for (const char* look : {"wall", "wood", "seabed"}) {
      const glm::vec3 aside = glm::normalize(glm::cross(facing, glm::vec3(0.3f, 0.5f, -0.81f))),
                      up = glm::cross(facing, aside);
      SceneMesh mesh;
      MeshPart part;
      part.look = &findLook(look);
      part.vertexCount = 4;
      part.indexCount = 6;
      mesh.resizeVertices(4);
      mesh.position = {glm::vec3(0), 0.1f * aside, 0.1f * up, 0.1f * (aside + up)};
      mesh.index = {0, 1, 3, 0, 3, 2};
      std::fill(mesh.normal.begin(), mesh.normal.end(), facing);
      bakeTextureCoordinates(mesh, part);
      const glm::vec2 u = mesh.uv[1] - mesh.uv[0], v = mesh.uv[2] - mesh.uv[0];
      const float scale = 0.1f * part.look->detailScale;
      EXPECT_NEAR(glm::length(u), scale, 1e-4f * scale) << look;
      EXPECT_NEAR(glm::length(v), scale, 1e-4f * scale) << look;
      EXPECT_NEAR(glm::dot(u, v), 0, 1e-4f * scale * scale) << look;
    }
}

// A strip of a surface along x whose texture turns back half way: tangents oppose each other there, and only there.
TEST(SurfaceBake, SeamsAreWhereATextureFolds) {
  constexpr int kColumns = 9;
  SceneMesh mesh;
  MeshPart part;
  part.look = &findLook("liver");
  part.vertexCount = 2 * kColumns;
  part.indexCount = 6 * (kColumns - 1);
  mesh.resizeVertices(part.vertexCount);
  for (int c = 0; c < kColumns; ++c)
    for (int row = 0; row < 2; ++row) {
      mesh.position[2 * c + row] = {c, row, 0};
      mesh.uv[2 * c + row] = {c <= 4 ? c : 8.5f - float(c), row};
    }
  for (std::uint32_t c = 0; c + 1 < kColumns; ++c)
    mesh.index.insert(mesh.index.end(), {2 * c, 2 * c + 2, 2 * c + 3, 2 * c, 2 * c + 3, 2 * c + 1});
  computeNormals(mesh, part);
  computeTangents(mesh, part);
  findSeams(mesh, part);
  for (const std::uint32_t i : {0, 1, 2, 3, 4, 5, 12, 13, 14, 15, 16, 17}) EXPECT_EQ(mesh.seam[i], 0) << i;
  EXPECT_EQ(mesh.seam[8] + mesh.seam[9], 2);
}

}  // namespace medulla
