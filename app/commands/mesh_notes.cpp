#include "app/commands/mesh_notes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>

#include "app/files/text.h"
#include "app/standard_streams.h"
#include "physics/model/mesh_topology.h"

namespace medulla {

void noteSize(const std::string& path, const TriangleMesh& mesh) {
  const double size = boundsDiagonal(mesh);
  if (size > 5 || size < 0.005) tell("{}: note: the mesh is {:.3g} m across; is --unit right?\n", path, size);
}

namespace {

// Of triangles that are lower than a twentieth of the edges' mean length. In meshes of organs none is lower than a
// fifth.
std::ptrdiff_t countSlivers(const TriangleMesh& mesh) {
  constexpr double kLow = 0.05;
  std::vector<double> heights;
  double edges = 0;
  for (const auto& [i, j, k] : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[j] - mesh.vertices[i], b = mesh.vertices[k] - mesh.vertices[j],
                          c = mesh.vertices[i] - mesh.vertices[k];
    heights.push_back(a.cross(b).norm() / std::max({a.norm(), b.norm(), c.norm()}));
    edges += (a.norm() + b.norm() + c.norm()) / 3;
  }
  const double low = kLow * edges / static_cast<double>(heights.size());
  return std::count_if(heights.begin(), heights.end(), [low](double height) { return height < low; });
}

}  // namespace

void noteCost(const std::string& path, const TriangleMesh& mesh) {
  constexpr std::size_t kMany = 5000;
  const char* const remesh =
      "runs that touch it are slow; an even mesh of 500 to 2000 nodes, with this one as --fine, is not";
  if (const std::ptrdiff_t slivers = countSlivers(mesh); slivers > 0)
    tell("{}: note: {} of {} triangles are slivers: {}\n", path, slivers, mesh.triangles.size(), remesh);
  else if (mesh.vertices.size() > kMany)
    tell("{}: note: {} nodes: {}\n", path, mesh.vertices.size(), remesh);
}

void noteRepairs(const std::string& path, const std::vector<std::string>& notes) {
  if (!notes.empty()) tell("{}: mesh repair: {}\n", path, joined(notes, "; "));
}

}  // namespace medulla
