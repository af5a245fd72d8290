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
    EXPECT_NEAR(mesh.position[i].x, 0.97f, 0.05f);
  }
  for (const int vertices : dark) {
    EXPECT_GE(vertices, 2);
    EXPECT_LE(vertices, 20);
  }
}

}  // namespace medulla
