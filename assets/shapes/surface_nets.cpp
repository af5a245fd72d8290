#include "assets/shapes/surface_nets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
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
  const auto at = [&](double x, double y, double z) { return sdf(box.low + spacing * Vector3d(x, y, z)); };
  grid.values.resize(static_cast<std::size_t>(grid.size[0]) * grid.size[1] * grid.size[2]);
  // In blocks of 3 x 3 x 3 points: one whose middle is farther from the surface than three times its own reach takes
  // the middle's value. The net reads values only where the sign changes.
  for (int z = 0; z < grid.size[2]; z += 3)
    for (int y = 0; y < grid.size[1]; y += 3)
      for (int x = 0; x < grid.size[0]; x += 3) {
        const double middle = at(x + 1, y + 1, z + 1);
        const bool far = std::abs(middle) > 5.2 * spacing;
        for (int k = z; k < std::min(z + 3, grid.size[2]); ++k)
          for (int j = y; j < std::min(y + 3, grid.size[1]); ++j)
            for (int i = x; i < std::min(x + 3, grid.size[0]); ++i)
              grid.values[pointIndex(grid, i, j, k)] = far ? middle : at(i, j, k);
      }
  return grid;
}

// The corners of a cell are numbered by bits x, y, z; its edges by 4 * axis + the bits of the two other coordinates.
using Corner = std::array<int, 3>;

static int edgeNumber(int axis, const Corner& corner) {
  return 4 * axis + corner[(axis + 1) % 3] + 2 * corner[(axis + 2) % 3];
}

static double cornerValue(const Grid& grid, const Corner& cell, const Corner& corner) {
  return grid.values[pointIndex(grid, cell[0] + corner[0], cell[1] + corner[1], cell[2] + corner[2])];
}

static int edgeBetween(const Corner& a, const Corner& b) {
  for (int axis = 0; axis < 3; ++axis)
    if (a[axis] != b[axis]) return edgeNumber(axis, a);
  return -1;
}

// Joins the crossed edges of one face of a cell into sheets. Where all four are crossed, the surface is taken to pass
// around each inside corner: both cells at the face decide alike.
static void joinSheetsOnFace(const Grid& grid, const Corner& cell, int axis, int side, std::array<int, 12>& sheetOf) {
  std::array<Corner, 4> loop{};
  for (int k = 0; k < 4; ++k) {
    loop[k][axis] = side;
    loop[k][(axis + 1) % 3] = k == 1 || k == 2;
    loop[k][(axis + 2) % 3] = k >= 2;
  }
  std::array<bool, 4> inside{};
  for (int k = 0; k < 4; ++k) inside[k] = cornerValue(grid, cell, loop[k]) < 0;
  const auto join = [&](int k, int l) {  // the edges that start at the loop's corners k and l
    const int from = sheetOf[edgeBetween(loop[k], loop[(k + 1) % 4])],
              to = sheetOf[edgeBetween(loop[l], loop[(l + 1) % 4])];
    std::replace(sheetOf.begin(), sheetOf.end(), from, to);
  };
  std::vector<int> crossed;
  for (int k = 0; k < 4; ++k)
    if (inside[k] != inside[(k + 1) % 4]) crossed.push_back(k);
  if (crossed.size() == 2) join(crossed[0], crossed[1]);
  if (crossed.size() < 4) return;
  for (int k = 0; k < 4; ++k)
    if (inside[k]) join((k + 3) % 4, k);
}

