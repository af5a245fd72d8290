#pragma once

#include "physics/dynamics/contact.h"
#include "physics/model/triangle_mesh.h"

namespace medulla {

// What is drawn of a plane (1 m square about its origin), box or sphere: in the shape's frame, m, wound
// counter-clockwise seen from outside.
TriangleMesh shapeMesh(const StaticShape& shape);

}  // namespace medulla
