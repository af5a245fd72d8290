#include <gtest/gtest.h>

#include "physics/dynamics/frame.h"

namespace medulla {

static DynamicsFrame oneBody(double t, const Eigen::Vector3d& x, const Eigen::Quaterniond& q) {
  DynamicsFrame f;
  f.time = t;
  f.bodies.resize(1);
  f.bodies[0].nodes = {x};
  f.bodies[0].spheres = {{x, q}};
  return f;
}

TEST(Blend, EndsAreExactAndTheMiddleIsBetween) {
  const Eigen::Quaterniond q0 = Eigen::Quaterniond::Identity();
  const Eigen::Quaterniond q1(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ()));
  const DynamicsFrame a = oneBody(1, {0.1, 0.2, 0.3}, q0), b = oneBody(1.02, {0.4, 0.5, 0.7}, q1);
  DynamicsFrame out;
  blendFrames(a, b, 0, out);
  EXPECT_EQ(out.bodies[0].nodes[0], a.bodies[0].nodes[0]);
  blendFrames(a, b, 1, out);
  EXPECT_EQ(out.bodies[0].nodes[0], b.bodies[0].nodes[0]);
  blendFrames(a, b, 0.5, out);
  EXPECT_NEAR(out.bodies[0].spheres[0].worldFromSphere.angularDistance(q0), 0.1, 1e-12);
  EXPECT_NEAR(out.time, 1.01, 1e-12);
}

TEST(Blend, OppositeQuaternionsOfOneOrientationDoNotTurn) {
  const Eigen::Quaterniond q(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitX()));
  DynamicsFrame out;
  blendFrames(oneBody(0, Eigen::Vector3d::Zero(), q),
              oneBody(1, Eigen::Vector3d::Zero(), Eigen::Quaterniond(-q.coeffs())), 0.5, out);
  EXPECT_NEAR(out.bodies[0].spheres[0].worldFromSphere.angularDistance(q), 0, 1e-7);
}

}  // namespace medulla
