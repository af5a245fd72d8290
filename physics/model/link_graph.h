#pragma once

#include <array>
#include <vector>

#include "physics/model/power_cells.h"
#include "physics/model/soft_body_model.h"
#include "physics/model/surface_queries.h"

namespace medulla {

using SphereLinks = std::vector<std::array<int, 2>>;  // lower sphere first, sorted

// Which spheres are linked: the maximum spanning tree of neighbouring cells by contact area over (smaller cell)^(2/3),
// and every further pair whose ratio exceeds 0.15. Pairs whose straight link leaves the body count last. At most
// `degreeMax` links per sphere where the tree allows it. Always one component.
SphereLinks linkCells(const SurfaceTree& tree, const PowerCells& cells, const std::vector<Ball>& balls, bool treeOnly,
                      int degreeMax = 12);

// Whether the body is a tube around its skeleton: the plane sections across the skeleton are nearly filled by the
// largest circle about their centre. Tubes need no links beyond the tree, which would only brace them against bending.
bool isTubular(const TriangleMesh& mesh, const SurfaceTree& tree, const Skeleton& skeleton);

// Adds the shortest links that join separate components.
void joinComponents(const std::vector<Eigen::Vector3d>& centres, SphereLinks& links);
int countComponents(int spheres, const SphereLinks& links);

}  // namespace medulla
