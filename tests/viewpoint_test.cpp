#include "render/viewpoint.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "render/haze.h"

namespace medulla {

// A shaft that passes the lens is drawn whole; what is looked at from far away does not show through what is before it.
TEST(Viewpoint, DepthsReachFromTheLensToFarBeyondTheTargetAtAnyDistance) {
  for (const float distance : {0.01f, 0.2f, 5.f, 160.f, 900.f}) {
    SCOPED_TRACE(distance);
    Camera camera;
    camera.position = {0, 0, 0};
    camera.target = {0, 0, -distance};
    const Viewpoint view = makeViewpoint(camera, 1, false);
    const auto depth = [&](float d) {
      const glm::vec4 clip = view.clipFromWorld * glm::vec4(0, 0, -d, 1);
      return clip.z / clip.w;  // -1 at the near plane, 1 at the far one
    };
    EXPECT_GT(depth(std::max(0.004f * distance, 0.00021f)), -1) << "at a share of the way";
    EXPECT_LT(depth(distance), depth(1.0002f * distance));
    EXPECT_LT(depth(2 * distance), depth(2.001f * distance));
  }
}

// Its lamp stands beside the lens: of the narrow cone of a camera that zooms in, what is nearer would see nothing.
TEST(Viewpoint, ZoomingInDoesNotNarrowTheLampsCone) {
  Light light;
  light.offset = {-0.03f, 0.03f, 0};
  Camera camera;
  camera.position = {0, 0, 0.2f};
  const auto tangentAt = [&](float fov) {
    camera.fovDegrees = fov;
    return makeLightView(light, makeViewpoint(camera, 1.78f, true), camera, SceneMesh()).tangent;
  };
  EXPECT_GT(tangentAt(60), tangentAt(42));
  EXPECT_NEAR(tangentAt(10), tangentAt(42), 0.02f * tangentAt(42));
}

// A lamp in the world sees all that casts a shadow; but where one of many bodies moves a little from picture to
// picture, the texels of its view stay where they are, or the edges of all resting shadows would crawl.
TEST(Viewpoint, ALampsViewHoldsAllCastersAndRarelyFollowsThem) {
  const Look look;
  SceneMesh mesh;
  mesh.position = {{-0.2f, 0, -0.2f}, {0.25f, 0, 0.2f}, {0, 0.3f, 0}};
  mesh.parts.resize(1);
  mesh.parts[0].vertexCount = 3;
  mesh.parts[0].look = &look;
  Light light;
  light.position = glm::vec3(-0.6f, 1.2f, 0.6f);
  Camera camera;
  glm::mat4 last(0);
  int changes = 0;
  for (int i = 0; i < 100; ++i) {
    mesh.position[2].y = 0.3f - 0.001f * float(i);
    const LightView view = makeLightView(light, makeViewpoint(camera, 1, false), camera, mesh);
    if (view.clipFromWorld != last) ++changes;
    last = view.clipFromWorld;
    for (const glm::vec3 p : mesh.position) {
      const glm::vec4 clip = last * glm::vec4(p, 1);
      for (int k = 0; k < 3; ++k) EXPECT_LT(std::abs(clip[k]), clip.w) << i;
    }
  }
  EXPECT_LE(changes, 6);
}

// As one that is tilted there from the horizontal: a film does not turn by a right angle in the picture in between.
TEST(Viewpoint, StraightUpAndDownTheLastTiltIsKept) {
  for (const float y : {-1.f, 1.f}) {
    Camera camera;
    camera.position = {0, 0, 0};
    camera.target = {0, y, 0};
    const Viewpoint straight = makeViewpoint(camera, 1, false);
    camera.target = {0, y, -1e-4f};
    EXPECT_LT(glm::length(straight.right - makeViewpoint(camera, 1, false).right), 1e-3f);
  }
}

TEST(HazeField, ALampThatTheCameraLooksAtShinesFromAbove) {
  Light light;
  light.haze = Haze{{0.1f, 0.2f, 0.3f}, 10};
  light.caustics = 1;
  Camera camera;
  light.position = camera.target;
  const glm::vec3 at = HazeField(light, camera, 0).toward({0.6f, 0, 0.8f});
  light.position = camera.target + glm::vec3(0, 1, 0);
  EXPECT_EQ(at, HazeField(light, camera, 0).toward({0.6f, 0, 0.8f}));
}

}  // namespace medulla
