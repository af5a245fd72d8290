#pragma once

#include <vector>

#include "physics/model/power_cells.h"
#include "physics/model/soft_body_model.h"
#include "physics/model/surface_queries.h"
#include "physics/model/triangle_mesh.h"

namespace medulla {

// Sets the spheres' link ends: at the frame, except where a chain ends. There the link reaches straight on as far as
// the body goes on with at least half of its section, or the stretch between the last frame and the end of the body
// would neither bend nor stretch: a seventh of a cylinder's length with seven spheres, a fifth of its compliance as a
// cantilever.
void placeLinkEnds(const TriangleMesh& mesh, const SurfaceTree& tree, const PowerSites& sites,
                   const std::vector<ElasticLink>& links, std::vector<FillingSphere>& spheres);

}  // namespace medulla