// One vertex per sheet of the surface in the cell, at the mean of the sheet's edge crossings. (One per cell, as in
// plain surface nets, pinches wherever two sheets share a cell.) Returns the vertex of each edge; empty cells are the
// caller's to skip.
static std::array<int, 12> addCellVertices(const Grid& grid, const Corner& cell, TriangleMesh& mesh) {
  std::array<int, 12> sheetOf{};
  std::iota(sheetOf.begin(), sheetOf.end(), 0);
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) joinSheetsOnFace(grid, cell, axis, side, sheetOf);

  std::array<Vector3d, 12> sum;
  sum.fill(Vector3d::Zero());
  std::array<int, 12> crossings{}, vertexOf{};
  for (int edge = 0; edge < 12; ++edge) {
    const int axis = edge / 4;
    Corner a{};
    a[(axis + 1) % 3] = edge & 1;
    a[(axis + 2) % 3] = edge >> 1 & 1;
    Corner b = a;
    b[axis] = 1;
    const double u = cornerValue(grid, cell, a), v = cornerValue(grid, cell, b);
    if ((u < 0) == (v < 0)) continue;
    sum[sheetOf[edge]] += Vector3d(a[0], a[1], a[2]) + Vector3d::Unit(axis) * (u / (u - v));
    ++crossings[sheetOf[edge]];
  }
  std::array<int, 12> vertexOfSheet{};
  for (int sheet = 0; sheet < 12; ++sheet) {
    if (crossings[sheet] == 0) continue;
    vertexOfSheet[sheet] = static_cast<int>(mesh.vertices.size());
    const Vector3d inCell = Vector3d(cell[0], cell[1], cell[2]) + sum[sheet] / crossings[sheet];
    mesh.vertices.push_back(grid.origin + grid.spacing * inCell);
  }
  for (int edge = 0; edge < 12; ++edge) vertexOf[edge] = vertexOfSheet[sheetOf[edge]];
  return vertexOf;
}

static bool isCrossed(const Grid& grid, const Corner& cell) {
  int inside = 0;
  for (int corner = 0; corner < 8; ++corner)
    inside += cornerValue(grid, cell, {corner & 1, corner >> 1 & 1, corner >> 2}) < 0;
  return inside > 0 && inside < 8;
}

// Two triangles over the shorter diagonal of a quad that is counter-clockwise seen from outside.
static void addQuad(TriangleMesh& mesh, const std::array<int, 4>& q) {
  const double ac = (mesh.vertices[q[0]] - mesh.vertices[q[2]]).norm();
  const double bd = (mesh.vertices[q[1]] - mesh.vertices[q[3]]).norm();
  const int shift = ac < bd ? 0 : 1;
  mesh.triangles.push_back({q[shift], q[shift + 1], q[shift + 2]});
  mesh.triangles.push_back({q[shift], q[shift + 2], q[(shift + 3) % 4]});
}

// The quad around a crossed grid edge, through the four cells that share it.
static void addQuadAround(const Grid& grid, const Corner& point, int axis, const std::vector<int>& slotOfCell,
                          const std::vector<std::array<int, 12>>& vertices, TriangleMesh& mesh) {
  Corner next = point;
  ++next[axis];
  const bool inside = cornerValue(grid, point, {}) < 0;
  if (inside == (cornerValue(grid, next, {}) < 0)) return;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  std::array<int, 4> quad{};
  for (int k = 0; k < 4; ++k) {
    Corner cell = point, inCell{};  // inCell: where the edge stands in that cell
    inCell[u] = k == 0 || k == 3;
    inCell[v] = k < 2;
    cell[u] -= inCell[u];
    cell[v] -= inCell[v];
    const int slot = slotOfCell[pointIndex(grid, cell[0], cell[1], cell[2])];
    quad[inside ? k : 3 - k] = vertices[slot][edgeNumber(axis, inCell)];
  }
  addQuad(mesh, quad);
}

static TriangleMesh netOnGrid(const Grid& grid) {
  TriangleMesh mesh;
  std::vector<int> slotOfCell(grid.values.size(), -1);
  std::vector<std::array<int, 12>> vertices;  // of the crossed cells' edges
  const auto forEach = [&](int first, const auto& visit) {
    for (int z = first; z + 1 < grid.size[2]; ++z)
      for (int y = first; y + 1 < grid.size[1]; ++y)
        for (int x = first; x + 1 < grid.size[0]; ++x) visit(Corner{x, y, z});
  };
  forEach(0, [&](const Corner& cell) {
    if (!isCrossed(grid, cell)) return;
    slotOfCell[pointIndex(grid, cell[0], cell[1], cell[2])] = static_cast<int>(vertices.size());
    vertices.push_back(addCellVertices(grid, cell, mesh));
  });
  forEach(1, [&](const Corner& point) {
    for (int axis = 0; axis < 3; ++axis) addQuadAround(grid, point, axis, slotOfCell, vertices, mesh);
  });
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
