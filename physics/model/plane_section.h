#pragma once

#include <Eigen/Core>
#include <utility>

#include "physics/model/power_cells.h"
#include "physics/model/triangle_mesh.h"

namespace medulla {

// A plane with its own coordinates: x = origin + a u + b v.
struct Plane {
  Eigen::Vector3d origin, u, v;  // u, v unit and perpendicular
};

// Plane region: area, centroid, second moments and torsion constant, with the plane's u and v as axes.
struct SectionMoments {
  double area = 0;                                         // m2
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();      // m
  Eigen::Matrix2d secondMoment = Eigen::Matrix2d::Zero();  // m4, integral of r r^T about the centroid
  double torsionConstant = 0;                              // m4, Saint-Venant (torsion_constant.h)
  bool holdsOrigin = false;                                // the plane's own origin is in it
};

// Section of the solid inside the mesh, on scan lines along u. With `sites`, only the part within the power cells of
// the spheres `pair`, which may be one, counts. Area 0 where the plane misses. Exact along u; the midpoint rule across.
SectionMoments planeSection(const TriangleMesh& mesh, const Plane& plane, const PowerSites* sites = nullptr,
                            std::pair<int, int> pair = {0, 0});

// Whether the section of the solid encloses a part of the plane that is outside: on the same scan lines, so that holes
// narrower than these are apart may be missed.
bool sectionHasHole(const TriangleMesh& mesh, const Plane& plane);

// Two unit vectors that complete the unit vector `normal` to a right-handed frame (u, v, normal).
Plane planeAcross(const Eigen::Vector3d& origin, const Eigen::Vector3d& normal);

}  // namespace medulla
