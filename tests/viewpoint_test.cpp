#include "render/viewpoint.h"

#include <gtest/gtest.h>

#include "render/haze.h"

namespace medulla {

// What a camera looks at from a few millimetres is drawn; farther away the near plane stays, and with it every depth.
TEST(Viewpoint, NothingBetweenTheLensAndWhatItLooksAtIsCutAway) {
  Camera camera;
  camera.target = {0, 0, 0};
  camera.position = {0, 0, 0.0025f};
  EXPECT_FLOAT_EQ(makeViewpoint(camera, 1, false).nearPlane, 0.00025f);
  const glm::vec4 clip = makeViewpoint(camera, 1, false).clipFromWorld * glm::vec4(0, 0, 0.002f, 1);
  EXPECT_GT(clip.z, -clip.w) << "half a millimetre before the lens";
  camera.position = {0, 0, 0.2f};
  EXPECT_FLOAT_EQ(makeViewpoint(camera, 1, false).nearPlane, 0.005f);
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
