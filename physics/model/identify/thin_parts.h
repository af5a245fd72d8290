#pragma once

#include <string>
#include <vector>

#include "physics/model/identify/cell_frames.h"
#include "physics/model/identify/hex_grid.h"
#include "physics/model/triangle_mesh.h"

namespace medulla {

// A place of the mesh's frame for messages: (x, y, z) m, to a tenth of a millimetre.
std::string placeText(const Eigen::Vector3d& place);

// Throws std::runtime_error, with the place, where the body is so thin that cells were dropped (HexGrid) and others
// hang together with none that `isHeld` (by cell): nothing would keep them. Where no cell is held, all have to hang
// together.
void requireConnected(const HexGrid& grid, const std::vector<bool>& isHeld);

// Throws std::runtime_error, with the place, where a node that is not held lies so far off every cell that quadratic
// shapes say nothing of it: the part that it is on is thinner than cells are kept for.
void requireWithinReach(const HexGrid& grid, const TriangleMesh& mesh, const std::vector<int>& heldTriangles);

// Throws std::runtime_error, with the narrowest place, where links join some cells of spheres to no patch, or, with no
// patch, not to one another: the neck between them is so thin that their cells share no face to speak of.
void requireLinked(const TriangleMesh& mesh, const CellFrames& cells, const std::vector<IdentifiedLink>& links,
                   double cellSize);

}  // namespace medulla
