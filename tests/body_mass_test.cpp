#include <gtest/gtest.h>

#include <algorithm>

#include "physics/model/build.h"
#include "physics/model/mass_properties.h"
#include "tests/dynamics_states.h"
#include "tests/test_shapes.h"

// What the dynamics moves weighs what the mesh holds: spheres and nodes together.
namespace medulla {

using namespace states;

static MassProperties simulated(const WorldData& d) {
  std::vector<MassProperties> parts;
  for (int i = 0; i < d.spheres.count; ++i) {
    const Eigen::Matrix3d j = inertia(d, i);
    parts.push_back(
        {sphereMass(d, i), vectorOf(d.spheres.position[i]), 0.5 * j.trace() * Eigen::Matrix3d::Identity() - j});
  }
  for (int i = 0; i < d.nodes.dynamicEnd; ++i)
    if (d.nodes.mass[i] > 0) parts.push_back({d.nodes.mass[i], vectorAt(d.nodes.position, i), Eigen::Matrix3d::Zero()});
  return combined(parts);
}

TEST(BodyMass, MassCentreAndInertiaAreTheMeshs) {
  const TriangleMesh mesh = assetMesh("gallbladder/gallbladder.obj");
  const MassProperties exact = massProperties(mesh);
  for (const int spheres : {7, 20}) {
    BuildSettings settings;
    settings.spheres = spheres;
    BuildReport report;
    BodyDescription b;
    b.model = std::make_shared<const SoftBodyModel>(buildModel(repairMesh(mesh), nullptr, settings, report));
    const World world({}, {b});
    const MassProperties moved = simulated(world.data());
    EXPECT_NEAR(moved.volume, b.tissue.density * exact.volume, 1e-9 * moved.volume);
    EXPECT_LT((moved.centroid - exact.centroid).norm(), 1e-6);
    const Eigen::Matrix3d expected = b.tissue.density * inertia(exact.secondMoment),
                          found = inertia(moved.secondMoment);
    EXPECT_LT((found - expected).norm(), 1e-4 * expected.norm());
  }
}

// No node alone bounds the step: the slowest and the quickest swing within a small factor of each other.
TEST(BodyMass, NodesSwingAlike) {
  BuildSettings settings;
  settings.spheres = 20;
  BuildReport report;
  BodyDescription b;
  b.model = std::make_shared<const SoftBodyModel>(
      buildModel(repairMesh(assetMesh("gallbladder/gallbladder.obj")), nullptr, settings, report));
  const World world({}, {b});
  double least = 1e300, most = 0, carried = 0;
  for (std::size_t i = 0; i < world.data().nodes.groups.size(); ++i)
    for (int l = 0; l < 4; ++l) {
      const double mass = world.data().nodes.mass[4 * i + l], stiffness = world.data().nodes.groups[i].stiffness[l];
      if (!(mass > 0)) continue;
      least = std::min(least, stiffness / mass);
      most = std::max(most, stiffness / mass);
      carried += mass;
    }
  EXPECT_LT(most, 25 * least);  // within 5 in frequency: the duct's thin cells cannot give as much
  EXPECT_NEAR(carried, 0.2 * b.tissue.density * massProperties(assetMesh("gallbladder/gallbladder.obj")).volume,
              1e-3 * carried);
}

}  // namespace medulla
