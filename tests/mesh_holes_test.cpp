#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "physics/model/mesh_repair.h"
#include "physics/model/mesh_topology.h"
#include "tests/dynamics_states.h"

// Where a face of a surface is cut finer than its neighbours: T-junctions, gaps without area that touch one another.
namespace medulla {

using Eigen::Vector3d;

namespace {

// A cube of four by four squares on every side, the upper one of `finer` times as many, and its volume.
TriangleMesh cubeWithAFineTop(int finer) {
  TriangleMesh mesh;
  std::map<std::array<double, 3>, int> numbers;
  const auto number = [&](const Vector3d& x) {
    const auto [at, isNew] = numbers.try_emplace({x.x(), x.y(), x.z()}, static_cast<int>(mesh.vertices.size()));
    if (isNew) mesh.vertices.push_back(x);
    return at->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {0, 1}) {
      const int cells = axis == 2 && side == 1 ? 4 * finer : 4;
      const auto corner = [&](int i, int j) {
        Vector3d x;
        x[axis] = side;
        x[(axis + 1) % 3] = double(i) / cells;
        x[(axis + 2) % 3] = double(j) / cells;
        return number(x);
      };
      for (int i = 0; i < cells; ++i) {
        for (int j = 0; j < cells; ++j) {
          const int a = corner(i, j), b = corner(i + 1, j), c = corner(i + 1, j + 1), d = corner(i, j + 1);
          if (side == 1) {
            mesh.triangles.push_back({a, b, c});
            mesh.triangles.push_back({a, c, d});
          } else {
            mesh.triangles.push_back({a, c, b});
            mesh.triangles.push_back({a, d, c});
          }
        }
      }
    }
  }
  return mesh;
}

}  // namespace

// Walked round all coarse edges and then round all fine ones, the gaps were openings as long as the side, or not, as
// the triangles lay in the file.
TEST(MeshHoles, TJunctionsAreClosedWhateverTheOrderOfTriangles) {
  for (const int finer : {2, 4}) {
    TriangleMesh mesh = cubeWithAFineTop(finer);
    ASSERT_NEAR(enclosedVolume(mesh), 1, 1e-12);
    states::Random random(7);
    for (int order = 0; order < 6; ++order) {
      const RepairedMesh repaired = repairMesh(mesh);
      EXPECT_NEAR(enclosedVolume(repaired.mesh), 1, 1e-12);
      for (const auto& sides : trianglesOnEdges(repaired.mesh)) EXPECT_EQ(sides, (std::array<int, 3>{2, 2, 2}));
      for (std::size_t k = mesh.triangles.size() - 1; k > 0; --k)
        std::swap(mesh.triangles[k], mesh.triangles[std::size_t((random.uniform() + 1) / 2 * double(k))]);
    }
  }
}

}  // namespace medulla
