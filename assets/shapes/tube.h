#pragma once

#include <Eigen/Core>
#include <vector>

namespace medulla {

// A tube of changing radius: the union of balls along a centripetal Catmull-Rom spline through (x, y, z, radius), mm.
// Centripetal, because the uniform kind overshoots where control points stand at uneven distances.
struct Tube {
  struct Chunk {  // consecutive samples within one ball: most are skipped when a nearest place is sought
    Eigen::Vector3d centre;
    double radius;
    int first, last;
  };
  std::vector<Eigen::Vector4d> samples;
  std::vector<Chunk> chunks;
  std::vector<double> along;                       // mm of arc from the first sample to each
  std::vector<double> curvature;                   // 1/mm, over about a diameter
  std::vector<Eigen::Vector3d> tangents, normals;  // a frame that turns with the axis, not about it
};

// Samples stand `step` mm apart: 1/30 of the smallest bending radius leaves no visible facets.
Tube makeTube(const std::vector<Eigen::Vector4d>& controls, double step);

double tubeDistance(const Tube& tube, const Eigen::Vector3d& p);

// The ball of the tube whose surface is nearest to a point.
struct TubePlace {
  double fromAxis, radius, along, curvature;  // mm, 1/mm
  Eigen::Vector2d side;                       // unit: where around the axis the point lies, from normal to binormal
};

// Continuous in p wherever curvature x radius < 1, unlike the nearest sample: what is modelled on the tube shows no
// facets.
TubePlace tubePlace(const Tube& tube, const Eigen::Vector3d& p);

}  // namespace medulla
