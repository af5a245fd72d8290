#pragma once

#include <optional>

#include "physics/model/surface_queries.h"

namespace medulla {

struct LongEdges {
  double edge = 0, thickness = 0;  // m, of the triangle that is in the middle of those that are too long
};

// Whether most of the surface is of triangles several times as long as the body is thick there. A force on a node acts
// on the triangles around it, and between nodes nothing tells how the surface moves: a cylinder of edges five times its
// thickness answers up to a third too softly, and some a fifth too stiffly; of two and a half, within 4 %.
std::optional<LongEdges> longEdges(const TriangleMesh& mesh, const SurfaceTree& tree);

}  // namespace medulla
