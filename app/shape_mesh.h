#pragma once

#include "physics/dynamics/contact.h"
#include "physics/model/triangle_mesh.h"

namespace medulla {

// What is drawn of a plane (a square about its origin of four times the scene's size, or of 1 m), box or sphere: in the
// shape's frame, m, wound counter-clockwise seen from outside. sceneSize: m, of all bodies together.
TriangleMesh shapeMesh(const StaticShape& shape, double sceneSize);

}  // namespace medulla
