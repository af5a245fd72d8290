#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "render/renderer.h"
#include "tests/test_shapes.h"

namespace medulla {

// A brush's streak is an instrument's: a ball shows the lamp beside the lens as a spot, wherever one looks from.
TEST(Metal, ABallOfSteelShinesAllAround) {
  constexpr float radius = 0.04f, distance = 0.2f, halfView = 20;
  const TriangleMesh ball = ellipsoidMesh(4, Eigen::Vector3d::Constant(radius));
  SurfaceShape shape;
  shape.look = "steel";
  for (const Eigen::Vector3d& x : ball.vertices) shape.restPositions.emplace_back(x.x(), x.y(), x.z());
  for (const auto& t : ball.triangles)
    shape.triangles.push_back({std::uint32_t(t[0]), std::uint32_t(t[1]), std::uint32_t(t[2])});
  RendererSettings settings;
  settings.width = settings.height = 128;
  Renderer renderer(settings);
  renderer.addSurface(shape);
  Picture picture;
  picture.camera.fovDegrees = 2 * halfView;
  picture.light.offset = glm::vec3(0);
  picture.endoscopeMask = false;
  Image image;
  const auto red = [&image](int x, int y) { return int(image.pixels[4ul * std::size_t(y * 128 + x)]); };
  const int away = int(0.55f * radius / distance / std::tan(glm::radians(halfView)) * 64);
  for (const glm::vec3 from : {glm::vec3(0, 0, distance), glm::vec3(distance, 0, 0)}) {
    picture.camera.position = from;
    renderer.render(picture, image);
    const std::array<int, 4> around = {red(64 - away, 64), red(64 + away, 64), red(64, 64 - away), red(64, 64 + away)};
    for (const int value : around) EXPECT_LT(value, red(64, 64) - 60) << from.x;
  }
}

}  // namespace medulla
