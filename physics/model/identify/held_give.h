#pragma once

#include "physics/model/identify/voxel_solid.h"

namespace medulla {

// VoxelSolid::give, for `solid` and `larger` alike: how much more the springs at the rim of what is held have to
// give so that the body answers as in cells of no size. `larger`: the same body in larger cells; it is solved once more
// in cells twice as large.
//
// Where what is held ends, displacements go as the root of the distance or nearly so, which no cell follows: the rim
// holds the body over a part of a cell too much, and every load that the rim feels moves the body too little, by an
// amount of the first order in the cells' size. That amount is the square of the load's stress at the rim: the
// compliance lacks one matrix, of which the energy of the springs within a cell of the rim tells everything but the
// factor. The factor comes from what bulk loads do, by Richardson's extrapolation, or from the rim's angle
// (held_rim.h).
double giveOfHeld(const TriangleMesh& mesh, const SolidSettings& settings, const VoxelSolid& solid,
                  const VoxelSolid& larger);

}  // namespace medulla
