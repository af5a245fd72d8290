#pragma once

#include <array>
#include <vector>

#include "physics/model/power_cells.h"
#include "physics/model/soft_body_model.h"
#include "physics/model/surface_queries.h"

namespace medulla {

using SphereLinks = std::vector<std::array<int, 2>>;  // lower sphere first, sorted

// Which spheres are linked: the maximum spanning tree of neighbouring cells by contact area over (smaller cell)^(2/3),
// without contacts across a gap (contactAreasWithin), and every further pair whose ratio exceeds 0.15. Pairs whose
// straight link leaves the body come last in the tree, but count where they share a face: they close rings and shells.
// At most twelve links per sphere where the tree allows it. Always one component. On tubes, too, the tree alone will
// not do: once balls lie side by side, it leads through them one after the other, and a gallbladder of 25 bends five
// times as far as it should.
SphereLinks linkCells(const SurfaceTree& tree, const std::vector<MassProperties>& cells, const ContactAreas& contacts,
                      const std::vector<Ball>& balls);

// Adds the shortest links that join separate components.
void joinComponents(const std::vector<Ball>& balls, SphereLinks& links);
int countComponents(int spheres, const SphereLinks& links);

// Of each sphere, how many links end there.
std::vector<int> linkCounts(std::size_t spheres, const std::vector<ElasticLink>& links);

}  // namespace medulla
