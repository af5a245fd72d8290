#include "physics/model/identify/thin_parts.h"

#include <fmt/core.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "physics/model/disjoint_sets.h"
#include "physics/model/identify/held_region.h"
#include "physics/model/plane_section.h"

namespace medulla {

using Eigen::Vector3d;

namespace {

Vector3d middleOf(const HexGrid& grid, const std::array<int, 3>& cell) {
  return grid.low + grid.size * (Vector3d(cell[0], cell[1], cell[2]) + Vector3d::Constant(0.5));
}

// Of each cell the part that it hangs together with, by nodes in common.
std::vector<int> partsOf(const HexGrid& grid) {
  DisjointSets parts(grid.cells.size());
  std::vector<int> cellOfNode(grid.nodes.size(), -1), out;
  for (int c = 0; c < static_cast<int>(grid.cells.size()); ++c) {
    for (const int node : grid.cellNodes[c]) {
      if (cellOfNode[node] < 0) cellOfNode[node] = c;
      parts.join(cellOfNode[node], c);
    }
  }
  for (int c = 0; c < static_cast<int>(grid.cells.size()); ++c) out.push_back(parts.of(c));
  return out;
}

// Midway between the two nearest cells, one of a part and one of the rest.
Vector3d gapBeside(const HexGrid& grid, const std::vector<int>& parts, int part) {
  Vector3d best = Vector3d::Zero();
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < parts.size(); ++a) {
    if (parts[a] != part) continue;
    const Vector3d from = middleOf(grid, grid.cells[a]);
    for (std::size_t b = 0; b < parts.size(); ++b) {
      if (parts[b] == part) continue;
      const Vector3d to = middleOf(grid, grid.cells[b]);
      if ((to - from).squaredNorm() >= least) continue;
      least = (to - from).squaredNorm();
      best = (from + to) / 2;
    }
  }
  return best;
}

// The narrowest section of two cells across the line between their frames: its width as a circle's, and where it is.
std::pair<double, Vector3d> neckBetween(const TriangleMesh& mesh, const CellFrames& cells, int i, int j) {
  constexpr int stations = 200;
  const Vector3d from = cells.frames[i].restPosition, to = cells.frames[j].restPosition;
  double least = std::numeric_limits<double>::infinity();
  Vector3d where = (from + to) / 2;
  for (int k = 1; k < stations; ++k) {
    const Plane plane = planeAcross(from + k * (to - from) / stations, (to - from).normalized());
    const SectionMoments section = planeSection(mesh, plane, &cells.sites, {std::min(i, j), std::max(i, j)});
    if (section.area <= 0 || section.area >= least) continue;
    least = section.area;
    where = plane.origin + plane.u * section.centroid.x() + plane.v * section.centroid.y();
  }
  return {2 * std::sqrt(least / std::numbers::pi), where};
}

}  // namespace

std::string placeText(const Vector3d& place) {
  const auto rounded = [](double x) { return std::round(1e4 * x) / 1e4 + 0.0; };  // no -0
  return fmt::format("({:.4f}, {:.4f}, {:.4f})", rounded(place.x()), rounded(place.y()), rounded(place.z()));
}

void requireConnected(const HexGrid& grid, const std::vector<bool>& isHeld) {
  const std::vector<int> parts = partsOf(grid);
  std::vector<bool> keeps(parts.size(), false);
  bool any = false;
  for (std::size_t c = 0; c < parts.size(); ++c) {
    if (!isHeld[c]) continue;
    keeps[parts[c]] = any = true;
  }
  if (!any) keeps[0] = true;
  for (const int part : parts) {
    if (keeps[part]) continue;
    throw std::runtime_error(fmt::format("too thin near {} m: finite elements of {:.3g} mm fall apart there",
                                         placeText(gapBeside(grid, parts, part)), 1e3 * grid.size));
  }
}

void requireLinked(const TriangleMesh& mesh, const CellFrames& cells, const std::vector<IdentifiedLink>& links,
                   double cellSize) {
  const int count = static_cast<int>(cells.frames.size());
  DisjointSets parts(cells.frames.size() + 1);  // all patches are one: they do not move
  bool held = false;
  for (const IdentifiedLink& link : links) {
    parts.join(link.frame0, std::min(link.frame1, count));
    held = held || link.frame1 >= count;
  }
  const int ground = held ? count : 0;
  double least = std::numeric_limits<double>::infinity();
  std::pair<int, int> nearest;
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      if (parts.of(i) == parts.of(ground) || parts.of(i) == parts.of(j)) continue;
      const double distance = (cells.frames[i].restPosition - cells.frames[j].restPosition).norm();
      if (distance >= least) continue;
      least = distance;
      nearest = {i, j};
    }
  }
  if (!std::isfinite(least)) return;
  const auto [width, where] = neckBetween(mesh, cells, nearest.first, nearest.second);
  throw std::runtime_error(
      fmt::format("too thin near {} m: the neck of {:.2g} mm there is lost among finite elements of {:.3g} mm",
                  placeText(where), 1e3 * width, 1e3 * cellSize));
}

void requireWithinReach(const HexGrid& grid, const TriangleMesh& mesh, const std::vector<int>& heldTriangles) {
  constexpr double reach = 0.5;  // cells, beyond the nearest one's faces: as far as locate() follows
  const std::vector<bool> isHeld = nodesOfTriangles(mesh, heldTriangles);
  double farthest = reach;
  const Vector3d* where = nullptr;
  for (std::size_t n = 0; n < mesh.vertices.size(); ++n) {
    if (isHeld[n]) continue;
    const Vector3d middle = middleOf(grid, grid.cells[locate(grid, mesh.vertices[n]).cell]);
    const double off = (mesh.vertices[n] - middle).cwiseAbs().maxCoeff() / grid.size - 0.5;
    if (off <= farthest) continue;
    farthest = off;
    where = &mesh.vertices[n];
  }
  if (where == nullptr) return;
  throw std::runtime_error(fmt::format(
      "too thin near {} m: finite elements of {:.3g} mm end {:.3g} mm before it, expected within half of one",
      placeText(*where), 1e3 * grid.size, 1e3 * farthest * grid.size));
}

}  // namespace medulla
