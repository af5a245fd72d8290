#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <utility>
#include <vector>

#include "physics/model/mass_properties.h"
#include "physics/model/medial_balls.h"
#include "physics/model/surface_queries.h"

namespace medulla {

// What of a voxel lies inside the mesh, as a box.
struct VoxelPiece {
  std::array<int, 3> index;  // of the voxel
  Eigen::Vector3d centre;    // m
  Eigen::Vector3d extent;    // m, along x, y and z, at most the voxel's size
  double volume = 0;         // m3; may be less than the box's, which is then filled thinly
};

struct VoxelBody {
  double size = 0;                                // m, edge of a voxel
  Eigen::Vector3d low = Eigen::Vector3d::Zero();  // m, corner of voxel (0, 0, 0)
  std::array<int, 3> count{};
  std::vector<VoxelPiece> pieces;  // by x, y, then z
  std::vector<int> pieceAt;        // piece of voxel (i * count[1] + j) * count[2] + k that counts for faces, or -1
};

// The edge of `target` voxels of that volume (m3) together.
double voxelSize(double volume, int target);

// The solid inside a closed mesh of that volume (m3) as about `target` voxels. Every column is cut exactly along z, so
// that the volume converges faster than by counting voxels, and is whole or empty along x and y. A voxel may have
// several pieces, of which the first counts for faces.
VoxelBody voxelise(const TriangleMesh& mesh, double volume, int target);

// The same with one piece for every voxel, which has the volume, the centroid and the second moments along the axes of
// what is inside, nearly alike along all of them: a plate is as thick whichever way it lies. Many times the work.
// Voxels that are half inside count for faces.
VoxelBody voxeliseEvenly(const TriangleMesh& mesh, double volume, int target);

// Voxels that give the cells of so many spheres their volumes and contacts.
constexpr int voxelsFor(int spheres) {
  return spheres > 200 ? 300 * spheres : 60000;
}

// Cell of a ball: the points whose power |x - centre|^2 - weight is least there (Aurenhammer 1987). Weight radius^2
// gives the power diagram, 0 the Voronoi diagram.
struct PowerSites {
  std::vector<Eigen::Vector3d> centres;  // m
  std::vector<double> weights;           // m2
  std::vector<double> reaches;           // m; no point of the body in the cell is further from the centre
};

// The cell that a point lies in.
int cellAt(const PowerSites& sites, const Eigen::Vector3d& point);

// The two sites and those whose cells can border on theirs within the body, in that order.
PowerSites sitesAround(const PowerSites& sites, std::pair<int, int> pair);

struct PowerCells {
  PowerSites sites;
  std::vector<int> cellOfPiece;
  std::vector<MassProperties> cells;  // together exactly the mesh's
};

// Cells of the balls within the body. Balls whose cell would be empty shrink their neighbours' weights for all: from
// the power diagram towards the Voronoi diagram, in which every inner centre owns its surroundings. A cell can stay
// empty (volume 0) where two centres share a voxel or one lies outside.
PowerCells divideByPower(const VoxelBody& body, const std::vector<Ball>& balls, const MassProperties& exact);

using ContactAreas = std::map<std::pair<int, int>, double>;  // m2, of two cells, the lower one first

// Faces of voxels between cells, as elements of the voxels have them: two walls closer than a voxel are in touch.
ContactAreas contactAreas(const VoxelBody& body, const std::vector<int>& cellOfPiece);

// The same without faces that the surface runs between, and for the largest part of every cell that hangs together so:
// a cell whose rim lies in the opposite wall does not touch that wall's cells.
ContactAreas contactAreasWithin(const SurfaceTree& surface, const VoxelBody& body, const std::vector<int>& cellOfPiece);

}  // namespace medulla
