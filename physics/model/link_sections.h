#pragma once

#include <vector>

#include "physics/model/power_cells.h"
#include "physics/model/soft_body_model.h"
#include "physics/model/triangle_mesh.h"

namespace medulla {

// Gives links (of which the spheres are set) the sections of equivalent uniform beams between the frames of their
// spheres. At stations along the link the mesh is cut across and the part within the two spheres' cells measured, so
// that parallel links of a bulky body do not count its material twice. Areas, tensors of second moments and torsion
// constants are averaged as compliances (harmonically): the stations bear the same load one after the other. Stations
// where the plane misses both cells, as in a sharp bend, are left out. Torsion constant after Saint-Venant: J = A^4 /
// (4 pi^2 Ip), exact for ellipses and within some 10 % for compact solid sections (Timoshenko and Goodier 1970, section
// 109). Never zero: with no station left, the section is that of the smaller ball.
void measureLinks(const TriangleMesh& mesh, const PowerSites& sites, const std::vector<FillingSphere>& spheres,
                  std::vector<ElasticLink>& links);

}  // namespace medulla
