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
};

// Samples stand `step` mm apart: 1/30 of the smallest bending radius leaves no visible facets.
Tube makeTube(const std::vector<Eigen::Vector4d>& controls, double step);

double tubeDistance(const Tube& tube, const Eigen::Vector3d& p);

}  // namespace medulla
