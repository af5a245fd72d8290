#include "assets/shapes/surface_nets.h"

#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "assets/shapes/mesh_check.h"

namespace medulla {

using Eigen::Vector3d;

struct Grid {
  Vector3d origin;
  double spacing;
  std::array<int, 3> size;     // points along x, y, z
  std::vector<double> values;  // x runs fastest
};

static std::size_t pointIndex(const Grid& grid, int x, int y, int z) {
  return (static_cast<std::size_t>(z) * grid.size[1] + y) * grid.size[0] + x;
}

static Grid sampleGrid(const SignedDistance& sdf, const Box& box, double spacing) {
  Grid grid{box.low, spacing, {}, {}};
  for (int a = 0; a < 3; ++a) grid.size[a] = static_cast<int>(std::ceil((box.high[a] - box.low[a]) / spacing)) + 1;
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) grid.values.push_back(sdf(box.low + spacing * Vector3d(x, y, z)));
  return grid;
}

// The vertex of a cell is the mean of the crossings on its edges. False if the surface misses the cell.
static bool cellVertex(const Grid& grid, int x, int y, int z, Vector3d& vertex) {
  Vector3d sum = Vector3d::Zero();
  int crossings = 0;
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 0; axis < 3; ++axis) {
      if (corner >> axis & 1) continue;
      const std::array<int, 3> c = {corner & 1, corner >> 1 & 1, corner >> 2};
      std::array<int, 3> d = c;
      d[axis] = 1;
      const double u = grid.values[pointIndex(grid, x + c[0], y + c[1], z + c[2])];
      const double v = grid.values[pointIndex(grid, x + d[0], y + d[1], z + d[2])];
      if ((u < 0) == (v < 0)) continue;
      sum += Vector3d(c[0], c[1], c[2]) + Vector3d::Unit(axis) * (u / (u - v));
      ++crossings;
    }
  }
  if (crossings == 0) return false;
  vertex = grid.origin + grid.spacing * (Vector3d(x, y, z) + sum / crossings);
  return true;
}

// Two triangles over the shorter diagonal of a quad that is counter-clockwise seen from outside.
static void addQuad(TriangleMesh& mesh, const std::array<int, 4>& q) {
  const double ac = (mesh.vertices[q[0]] - mesh.vertices[q[2]]).norm();
  const double bd = (mesh.vertices[q[1]] - mesh.vertices[q[3]]).norm();
  const int shift = ac < bd ? 0 : 1;
  mesh.triangles.push_back({q[shift], q[shift + 1], q[shift + 2]});
  mesh.triangles.push_back({q[shift], q[shift + 2], q[(shift + 3) % 4]});
}

static TriangleMesh netOnGrid(const Grid& grid) {
  TriangleMesh mesh;
  std::vector<int> vertexOfCell(grid.values.size(), -1);
  for (int z = 0; z + 1 < grid.size[2]; ++z) {
    for (int y = 0; y + 1 < grid.size[1]; ++y) {
      for (int x = 0; x + 1 < grid.size[0]; ++x) {
        Vector3d vertex;
        if (!cellVertex(grid, x, y, z, vertex)) continue;
        vertexOfCell[pointIndex(grid, x, y, z)] = static_cast<int>(mesh.vertices.size());
        mesh.vertices.push_back(vertex);
      }
    }
  }
  // One quad around every grid edge that crosses the surface, through the four cells that share it.
  for (int z = 1; z + 1 < grid.size[2]; ++z) {
    for (int y = 1; y + 1 < grid.size[1]; ++y) {
      for (int x = 1; x + 1 < grid.size[0]; ++x) {
        const std::array<int, 3> p = {x, y, z};
        const bool inside = grid.values[pointIndex(grid, x, y, z)] < 0;
        for (int axis = 0; axis < 3; ++axis) {
          std::array<int, 3> next = p;
          ++next[axis];
          if (inside == (grid.values[pointIndex(grid, next[0], next[1], next[2])] < 0)) continue;
          const int u = (axis + 1) % 3, v = (axis + 2) % 3;
          std::array<int, 4> quad{};
          for (int k = 0; k < 4; ++k) {
            std::array<int, 3> cell = p;
            if (k == 0 || k == 3) --cell[u];
            if (k < 2) --cell[v];
            quad[inside ? k : 3 - k] = vertexOfCell[pointIndex(grid, cell[0], cell[1], cell[2])];
          }
          addQuad(mesh, quad);
        }
      }
    }
  }
  return mesh;
}

TriangleMesh surfaceNets(const SignedDistance& sdf, const Box& box, double spacing) {
  for (const double factor : {1.0, 0.97, 1.04, 0.93, 1.07, 0.9}) {
    TriangleMesh mesh = netOnGrid(sampleGrid(sdf, box, spacing * factor));
    const MeshCheck check = checkMesh(mesh);
    if (!check.closed || !check.manifold || check.components != 1) continue;
    for (Vector3d& v : mesh.vertices) v = projectToSurface(sdf, v, 0.5 * spacing);
    return mesh;
  }
  throw std::runtime_error("surface nets pinch on every grid tried: expected one closed surface inside the box");
}

}  // namespace medulla
