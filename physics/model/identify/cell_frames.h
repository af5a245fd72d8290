#pragma once

#include <map>
#include <utility>
#include <vector>

#include "physics/model/identified_network.h"
#include "physics/model/identify/voxel_solid.h"

namespace medulla {

// What the spheres' frames are in finite elements: each moves as its power cell does in the mean,
//   t = mean u,  theta = J^-1 integral r x u      J the cell's inertia per unit density, r from its centroid.
struct CellFrames {
  std::vector<IdentifiedFrame> frames;
  double lengthScale = 0;  // m, cube root of the mean volume
  RowSparse motion;        // 6 frames x 3 grid nodes: (t at restPosition, lengthScale theta) of each
  // m/N per Pa, in the same six: what held material lets go, by itself, under loads spread over the whole cell. As
  // stiff as held triangles are, it only matters where a cell has nothing else.
  std::vector<Matrix6d> heldGive;
  std::vector<double> heldShare;  // 0..1, of the cell's volume: what lies behind held triangles
  PowerSites sites;
  ContactAreas contactArea;
};

CellFrames makeCellFrames(const TriangleMesh& mesh, const std::vector<Ball>& balls, const VoxelSolid& solid);

}  // namespace medulla
