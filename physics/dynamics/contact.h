#pragma once

#include <Eigen/Geometry>

#include "physics/model/triangle_mesh.h"

// Contact between bodies, and between bodies and shapes that do not move (paper 3): what a scene says about it and what
// it reports. Equations: physics/equations/contact.md.
namespace medulla {

enum class ContactMode {
  none,   // bodies pass through each other and through static shapes
  balls,  // the balls of the filling spheres (paper 3): things slip through the gaps between them
  swept,  // the links' round cones, each the hull of its two balls, and the balls of spheres without links: no gaps
};

// A shape that holds the balls of all bodies, whatever the mode: it never moves.
struct StaticShape {
  enum class Kind {
    plane,   // holds what is on the side y < 0 of its frame; y is the normal
    box,     // solid, centred in its frame
    sphere,  // solid, centred in its frame
    mesh,    // bodies are kept on the side to which its triangles' normals point: outside a closed mesh, inside a wall
             // that is wound inside out
  };
  Kind kind = Kind::plane;
  Eigen::Isometry3d worldFromShape = Eigen::Isometry3d::Identity();
  Eigen::Vector3d size = Eigen::Vector3d::Ones();  // m, > 0, box: edge lengths
  double radius = 0;                               // m, > 0, sphere
  TriangleMesh mesh;                               // in the shape's frame
  double friction = 0.2;                           // as Tissue::friction
};

// Two bodies that overlap before anything has moved, or a body and static shapes, by more than one does in use.
struct BodyOverlap {
  int body0 = 0, body1 = 0;  // -1: static shapes
  double depth = 0;          // m, the deepest
};

// Largest penetration so far, in % of the smaller of the two radii in contact.
struct PenetrationReport {
  double bodies = 0, statics = 0;
};

}  // namespace medulla
