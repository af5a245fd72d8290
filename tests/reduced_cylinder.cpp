#include "tests/reduced_cylinder.h"

#include "physics/model/build.h"
#include "tests/test_shapes.h"

namespace medulla {

using Eigen::Index;
using Eigen::Vector3d;

TriangleMesh cylinder() {
  return cylinderMesh(0.1, 0.01, 18, 20);
}

const SoftBodyModel& cylinderModel() {
  static const SoftBodyModel model = [] {
    BuildSettings settings;
    settings.spheres = 5;
    settings.overshoot = 0;
    settings.renderLevels = 0;
    BuildReport report;
    return buildModel(asRepaired(cylinder()), nullptr, settings, report);
  }();
  return model;
}

std::vector<int> trianglesWhere(const TriangleMesh& mesh, const std::function<bool(const Vector3d&)>& held) {
  std::vector<int> out;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    if (held(mesh.vertices[a]) && held(mesh.vertices[b]) && held(mesh.vertices[c])) out.push_back(static_cast<int>(t));
  }
  return out;
}

Reduced reduceCylinder(bool held) {
  Reduced r;
  r.mesh = cylinder();
  if (held) r.heldTriangles = trianglesWhere(r.mesh, [](const Vector3d& x) { return x.x() < 1e-6; });
  SolidSettings settings;
  settings.heldTriangles = r.heldTriangles;
  r.solid = makeVoxelSolid(r.mesh, 0.007, settings);
  r.cells = makeCellFrames(r.mesh, ballsOf(cylinderModel()), r.solid);
  r.responses = solveFrames(r.solid, r.cells, Eigen::VectorXd::Ones(static_cast<Index>(r.mesh.vertices.size())));
  return r;
}

std::vector<Vector3d> placesOf(const CellFrames& cells) {
  std::vector<Vector3d> places;
  for (const IdentifiedFrame& f : cells.frames) places.push_back(f.restPosition);
  return places;
}

}  // namespace medulla
