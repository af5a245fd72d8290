#include "physics/model/identify/voxel_solid.h"

#include <fmt/core.h>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>

#include "physics/model/identify/hex_stiffness.h"
#include "physics/model/identify/thin_parts.h"
#include "physics/model/mass_properties.h"
#include "physics/model/mesh_topology.h"
#include "physics/model/surface_queries.h"

namespace medulla {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;

namespace {

// The springs of held triangles, by cell: shape shape^T times stiffness, summed over points a third of a cell apart.
using HeldCells = std::map<int, Eigen::Matrix<double, kHexNodes, kHexNodes>>;

void holdPoint(const HexGrid& grid, const Vector3d& point, double stiffness, HeldCells& held) {
  const HexPoint at = locate(grid, point);
  const Eigen::Map<const Eigen::Matrix<double, kHexNodes, 1>> shape(at.shape.data());
  held.try_emplace(at.cell, Eigen::Matrix<double, kHexNodes, kHexNodes>::Zero()).first->second +=
      stiffness * shape * shape.transpose();
}

// Calls use(point, shapes, area) for points of a triangle a third of a cell apart, with linear shapes of its corners.
template <typename Use>
void overTriangle(const TriangleMesh& mesh, const std::array<int, 3>& corners, double cellSize, const Use& use) {
  const Vector3d o = mesh.vertices[corners[0]], u = mesh.vertices[corners[1]] - o, v = mesh.vertices[corners[2]] - o;
  const double longest = std::max({u.norm(), v.norm(), (u - v).norm()});
  const int parts = std::max(1, static_cast<int>(std::ceil(longest / (cellSize / 3))));
  const double area = u.cross(v).norm() / 2 / (parts * parts);
  const auto at = [&](double a, double b) { use(o + a * u + b * v, Vector3d(1 - a - b, a, b), area); };
  for (int i = 0; i < parts; ++i) {
    for (int j = 0; i + j < parts; ++j) {
      at((i + 1. / 3) / parts, (j + 1. / 3) / parts);
      if (i + j + 1 < parts) at((i + 2. / 3) / parts, (j + 2. / 3) / parts);
    }
  }
}

bool isNear(const Vector3d& point, const TriangleMesh& mesh, const std::vector<std::pair<int, int>>& edges,
            double distance) {
  return std::any_of(edges.begin(), edges.end(), [&](const std::pair<int, int>& edge) {
    const Vector3d start = mesh.vertices[edge.first], along = mesh.vertices[edge.second] - start;
    const double at = std::clamp((point - start).dot(along) / along.squaredNorm(), 0., 1.);
    return (point - start - at * along).squaredNorm() < distance * distance;
  });
}

struct HeldSprings {
  HeldCells all, rim;  // the latter within a cell of where what is held ends
};

// Springs on what bounds the cells: held triangles where material lies behind them, fans where they cut the body.
HeldSprings heldSprings(const TriangleMesh& mesh, const SolidSettings& settings, const HexGrid& grid) {
  HeldSprings held;
  const std::vector<std::pair<int, int>> rim = rimOf(mesh, settings.heldTriangles);
  const auto hold = [&](const Vector3d& point, double area) {
    const double stiffness = kHeldPenalty / grid.size * area;
    holdPoint(grid, point, stiffness, held.all);
    if (isNear(point, mesh, rim, grid.size)) holdPoint(grid, point, stiffness, held.rim);
  };
  const std::function<bool(const Vector3d&)> behind = behindHeld(settings.heldSpaces);
  for (const int t : settings.heldTriangles) {
    const Vector3d normal = areaVector(mesh, mesh.triangles[t]).normalized();
    overTriangle(mesh, mesh.triangles[t], grid.size, [&](const Vector3d& point, const Vector3d&, double area) {
      if (!behind(point - 1e-3 * grid.size * normal)) hold(point, area);
    });
  }
  const SurfaceTree body = makeSurfaceTree(mesh);
  for (const HeldSpace& space : settings.heldSpaces) {
    for (std::size_t t = space.firstFan; t < space.surface.triangles.size(); ++t) {
      const Vector3d aside = 1e-3 * grid.size * areaVector(space.surface, space.surface.triangles[t]).normalized();
      overTriangle(space.surface, space.surface.triangles[t], grid.size,
                   [&](const Vector3d& point, const Vector3d&, double area) {
                     const bool isWithin = behind(point - aside) && behind(point + aside);  // of another region
                     if (!isWithin && isInside(body, point)) hold(point, area);
                   });
    }
  }
  return held;
}

RowSparse springMatrix(const HexGrid& grid, const HeldCells& held) {
  std::vector<Eigen::Triplet<double>> entries;
  for (const auto& [cell, springs] : held) {
    const std::array<int, kHexNodes>& nodes = grid.cellNodes[cell];
    for (int b = 0; b < kHexNodes; ++b) {
      for (int a = 0; a < kHexNodes; ++a)
        for (int k = 0; k < 3; ++k) entries.emplace_back(3 * nodes[a] + k, 3 * nodes[b] + k, springs(a, b));
    }
  }
  const auto size = 3 * static_cast<Index>(grid.nodes.size());
  RowSparse out(size, size);
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

void addHeld(const Eigen::Matrix<double, kHexNodes, kHexNodes>& springs, Eigen::Map<MatrixXd>& matrix) {
  for (int b = 0; b < kHexNodes; ++b) {
    for (int a = 0; a < kHexNodes; ++a)
      for (int k = 0; k < 3; ++k) matrix(3 * a + k, 3 * b + k) += springs(a, b);
  }
}

RowSparse tractions(const TriangleMesh& mesh, const HexGrid& grid) {
  std::vector<double> areas(mesh.vertices.size(), 0);
  for (const std::array<int, 3>& t : mesh.triangles) {
    overTriangle(mesh, t, grid.size, [&](const Vector3d&, const Vector3d& shapes, double area) {
      for (int c = 0; c < 3; ++c) areas[t[c]] += shapes[c] * area;
    });
  }
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<std::map<int, double>> shares(mesh.vertices.size());  // by grid node
  for (const std::array<int, 3>& t : mesh.triangles) {
    overTriangle(mesh, t, grid.size, [&](const Vector3d& point, const Vector3d& shapes, double area) {
      const HexPoint at = locate(grid, point);
      for (int c = 0; c < 3; ++c) {
        const double share = shapes[c] * area / areas[t[c]];
        for (int a = 0; a < kHexNodes; ++a) shares[t[c]][grid.cellNodes[at.cell][a]] += share * at.shape[a];
      }
    });
  }
  for (std::size_t n = 0; n < shares.size(); ++n) {
    for (const auto& [node, share] : shares[n])
      for (int k = 0; k < 3; ++k) entries.emplace_back(3 * node + k, static_cast<int>(3 * n) + k, share);
  }
  RowSparse out(3 * static_cast<Index>(grid.nodes.size()), 3 * static_cast<Index>(mesh.vertices.size()));
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

struct GridPin {
  int node = 0, axis = 0;
};

// Six freedoms of three nodes far apart: holding them takes the rigid motions away and no more.
std::vector<GridPin> isostaticPins(const HexGrid& grid) {
  const auto farthest = [&](const auto& distance) {
    int best = 0;
    for (std::size_t n = 1; n < grid.nodes.size(); ++n)
      if (distance(grid.nodes[n]) > distance(grid.nodes[best])) best = static_cast<int>(n);
    return best;
  };
  const int a = farthest([](const Vector3d& x) { return -x.x(); });
  const Vector3d from = grid.nodes[a];
  const int b = farthest([&](const Vector3d& x) { return (x - from).norm(); });
  const Vector3d line = (grid.nodes[b] - from).normalized();
  const int c = farthest([&](const Vector3d& x) { return (x - from).cross(line).norm(); });
  // Of their nine freedoms the six that rigid motions move most independently.
  const double size = (grid.nodes[b] - from).norm();
  Eigen::Matrix<double, 6, 9> rigid;
  for (int k = 0; k < 9; ++k) {
    const Vector3d r = (grid.nodes[std::array{a, b, c}[k / 3]] - from) / size, axis = Vector3d::Unit(k % 3);
    rigid.col(k).head<3>() = axis;
    rigid.col(k).tail<3>() = r.cross(axis);
  }
  const Eigen::ColPivHouseholderQR<Eigen::Matrix<double, 6, 9>> order(rigid);
  std::vector<GridPin> pins;
  for (int k = 0; k < 6; ++k) {
    const int freedom = order.colsPermutation().indices()[k];
    pins.push_back({std::array{a, b, c}[freedom / 3], freedom % 3});
  }
  return pins;
}

// By cell: the freedoms of it that are pinned, each pin in one cell only.
std::map<int, std::vector<int>> pinnedFreedoms(const HexGrid& grid, const std::vector<GridPin>& pins) {
  std::map<int, std::vector<int>> out;
  for (const GridPin& pin : pins) {
    for (std::size_t c = 0; c < grid.cells.size(); ++c) {
      const auto& nodes = grid.cellNodes[c];
      const auto at = std::find(nodes.begin(), nodes.end(), pin.node);
      if (at == nodes.end()) continue;
      out[static_cast<int>(c)].push_back(3 * static_cast<int>(at - nodes.begin()) + pin.axis);
      break;
    }
  }
  return out;
}

// Held nodes do not move; behind what is held there are no cells to say so.
RowSparse interpolation(const HexGrid& grid, const TriangleMesh& mesh, const std::vector<int>& heldTriangles) {
  const std::vector<Vector3d>& points = mesh.vertices;
  const std::vector<bool> isHeld = nodesOfTriangles(mesh, heldTriangles);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(points.size() * kHexFreedoms);
  for (std::size_t p = 0; p < points.size(); ++p) {
    if (isHeld[p]) continue;
    const HexPoint at = locate(grid, points[p]);
    for (int a = 0; a < kHexNodes; ++a)
      for (int k = 0; k < 3; ++k)
        entries.emplace_back(static_cast<int>(3 * p) + k, 3 * grid.cellNodes[at.cell][a] + k, at.shape[a]);
  }
  RowSparse out(3 * static_cast<Index>(points.size()), 3 * static_cast<Index>(grid.nodes.size()));
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

int voxelsInCells(double volume, double cellSize) {
  // Beyond, voxels and the plan alone would take minutes and gigabytes; even of a row of single cells no more than
  // these have factors of 3 GB.
  constexpr double cellsMax = 2.5e4;
  if (volume / (cellSize * cellSize * cellSize) > cellsMax) {
    throw OverBudget(fmt::format("finite elements of {:.3g} mm would be {:.2g}, expected at most {:.2g}",
                                 1e3 * cellSize, volume / (cellSize * cellSize * cellSize), cellsMax));
  }
  const double voxel = cellSize / HexGrid::kVoxels;
  return static_cast<int>(volume / (voxel * voxel * voxel));
}

}  // namespace

// A slender body that lies aslant fills next to nothing of its box, in which every voxel has a place.
void requireRoom(const TriangleMesh& mesh, double cellSize, double memoryMax) {
  constexpr double kPerVoxel = 8;  // bytes, with the columns' tables
  const double bytes = kPerVoxel * (boundsOf(mesh.vertices).sizes() / (cellSize / HexGrid::kVoxels)).prod();
  if (bytes > memoryMax)
    throw OverBudget(
        fmt::format("finite elements of {:.3g} mm would take {:.2g} GB for the voxels of the body's box, expected "
                    "at most {:.2g} GB: of a slender body that lies aslant it is smaller when turned along an axis",
                    1e3 * cellSize, 1e-9 * bytes, 1e-9 * memoryMax));
}

double metCellSize(const TriangleMesh& mesh, double cellSize) {
  const double volume = massProperties(mesh).volume;
  return HexGrid::kVoxels * voxelSize(volume, voxelsInCells(volume, cellSize));
}

VoxelSolid makeVoxelSolid(const TriangleMesh& mesh, double cellSize, const SolidSettings& settings,
                          const std::function<void(double)>& progress) {
  VoxelSolid solid;
  const double volume = massProperties(mesh).volume;
  const int voxels = voxelsInCells(volume, cellSize);
  requireRoom(mesh, cellSize, settings.memoryMax);
  progress(0);
  solid.voxels = voxeliseEvenly(mesh, volume, voxels);
  progress(0);
  const std::function<bool(const Vector3d&)> behind = behindHeld(settings.heldSpaces);
  for (const VoxelPiece& piece : solid.voxels.pieces) solid.isBehind.push_back(behind(piece.centre));
  solid.grid = makeHexGrid(solid.voxels, solid.isBehind);
  if (solid.grid.cells.empty()) throw std::runtime_error("all material lies behind what is held: nothing to identify");
  const HexGrid& grid = solid.grid;
  solid.plan = planDissection(grid);
  if (8 * solid.plan.factorNumbers > settings.memoryMax) {
    throw OverBudget(fmt::format("finite elements of {:.3g} mm would take {:.1f} GB, expected at most {:.1f} GB",
                                 1e3 * grid.size, 8e-9 * solid.plan.factorNumbers, 1e-9 * settings.memoryMax));
  }
  const HeldSprings springs = heldSprings(mesh, settings, grid);
  const HeldCells& held = springs.all;
  solid.isFree = held.empty();
  std::vector<bool> isHeld(grid.cells.size(), false);
  for (const auto& [cell, shapes] : held) isHeld[cell] = true;
  requireConnected(grid, isHeld);
  const auto pinned = pinnedFreedoms(grid, solid.isFree ? isostaticPins(grid) : std::vector<GridPin>());
  const MatrixXd perPoint = stiffnessPerPoint(settings.poisson);
  const auto cellMatrices = [&](std::span<const int> cells) {
    MatrixXd out = hexStiffness(grid, perPoint, cells);
    for (std::size_t c = 0; c < cells.size(); ++c) {
      Eigen::Map<MatrixXd> matrix(out.col(static_cast<Index>(c)).data(), kHexFreedoms, kHexFreedoms);
      if (const auto own = held.find(cells[c]); own != held.end()) addHeld(own->second, matrix);
      if (const auto pins = pinned.find(cells[c]); pins != pinned.end())
        for (const int freedom : pins->second) matrix(freedom, freedom) += grid.size;
    }
    return out;
  };
  solid.factors = factorise(solid.plan, grid, cellMatrices, progress);
  solid.rimSprings = springMatrix(grid, springs.rim);
  solid.surface = interpolation(grid, mesh, settings.heldTriangles);
  solid.loading = tractions(mesh, grid);
  return solid;
}

// With K the stiffness and S the rim's springs' part of it: K^-1 + give K^-1 S K^-1, positive definite.
void solveSolid(const VoxelSolid& solid, RowMatrix& x) {
  solve(solid.plan, solid.factors, x);
  if (solid.give == 0) return;
  RowMatrix more = solid.rimSprings * x;
  solve(solid.plan, solid.factors, more);
  x += solid.give * more;
}

RowMatrix displacementsUnder(const VoxelSolid& solid, const RowMatrix& forces) {
  RowMatrix x = solid.loading * forces;
  solveSolid(solid, x);
  return x;
}

}  // namespace medulla
