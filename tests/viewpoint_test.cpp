#include "render/viewpoint.h"

#include <gtest/gtest.h>

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

}  // namespace medulla
