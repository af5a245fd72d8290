#pragma once

#include "haptics/buckets.h"

// On which side of the bodies' surfaces a point lies. The ways out take time that grows with the whole surface: they
// are for starts and for what went wrong.
namespace medulla {

// How many bodies the point is in, by the surface's crossings of a ray along z: exact but for rounding within a
// triangle's own plane.
int windingNumber(const Buckets& buckets, double alpha, const Eigen::Vector3d& p);

// Whether the triangles that are nearest to the point see it from behind: of a surface that nowhere passes through
// itself, exact. Asks nothing of triangles farther away.
bool liesBehind(const Buckets& buckets, double alpha, const Eigen::Vector3d& p);

// m, to the nearest triangle.
double distanceToSurface(const BlendedSurface& surface, double alpha, const Eigen::Vector3d& p);

// Over the triangle's point of these weights, `standOff` (m) off, and a hundredth nearer to its middle: over an edge
// that has folded in, it could be below the other triangle.
Eigen::Vector3d justOutside(const Triangle& triangle, const Eigen::Vector3d& weights, double standOff);

// Out through the nearest triangle that it is behind, or a near one that leads out of all bodies where they overlap; as
// often as needed, since parts of a surface that trembles may be turned inside out.
Eigen::Vector3d outOfBodies(const Buckets& buckets, double alpha, double standOff, Eigen::Vector3d p);

}  // namespace medulla
